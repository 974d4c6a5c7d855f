"""A stream of items through stages, each in a thread of its own, in order.

Between two stages lies a short queue: a slow stage holds up those before it, and nothing piles up. Failure travels both
ways. Down: it takes its item's place, so what was ahead of it is finished first, and then it is raised where the
results are taken. Up: a stage that has ended takes nothing more, so those before it end with what they have in hand.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from threading import Condition, Thread
from types import TracebackType
from typing import Any, Generic, TypeVar

T = TypeVar("T")

_WAITING = 3
"""Items in a queue: enough to bridge uneven ones, few enough that a live source is not behind."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One kind of work."""

    name: str
    """Of its thread."""
    work: Callable[[Any], Any]
    """What is made of each item."""
    finish: Callable[[], None] | None = None
    """Called in the same thread when no more items come, whatever the reason; gives back what belongs to the thread."""


class Chain(Generic[T]):
    """The results of the last stage, one after the other, while earlier items' successors are under way.

    To be iterated once within a `with` block; leaving the block early drops what is under way and returns when every
    thread has ended.
    """

    def __init__(self, items: Iterable[Any], stages: Sequence[Stage], waiting: int = _WAITING) -> None:
        """Prepare the threads.

        Args:
            items: the source; begun, continued and, should it not be used up, closed in a thread of its own.
            stages: what is done with each item, the first with the source's, each other with what the one before made.
            waiting: how many items may lie between two stages, at least 1.
        """
        self._items = items
        self._queues = [_Queue(waiting) for _ in range(len(stages) + 1)]
        self._stopped = False
        self._errors: list[BaseException] = []
        self._threads = [Thread(target=self._feed, name="source")]
        for stage, taken, made in zip(stages, self._queues, self._queues[1:], strict=False):
            self._threads.append(Thread(target=self._run, args=(stage, taken, made), name=stage.name))

    def stop(self) -> None:
        """Take no more items from the source; the results of those already taken still come."""
        self._stopped = True

    def __iter__(self) -> Iterator[T]:
        while not isinstance(result := self._queues[-1].take(), _End):
            yield result
        if result.error is not None:
            self._errors.clear()
            raise result.error

    def __enter__(self) -> "Chain[T]":
        started = []
        try:
            for thread in self._threads:
                thread.start()
                started.append(thread)
        except BaseException:
            self._threads = started
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()
        if kind is None and self._errors:
            raise self._errors[0]

    def _end(self) -> None:
        self._stopped = True
        for queue in self._queues:
            queue.close()
        for thread in self._threads:
            thread.join()

    def _feed(self) -> None:
        """The source's thread."""
        made, end = self._queues[0], _End()
        try:
            iterator = iter(self._items)
            try:
                for item in iterator:
                    if self._stopped or not made.put(item):
                        break
            finally:
                close = getattr(iterator, "close", None)
                if close is not None:
                    close()
        except BaseException as error:
            end = self._failure(error)
        made.put(end)

    def _run(self, stage: Stage, taken: "_Queue", made: "_Queue") -> None:
        """A stage's thread."""
        end = _End()
        try:
            try:
                while not isinstance(item := taken.take(), _End):
                    if not made.put(stage.work(item)):
                        break
                else:
                    end = item
            finally:
                taken.close()
                if stage.finish is not None:
                    stage.finish()
        except BaseException as error:
            end = self._failure(error)
        made.put(end)

    def _failure(self, error: BaseException) -> "_End":
        self._errors.append(error)
        return _End(error)


@dataclass(frozen=True, slots=True)
class _End:
    """Stands in a queue where no more items come."""

    error: BaseException | None = None
    """Why, where they ended before their time."""


class _Queue:
    """Items from one thread to another, a few at most; closed by the one that takes when it wants no more."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._items: deque[Any] = deque()
        self._changed = Condition()
        self._closed = False

    def put(self, item: object) -> bool:
        """Wait for room and append; whether it is still wanted."""
        with self._changed:
            while len(self._items) >= self._size and not self._closed:
                self._changed.wait()
            if not self._closed:
                self._items.append(item)
                self._changed.notify()
            return not self._closed

    def take(self) -> Any:
        """Wait for the first item and remove it; an end where the queue is closed."""
        with self._changed:
            while not self._items and not self._closed:
                self._changed.wait()
            if self._closed:
                return _End()
            self._changed.notify()
            return self._items.popleft()

    def close(self) -> None:
        """Drop what is there and want no more; whoever waits goes on."""
        with self._changed:
            self._closed = True
            self._items.clear()
            self._changed.notify_all()
