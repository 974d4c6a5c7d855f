"""Ctrl-C ends a run after the frame in hand, so that every file is complete; a second one ends it at once."""

import signal
from types import FrameType
from typing import Any

INTERRUPTED_EXIT_CODE = 130
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Within the `with` block the first SIGINT or SIGTERM only sets `requested`; a second raises KeyboardInterrupt."""

    def __init__(self) -> None:
        self.requested = False
        """Whether the run is to end after the frame in hand."""
        self._previous: dict[signal.Signals, Any] = {}

    def __enter__(self) -> "Interruption":
        for number in _SIGNALS:
            self._previous[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(self, *_exception: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
