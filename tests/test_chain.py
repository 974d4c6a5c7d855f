"""Stages in threads: order, errors where they belong, nobody left waiting, nothing left behind."""

import threading
import time
from itertools import count

import pytest

from arlight.chain import Chain, Stage

STAGES = 3


def passing(names=range(STAGES), work=lambda item: item):
    return [Stage(str(name), work) for name in names]


def failing_at(place, item, error):
    """Stages that hand on what they get, one of which fails at an item; place 0 is the first."""

    def fail(found):
        if found == item:
            raise error
        return found

    return [Stage(str(k), fail if k == place else lambda found: found) for k in range(STAGES)]


@pytest.fixture(autouse=True)
def no_thread_is_left():
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) <= before


@pytest.mark.parametrize("stages", [0, 1, 4])
@pytest.mark.parametrize("waiting", [1, 3])
@pytest.mark.parametrize("number", [0, 1, 50])
def test_every_item_goes_through_every_stage_in_order(stages, waiting, number):
    with Chain(range(number), passing(range(stages), lambda item: item + 1000), waiting) as chain:
        assert list(chain) == [item + 1000 * stages for item in range(number)]


def test_stages_work_at_the_same_time():
    # each stage waits for the other: one after the other they would wait for ever
    meeting = threading.Barrier(2, timeout=30.0)

    def meet(item):
        meeting.wait()
        return item

    # the first stage of item 1 meets the second of item 0; at both ends there is nobody to meet
    stages = [
        Stage("first", lambda item: item if item == 0 else meet(item)),
        Stage("second", lambda item: item if item == 4 else meet(item)),
    ]
    with Chain(range(5), stages) as chain:
        assert list(chain) == list(range(5))


@pytest.mark.parametrize("waiting", [1, 2])
def test_nothing_piles_up_before_a_slow_consumer(waiting):
    taken = []

    def source():
        for number in range(200):
            taken.append(number)
            yield number

    with Chain(source(), passing(), waiting) as chain:
        for item in chain:
            time.sleep(0.001 if item < 20 else 0.0)
            # one in every queue's places, one in every thread's hand
            assert len(taken) <= item + 1 + (STAGES + 1) * (waiting + 1)


@pytest.mark.parametrize("good", [0, 1, 7, 30])
@pytest.mark.parametrize("place", [-1, 0, 1, 2])
def test_an_error_comes_after_the_items_ahead_of_it_and_ends_everything(place, good):
    error, taken, seen = ValueError("broken"), [], []

    def source():
        for number in count():
            if place == -1 and number == good:
                raise error
            taken.append(number)
            yield number

    def take_all():
        with Chain(source(), failing_at(place, good, error)) as chain:
            seen.extend(chain)

    with pytest.raises(ValueError, match="broken") as caught:
        take_all()
    assert caught.value is error
    assert seen == list(range(good))
    assert len(taken) <= good + (STAGES + 1) * 3 + 1


def test_a_source_that_cannot_be_begun():
    class Source:
        def __iter__(self):
            raise OSError("no such file")

    with pytest.raises(OSError, match="no such file"), Chain(Source(), passing()) as chain:
        list(chain)


@pytest.mark.parametrize("place", [0, 1, 2])
def test_an_error_is_not_lost_when_the_rest_is_not_wanted(place):
    failed = threading.Event()

    def fail(item):
        if item == 1:
            failed.set()
            raise OSError("disk full")
        return item

    def take_one():
        with Chain(count(), [Stage(str(k), fail if k == place else lambda item: item) for k in range(3)]) as chain:
            assert next(iter(chain)) == 0
            failed.wait(30.0)

    with pytest.raises(OSError, match="disk full"):
        take_one()


def test_the_consumers_own_error_goes_before_a_stages():
    failed = threading.Event()

    def fail(_item):
        failed.set()
        raise OSError("disk full")

    def consume():
        with Chain([1], [Stage("fail", fail)]):
            failed.wait(30.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        consume()


@pytest.mark.parametrize("after", [0, 1, 10])
def test_after_stop_what_was_taken_is_finished(after):
    taken, closed = [], []

    def source():
        try:
            for number in count():
                taken.append(number)
                yield number
        finally:
            closed.append(True)

    results = []
    with Chain(source(), passing()) as chain:
        if after == 0:
            chain.stop()
        for item in chain:
            results.append(item)
            if len(results) == after:
                chain.stop()
    # an item that was being taken meanwhile is put back by nobody
    assert results == taken[: len(results)]
    assert len(taken) - 1 <= len(results)
    assert len(results) <= after + (STAGES + 1) * 3 + 1
    assert closed == [True]


@pytest.mark.parametrize("place", range(STAGES))
def test_leaving_early_ends_those_who_wait_for_room_and_those_who_wait_for_items(place):
    # behind the slow stage nobody has anything, before it everything is full
    release = threading.Event()

    def slow(item):
        if item == 3:
            release.wait(30.0)
        return item

    with Chain(count(), [Stage(str(k), slow if k == place else lambda item: item) for k in range(STAGES)]) as chain:
        for item in chain:
            if item == 2:
                time.sleep(0.05)
                release.set()
                break


def test_a_source_lives_in_one_thread_to_its_end():
    threads, closed = set(), []

    def source():
        try:
            for number in count():
                threads.add(threading.get_ident())
                yield number
        finally:
            threads.add(threading.get_ident())
            closed.append(True)

    with Chain(source(), passing()) as chain:
        next(iter(chain))
    assert closed == [True]
    assert len(threads) == 1
    assert threading.get_ident() not in threads


@pytest.mark.parametrize("ending", ["the end", "an error", "an error before it", "an error behind it", "leaving"])
def test_a_stage_gives_back_what_it_holds_in_its_own_thread(ending):
    threads = []

    def fail(item):
        if item == 3:
            raise ValueError("broken")
        return item

    def own(item):
        threads.append(threading.get_ident())
        return fail(item) if ending == "an error" else item

    stages = [
        Stage("before", fail if ending == "an error before it" else lambda item: item),
        Stage("owner", own, lambda: threads.append(("finished", threading.get_ident()))),
        Stage("behind", fail if ending == "an error behind it" else lambda item: item),
    ]

    def run():
        with Chain(range(10), stages) as chain:
            for _ in chain:
                if ending == "leaving":
                    break

    if ending.startswith("an error"):
        with pytest.raises(ValueError, match="broken"):
            run()
    else:
        run()
    assert threads[-1] == ("finished", threads[0])
    assert len(set(threads[:-1])) == 1


def test_an_error_of_giving_back_is_raised_after_the_last_result():
    def finish():
        raise OSError("still in use")

    results = []

    def run():
        with Chain(range(5), [Stage("owner", lambda item: item, finish)]) as chain:
            results.extend(chain)

    with pytest.raises(OSError, match="still in use"):
        run()
    assert results == list(range(5))


def test_a_thread_that_cannot_be_started_leaves_no_other(monkeypatch):
    start = threading.Thread.start

    def start_some(thread):
        if thread.name == "1":
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", start_some)
    with pytest.raises(RuntimeError, match="can't start"), Chain(count(), passing()):
        pass
