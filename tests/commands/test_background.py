"""Threads beside the loop: order, errors where they belong, nothing left behind."""

import threading
import time
from contextlib import closing
from itertools import count

import pytest

from arlight.commands.background import InOrder, prefetched


def test_items_come_in_order_with_the_time_they_took():
    def slow():
        for number in range(5):
            time.sleep(0.01)
            yield number

    items = list(prefetched(slow()))
    assert [item for item, _ in items] == list(range(5))
    assert all(0.01 <= seconds < 1.0 for _, seconds in items)


def test_a_source_is_no_further_ahead_than_asked():
    taken = []

    def source():
        for number in count():
            taken.append(number)
            yield number

    with closing(prefetched(source(), ahead=2)) as items:
        for item, _ in items:
            if item == 10:
                break
    assert max(taken) <= 10 + 2


@pytest.mark.parametrize("good", [0, 1, 7])
def test_the_sources_error_comes_after_its_good_items(good):
    def source():
        yield from range(good)
        raise ValueError("broken")

    seen = []

    def take_all():
        for item, _ in prefetched(source()):
            seen.append(item)

    with pytest.raises(ValueError, match="broken"):
        take_all()
    assert seen == list(range(good))


def test_a_source_lives_in_one_thread_to_its_end():
    threads = set()

    def source():
        try:
            for number in count():
                threads.add(threading.get_ident())
                yield number
        finally:
            threads.add(threading.get_ident())
            threads.add("closed")

    with closing(prefetched(source())) as items:
        next(items)
    assert "closed" in threads
    assert len(threads) == 2
    assert threading.get_ident() not in threads


def test_an_empty_source_gives_nothing():
    assert list(prefetched([])) == []


def test_work_is_done_in_order_and_finished_on_leaving():
    done = []

    def work(item):
        time.sleep(0.002)
        done.append(item)

    with InOrder(work, behind=2) as worker:
        for item in range(20):
            worker.put(item)
            assert len(done) >= item - 2
    assert done == list(range(20))


def test_an_error_of_the_work_is_raised_and_ends_it():
    done = []

    def work(item):
        if item == 3:
            raise OSError("disk full")
        done.append(item)

    def put_all():
        with InOrder(work, behind=2) as worker:
            for item in range(100):
                worker.put(item)

    with pytest.raises(OSError, match="disk full"):
        put_all()
    assert done == [0, 1, 2]


def test_an_error_of_the_last_item_is_not_lost():
    def work(_item):
        raise OSError("disk full")

    def put_one():
        with InOrder(work) as worker:
            worker.put(1)

    with pytest.raises(OSError, match="disk full"):
        put_one()


def test_work_handed_over_is_finished_when_the_loop_fails():
    done = []

    def fail():
        with InOrder(done.append) as worker:
            worker.put(1)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert done == [1]
