"""What `arlight demo` takes."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from arlight.commands.options.budget import BudgetOptions
from arlight.commands.options.files import File, OptionalFile
from arlight.commands.options.relighting import RelightingOptions
from arlight.presets import PRESETS, EncodingSettings, PresetName
from arlight.synthetic.motion import PathName


@dataclass(frozen=True)
class DemoOptions:
    """Show the whole loop without a camera: film a sheet that is not there, track it, light an object with its light.

    Frames are synthesised one at a time, as a camera would give them.
    """

    output: File = Path("demo.mp4")
    """The relit video."""
    lighting: OptionalFile = None
    """Pose and lighting, one JSON line a frame."""
    seconds: float = 6.0
    """Length of the video [s]."""
    environment: Annotated[str, tyro.conf.arg(metavar="NAME|FILE")] = "hall"
    """Captured light: the name of one that comes with arlight, or a latitude-longitude .hdr or .exr file."""
    light: Literal["still", "turn"] = "turn"
    """The light stands still, or turns about the zenith."""
    path: PathName = "orbit"
    """How the camera moves."""
    order: int = 5
    """Order of the sheet, 1 to 8."""
    preset: PresetName = "balanced"
    """Speed against accuracy: what the options below are by default."""
    budget: tyro.conf.OmitArgPrefixes[BudgetOptions] = field(default_factory=BudgetOptions)
    relighting: tyro.conf.OmitArgPrefixes[RelightingOptions] = field(default_factory=RelightingOptions)
    encoding: tyro.conf.OmitArgPrefixes[EncodingSettings] = field(default_factory=EncodingSettings)

    @classmethod
    def of_preset(cls, name: PresetName) -> "DemoOptions":
        """What the options are by default where a preset is asked for."""
        preset = PRESETS[name]
        return cls(preset=name, relighting=RelightingOptions(settings=preset.relight), encoding=preset.encoding)
