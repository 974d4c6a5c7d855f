"""The object that is drawn, where it stands and what draws it."""

from dataclasses import dataclass, field

import tyro

from arlight.commands.options.files import OptionalFile
from arlight.rendering.settings import RelightSettings


@dataclass(frozen=True)
class RelightingOptions:
    """The object that is drawn on the sheet."""

    object: OptionalFile = None
    """A mesh to draw (.glb, .obj, .ply, .stl); an object of our own by default."""
    settings: tyro.conf.OmitArgPrefixes[RelightSettings] = field(default_factory=RelightSettings)
