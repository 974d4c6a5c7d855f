"""An even sample: everything of a short stream, evenly spread over a long one."""

import pytest

from arlight.results.sample import EvenSample


@pytest.mark.parametrize("most", [2, 3, 8, 25])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 24, 25, 1000])
def test_it_is_even_and_begins_with_the_first(most, count):
    sample = EvenSample(most)
    for item in range(count):
        sample.add(item)
        assert len(sample.items) < most
    kept = sample.items
    if count < most:
        assert kept == list(range(count))
    else:
        step = kept[1] - kept[0] if len(kept) > 1 else count
        assert kept == list(range(0, count, step))
        assert len(kept) >= most // 2


def test_what_is_not_kept_is_not_made():
    sample, made = EvenSample(8), []

    def make(item):
        made.append(item)
        return item

    for item in range(1000):
        sample.offer(lambda item=item: make(item))
    assert len(made) < 8 * 8
    assert set(sample.items) <= set(made)
