"""The error of single frames beside its bound."""

from arlight.benchmark.speed.bound_part import measure_bound


def test_no_estimate_is_better_than_its_bound_and_less_noise_leaves_the_share(clip):
    found = measure_bound(clip, 60)
    together = found.details["bound"]["together"]
    assert found.errors == {"light of one frame over its bound": together}
    assert len(found.details["bound"]["by_order"]) == clip.probe.order + 1
    # four numbers of sixty frames: known to 5 %
    assert together > 0.9
    quieter = measure_bound(clip, 60, pixel_noise=0.006).details["bound"]["together"]
    assert 0.8 < quieter / together < 1.25


def test_the_same_frames_tell_the_same(clip):
    assert measure_bound(clip, 5).errors == measure_bound(clip, 5).errors
