"""What `arlight run` takes."""

from dataclasses import dataclass, field

import tyro

from arlight.commands.options.budget import BudgetOptions
from arlight.commands.options.files import OptionalFile, PositionalFile
from arlight.commands.options.footage import FootageOptions
from arlight.commands.options.relighting import RelightingOptions
from arlight.presets import PRESETS, EncodingSettings, PresetName
from arlight.tracker_settings import TrackerSettings


@dataclass(frozen=True)
class RunOptions:
    """Relight a recorded clip: track the sheet, estimate its light, draw an object under that light.

    Ctrl-C ends the run after the frame in hand; all files are then complete up to it. An existing file is replaced only
    when the run ends and the sheet was seen: until then the new one grows beside it as NAME.partial.EXT. A new file
    grows under its own name. Either can be read up to the last frames even if the program is killed.
    """

    clip: PositionalFile
    """The video of the sheet; probe.json and camera.json beside it are found by themselves."""
    output: OptionalFile = None
    """The relit video; CLIP-relit.mp4 in the current folder by default."""
    lighting: OptionalFile = None
    """Pose and lighting, one JSON line a frame as it is done; with --no-render CLIP.jsonl in the current folder by
    default."""
    report: OptionalFile = None
    """An HTML page with the coefficients over time and the recovered light beside thumbnails."""
    render: bool = True
    """Draw the object and write the relit video; --no-render only estimates pose and lighting."""
    preset: PresetName = "balanced"
    """Speed against accuracy: what the options below are by default."""
    budget: tyro.conf.OmitArgPrefixes[BudgetOptions] = field(default_factory=BudgetOptions)
    tracker: tyro.conf.OmitArgPrefixes[TrackerSettings] = field(default_factory=TrackerSettings)
    footage: tyro.conf.OmitArgPrefixes[FootageOptions] = field(default_factory=FootageOptions)
    relighting: tyro.conf.OmitArgPrefixes[RelightingOptions] = field(default_factory=RelightingOptions)
    encoding: tyro.conf.OmitArgPrefixes[EncodingSettings] = field(default_factory=EncodingSettings)

    @classmethod
    def of_preset(cls, name: PresetName) -> "RunOptions":
        """What the options are by default where a preset is asked for; the clip is still to be named."""
        preset = PRESETS[name]
        relighting = RelightingOptions(settings=preset.relight)
        return cls(tyro.MISSING, preset=name, tracker=preset.tracker, relighting=relighting, encoding=preset.encoding)
