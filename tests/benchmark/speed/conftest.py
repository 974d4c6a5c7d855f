"""One tiny clip with its truth, for all tests of the benchmark's parts."""

import pytest

from arlight.benchmark.speed.filming import film
from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import load_clip
from arlight.benchmark.speed.spread import Spread
from arlight.benchmark.speed.workloads import Scene, Workload

TINY = Workload("tiny", Scene(order=1, size=(320, 240), sheet_width_px=230.0), half_cycle=3)


@pytest.fixture(scope="session")
def tiny() -> Workload:
    """An order-1 sheet, 230 px wide, from a moving camera; a cycle of six frames."""
    return TINY


@pytest.fixture(scope="session")
def frames_folder(tmp_path_factory, tiny):
    """The tiny workload, filmed; nothing may write to it."""
    folder = tmp_path_factory.mktemp("frames")
    film([tiny], folder, lambda _name: None)
    return folder


@pytest.fixture(scope="session")
def clip(frames_folder, tiny):
    return load_clip(frames_folder, tiny)


@pytest.fixture
def findings():
    """Made-up findings: costs by the median of their ratios, errors by their value."""

    def make(ratios: dict[str, float] | None = None, errors: dict[str, float] | None = None) -> Findings:
        made = {
            name: Ratio(Spread(value, 0.9 * value, 1.2 * value, value, 20), "a yardstick", 5.0)
            for name, value in (ratios or {}).items()
        }
        return Findings(made, dict(errors or {}))

    return make
