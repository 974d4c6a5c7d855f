"""An even sample of a stream whose length is not known: constant memory however long it is."""

from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class EvenSample(Generic[T]):
    """Every item of a stream until there are many, then every second, every fourth, and so on, from the first on."""

    def __init__(self, most: int) -> None:
        """An empty sample.

        Args:
            most: how many items are never reached, at least 2; from half of that on, that many at least are kept.
        """
        self.items: list[T] = []
        """What is kept, in order."""
        self._most, self._stride, self._offered = most, 1, 0

    def add(self, item: T) -> None:
        """Take the next item into account."""
        self.offer(lambda: item)

    def offer(self, make: Callable[[], T]) -> None:
        """Take the next item into account; it is made only if it is kept."""
        if self._offered % self._stride == 0:
            self.items.append(make())
        self._offered += 1
        if len(self.items) >= self._most:
            self.items = self.items[::2]
            self._stride *= 2
