"""Typed access to the fields of a JSON file; what is wrong is refused with file, field and what is allowed."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from arlight.errors import ProbeError


@dataclass(frozen=True, slots=True)
class Field:
    """One value inside a JSON file, and where it stands."""

    value: Any
    """What the JSON holds there."""
    file: Path
    """The file."""
    name: str = ""
    """Path inside the file, such as `blocks[3].frequency`; empty for the whole."""

    @classmethod
    def read(cls, path: Path, kind: str = "probe.json") -> "Field":
        """The whole content of a JSON file.

        Args:
            path: where it is.
            kind: what kind of file it is to be.

        Raises:
            ProbeError: the file is missing, unreadable or not JSON.
        """
        try:
            return cls(json.loads(path.read_text(encoding="utf-8")), path)
        except OSError as error:
            raise ProbeError(f"{path}: cannot be read ({error.strerror}); a {kind} is expected there") from error
        # ValueError covers bad JSON and bad UTF-8; absurdly deep nesting ends in RecursionError
        except (ValueError, RecursionError) as error:
            raise ProbeError(f"{path}: expected JSON ({kind}), found something else ({error})") from error

    def refuse(self, expected: str, found: str | None = None) -> ProbeError:
        """The error to raise when this field is not what it must be."""
        shown = found if found is not None else _shown(self.value)
        where = f"{self.file}: {self.name}" if self.name else f"{self.file}"
        return ProbeError(f"{where}: expected {expected}, found {shown}")

    def has(self, key: str) -> bool:
        """Whether this object has the key with a value other than null."""
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def at(self, key: str) -> "Field":
        """The field `key` of this object."""
        if not isinstance(self.value, dict):
            raise self.refuse(f"an object with the key {key!r}")
        name = f"{self.name}.{key}" if self.name else key
        if key not in self.value:
            raise Field(None, self.file, name).refuse("a value", "no such key")
        return Field(self.value[key], self.file, name)

    def items(self, length: int | None = None) -> list["Field"]:
        """The elements of this list, which must have `length` of them if that is given."""
        if not isinstance(self.value, list) or (length is not None and len(self.value) != length):
            raise self.refuse("a list" if length is None else f"a list of {length}")
        return [Field(item, self.file, f"{self.name}[{i}]") for i, item in enumerate(self.value)]

    def text(self, allowed: Sequence[str]) -> str:
        """One of the allowed strings."""
        if not isinstance(self.value, str) or self.value not in allowed:
            raise self.refuse(f"one of {', '.join(allowed)}")
        return self.value

    def integer(self, low: int, high: int) -> int:
        """An integer in [low, high]."""
        if isinstance(self.value, bool) or not isinstance(self.value, int) or not low <= self.value <= high:
            raise self.refuse(f"an integer from {low} to {high}")
        return self.value

    def number(self, low: float, high: float) -> float:
        """A finite number in [low, high]."""
        value = self.value
        # compared before conversion: a JSON integer may be too long for a float; NaN fails the comparison
        numeric = isinstance(value, int | float) and not isinstance(value, bool)
        if not numeric or not low <= value <= high:
            raise self.refuse(f"a number from {low:g} to {high:g}")
        return float(value)

    def pair(self, low: float, high: float) -> tuple[float, float]:
        """Two finite numbers in [low, high]."""
        first, second = self.items(2)
        return first.number(low, high), second.number(low, high)


def _shown(value: Any) -> str:
    """The value as it stands in JSON, cut short."""
    try:
        text = json.dumps(value)
    except (ValueError, RecursionError):
        return f"a {type(value).__name__} that is too large to show"
    return text if len(text) <= 60 else text[:57] + "..."
