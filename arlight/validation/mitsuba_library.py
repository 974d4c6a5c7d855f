"""Mitsuba 3, loaded when it is needed: the path tracer that none of our formulas went into."""

import importlib
import os
from pathlib import Path
from types import ModuleType
from typing import Literal

from arlight.errors import ArlightError

Variant = Literal["scalar_rgb", "llvm_ad_rgb"]

_LLVM_PLACES = (
    "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1",
    "/usr/lib/aarch64-linux-gnu/libLLVM.so.19.1",
    "/usr/lib/llvm-19/lib/libLLVM.so.19.1",
)


class ValidationUnavailableError(ArlightError):
    """No Mitsuba on this machine, or no LLVM for its fast variants."""


def load_mitsuba(variant: Variant = "scalar_rgb") -> ModuleType:
    """The module `mitsuba` with a variant chosen.

    Args:
        variant: `scalar_rgb` needs nothing else; `llvm_ad_rgb` traces many paths at a time and needs LLVM.

    Raises:
        ValidationUnavailableError: Mitsuba is not installed, or the variant cannot be loaded.
    """
    try:
        mitsuba = importlib.import_module("mitsuba")
    except ImportError as error:
        raise ValidationUnavailableError(
            f"path tracing needs Mitsuba 3, which cannot be imported ({error}); pip install 'arlight[validate]'"
        ) from error
    if variant.startswith("llvm"):
        _find_llvm()
    try:
        mitsuba.set_variant(variant)
        if variant.startswith("llvm"):
            # the library is only loaded by the first use
            mitsuba.Float(0.0) + 1.0
    except (ImportError, RuntimeError, AttributeError) as error:
        raise ValidationUnavailableError(
            f"Mitsuba's variant {variant} cannot be loaded ({error}); install LLVM 19 (Debian: libllvm19), or name its "
            "library in DRJIT_LIBLLVM_PATH"
        ) from error
    return mitsuba


def _find_llvm() -> None:
    """Prefer LLVM 19 to what the loader would find first: Debian's 14 and 15 abort the program."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    found = next((place for place in _LLVM_PLACES if Path(place).is_file()), None)
    if found is None:
        raise ValidationUnavailableError(
            "Mitsuba's fast variants need LLVM 19, which was not found; install it (Debian: libllvm19), or name its "
            "library in DRJIT_LIBLLVM_PATH"
        )
    os.environ["DRJIT_LIBLLVM_PATH"] = found
