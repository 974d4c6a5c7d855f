"""Work that is done beside the loop, each kind in a thread of its own and in order."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from time import perf_counter
from typing import Generic, TypeVar

T = TypeVar("T")

# enough to bridge an uneven frame, few enough that a live source is not behind
_AHEAD = 3


def prefetched(items: Iterable[T], ahead: int = _AHEAD) -> Generator[tuple[T, float], None, None]:
    """The items, fetched in another thread a few at a time before they are asked for.

    The source is begun, continued and, should the consumer stop early, closed in that one thread.

    Args:
        items: the source; its errors are raised where the item would have come.
        ahead: how many items are fetched before they are needed, at least 1.

    Yields:
        Each item with the seconds that the source took for it.
    """
    with ThreadPoolExecutor(1, "source") as thread:
        iterator = thread.submit(iter, items).result()
        waiting = deque(thread.submit(_next, iterator) for _ in range(ahead))
        try:
            while (item := waiting.popleft().result()) is not None:
                waiting.append(thread.submit(_next, iterator))
                yield item
        finally:
            for future in waiting:
                future.cancel()
            close = getattr(iterator, "close", None)
            if close is not None:
                thread.submit(close).result()


class InOrder(Generic[T]):
    """Hands items to a function in another thread, one after the other.

    An error of the function is raised by a later `put`, or by leaving the `with` block; nothing is done after it.
    """

    def __init__(self, work: Callable[[T], None], behind: int = _AHEAD) -> None:
        """Prepare the thread.

        Args:
            work: what is done with each item.
            behind: how many items may wait, at least 1; `put` waits while there are more.
        """
        self._work, self._behind = work, behind
        self._thread = ThreadPoolExecutor(1, "results")
        self._waiting: deque[Future[None]] = deque()
        self._failed = False

    def put(self, item: T) -> None:
        """Hand over the next item."""
        while len(self._waiting) >= self._behind:
            self._waiting.popleft().result()
        self._waiting.append(self._thread.submit(self._do, item))

    def __enter__(self) -> "InOrder[T]":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_exception: object) -> None:
        # what was handed over is finished whatever ended the block
        self._thread.shutdown(wait=True)
        if kind is None:
            for future in self._waiting:
                future.result()

    def _do(self, item: T) -> None:
        if self._failed:
            return
        try:
            self._work(item)
        except BaseException:
            self._failed = True
            raise


def _next(iterator: Iterator[T]) -> tuple[T, float] | None:
    started = perf_counter()
    for item in iterator:
        return item, perf_counter() - started
    return None
