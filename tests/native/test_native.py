"""Compiled parts: built from their sources, loaded, and refused where they cannot be."""

import ctypes
from pathlib import Path

import numpy as np
import pytest

from arlight.errors import InstallationError
from arlight.native import Workspace, address, library
from arlight.native.build import build


class _Sum(Workspace):
    _fields_ = (("values", ctypes.c_void_p), ("count", ctypes.c_int64))


@pytest.fixture
def package(tmp_path: Path) -> Path:
    (tmp_path / "native").mkdir()
    (tmp_path / "native" / "native.h").write_text('#define EXPORT __attribute__((visibility("default")))\n')
    return tmp_path


def test_a_built_library_reads_the_arrays_of_its_workspace(package: Path) -> None:
    (package / "sum.c").write_text(
        '#include "native.h"\n'
        "struct sum { double *values; long count; };\n"
        "EXPORT double total(struct sum *s) "
        "{ double t = 0; for (long i = 0; i < s->count; i++) t += s->values[i]; return t; }\n"
    )
    build(package)
    total = library(str(package / "sum.py"), "sum").total
    total.restype = ctypes.c_double
    shared = _Sum(count=5)
    shared.hold({"values": np.arange(5.0)})
    assert total(ctypes.byref(shared)) == 10.0


def test_only_what_is_older_than_its_source_is_built_again(package: Path) -> None:
    source = package / "one.c"
    source.write_text("int one(void) { return 1; }\n")
    build(package)
    first = (package / "libone.so").stat().st_ino
    build(package)
    assert (package / "libone.so").stat().st_ino == first


def test_a_source_that_does_not_compile_is_named(package: Path) -> None:
    (package / "broken.c").write_text("this is not C\n")
    with pytest.raises(RuntimeError, match=r"broken\.c"):
        build(package)


def test_a_missing_compiler_is_named(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (package / "one.c").write_text("int one(void) { return 1; }\n")
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(RuntimeError, match="no-such-compiler"):
        build(package)


def test_a_missing_library_says_how_to_get_it(tmp_path: Path) -> None:
    with pytest.raises(InstallationError, match="pip install"):
        library(str(tmp_path / "x.py"), "absent")


@pytest.mark.parametrize("array", [np.zeros((4, 4))[:, ::2], np.zeros(3, np.float32)])
def test_arrays_that_compiled_code_would_misread_are_refused(array: np.ndarray) -> None:
    with pytest.raises(TypeError, match="contiguous"):
        address(array, np.float64)


def test_a_workspace_refuses_strided_arrays() -> None:
    with pytest.raises(TypeError, match="values"):
        _Sum().hold({"values": np.zeros((4, 4))[:, ::2]})
