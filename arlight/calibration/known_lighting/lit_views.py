"""Frames under known light, measured: what calibration sees of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.layers.sheet_view import SheetView
from arlight.calibration.layers.view_measurement import SeenSheet
from arlight.camera import Camera
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import BlockLayout
from arlight.tracking.blocks import BlockMeter

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LitView:
    """A view of the sheet under known light."""

    sheet: SheetView
    """Measurements, and how they were made."""
    mirrored: Array
    """(blocks, 3) what the film's upper face mirrors of the environment [radiance]."""


def measure(
    seen: Sequence[SeenSheet],
    lights: Sequence[KnownLight],
    probe: Probe,
    camera: Camera,
    assembly: Assembly,
    stripes: Sequence[Array] | None = None,
) -> list[LitView]:
    """Measure frames under known light.

    Args:
        seen: frames with pose and number of their light.
        lights: the lights by number.
        probe: the sheet as designed.
        camera: intrinsics that all frames share.
        assembly: where film and glass are believed to be.
        stripes: (blocks, 7, 3) of each frame as it is predicted, to guide subsampled chroma.
    """
    meter = BlockMeter(probe, camera, assembly=assembly)
    layout = BlockLayout.of_probe(probe)
    slab = assembly.slab(probe)
    views = []
    for number, frame in enumerate(seen):
        pose = frame.pose.camera_from_probe
        assert pose is not None
        means = meter.measure(frame.frame, pose, frame.pose.blur_px, None if stripes is None else stripes[number])
        sheet = SheetView.of(means, assembly, probe, camera, pose, frame.pose.blur_px, frame.light)
        views.append(LitView(sheet, lights[frame.light].mirrored(pose, layout.centers_mm, layout.half_mm, slab)))
    return views
