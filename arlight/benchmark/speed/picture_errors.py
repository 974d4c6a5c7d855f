"""How wrong a composite is beside the picture that true pose and light make."""

import numpy as np

from arlight.benchmark.speed.clip_errors import relative_rms, true_lighting
from arlight.estimation.lighting import Lighting
from arlight.probe.design import Probe
from arlight.rendering.relight import Relighter
from arlight.synthetic.truth import FrameTruth
from arlight.video.frame import Frame, Region

_CHANGED = 1e-6
"""Linear light by which a pixel differs from the recorded one at least where something was drawn."""


def reference_picture(finest: Relighter, frame: Frame, truth: FrameTruth, like: Lighting, probe: Probe) -> Frame:
    """A frame as it should be.

    Args:
        finest: draws it.
        frame: as it was recorded; truth: its pose and light.
        like: some lighting of it, for the light's units.
        probe: the sheet.
    """
    return finest.render(frame, truth.pose, true_lighting(like, truth, probe))


def picture_error(frame: Frame, composite: Frame, reference: Frame) -> float:
    """Error of a composite where it or the reference differs from the recorded frame: object, shadow and their edges.

    Returns:
        rms of the difference in linear light, relative to the rms of the reference there; nan where nothing is drawn.
    """
    region = _changed_region(frame, composite, reference)
    if region is None:
        return float("nan")
    recorded, shown, true = (each.linear_rgb(region) for each in (frame, composite, reference))
    drawn = np.any((np.abs(shown - recorded) > _CHANGED) | (np.abs(true - recorded) > _CHANGED), axis=2)
    return relative_rms(shown[drawn], true[drawn])


def _changed_region(frame: Frame, *others: Frame) -> Region | None:
    """The box of the pixels whose first plane differs."""
    differs = np.any([other.planes[0] != frame.planes[0] for other in others], axis=0)
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if len(rows) == 0:
        return None
    return Region(int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)
