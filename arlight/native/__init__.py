"""The compiled parts: C beside the Python that calls it, one library a source file.

`X.c` of a folder is built into `libX.so` beside it when the package is installed (`build`), and loaded by `library`.
What Python and C share is a structure of pointers to arrays that Python owns; it is filled once, so that a call costs
no conversion. Calls release the interpreter's lock, unless they are so short that to get it back would take longer.
"""

import ctypes
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from arlight.errors import InstallationError

__all__ = ["Workspace", "address", "library"]


def library(source: str, name: str, keeps_lock: bool = False) -> ctypes.CDLL:
    """The library built from `name`.c beside a Python file.

    Args:
        source: the Python file's `__file__`.
        name: of the C file, without its suffix.
        keeps_lock: whether calls keep the interpreter's lock: for what takes some 50 microseconds at most.

    Raises:
        InstallationError: it was not built, or for another machine.
    """
    path = Path(source).with_name(f"lib{name}.so")
    try:
        return (ctypes.PyDLL if keeps_lock else ctypes.CDLL)(str(path))
    except OSError as error:
        raise InstallationError(
            f"{path}: the compiled part of arlight cannot be loaded ({error}); "
            "install arlight again with `pip install .`, which needs a C compiler such as gcc"
        ) from error


def address(array: NDArray[np.generic], dtype: type) -> int:
    """Where a C-contiguous array of that type begins in memory; the caller keeps it alive.

    Raises:
        TypeError: of another type, or not contiguous: the compiled code would read something else.
    """
    if array.dtype != dtype or not array.flags.c_contiguous:
        raise TypeError(f"expected a C-contiguous array of {np.dtype(dtype)}, found {array.dtype}, {array.flags}")
    if array.flags.writeable and array.size:
        # a quarter of the time that `array.ctypes` takes
        return ctypes.addressof(ctypes.c_char.from_buffer(array))  # type: ignore[arg-type]
    return array.ctypes.data


class Workspace(ctypes.Structure):
    """Base of the structures that Python and C share; holds on to the arrays whose pointers it contains."""

    def hold(self, arrays: Mapping[str, NDArray[np.generic]]) -> None:
        """Point fields at arrays; they live as long as the structure."""
        for name, array in arrays.items():
            if not array.flags.c_contiguous:
                raise TypeError(f"{name}: expected a C-contiguous array, found strides {array.strides}")
            setattr(self, name, array.ctypes.data)
        self.__dict__.setdefault("held", {}).update(arrays)
