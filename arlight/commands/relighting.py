"""The object that is drawn, where it stands and what draws it."""

from dataclasses import dataclass, field

import tyro
from rich.console import Console
from rich.progress import Progress

from arlight.camera import Camera
from arlight.commands.options import OptionalFile
from arlight.pipeline import FrameRelighter
from arlight.probe.design import Probe
from arlight.rendering.default_object import default_object
from arlight.rendering.mesh_file import load_mesh
from arlight.rendering.relight import Relighter, RelightSettings


@dataclass(frozen=True)
class RelightingOptions:
    """The object that is drawn on the sheet."""

    object: OptionalFile = None
    """A mesh to draw (.glb, .obj, .ply, .stl); an object of our own by default."""
    settings: tyro.conf.OmitArgPrefixes[RelightSettings] = field(default_factory=RelightSettings)


def make_relighter(
    options: RelightingOptions, probe: Probe, camera: Camera, order: int | None = None
) -> FrameRelighter:
    """Load the object and fold its shadows into matrices, with a progress line.

    Args:
        options: the object and how it stands on the sheet.
        probe: the sheet.
        camera: intrinsics of the frames to come.
        order: highest order of the light; the sheet's by default.

    Raises:
        MeshError: the object cannot be used.
        RenderingUnavailableError: there is no headless OpenGL.
    """
    mesh = default_object() if options.object is None else load_mesh(options.object)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("preparing the object", total=1.0)
        return Relighter(
            mesh, probe, camera, options.settings, lambda share: progress.update(task, completed=share), order
        )
