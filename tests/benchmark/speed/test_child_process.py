"""Processes of their own: their time, their memory, their failures."""

import sys

import numpy as np
import pytest

from arlight.benchmark.speed.child_process import CommandFailedError, run_to_end, time_to_lines


def python(code):
    return [sys.executable, "-c", code]


def test_memory_is_the_processs_own_and_not_its_parents():
    mine = np.ones(40_000_000)
    small = run_to_end(python("pass"))
    large = run_to_end(python("b = bytearray(100_000_000); b[::4096] = b[::4096]"))
    assert mine.nbytes / 2**20 > 300.0
    assert small.peak_memory_mb < 100.0
    assert large.peak_memory_mb == pytest.approx(small.peak_memory_mb + 95.4, abs=10.0)


def test_a_process_that_fails_says_why():
    with pytest.raises(CommandFailedError, match="no such thing"):
        run_to_end(python("import sys; sys.exit('no such thing')"))


def test_the_environment_reaches_the_process():
    code = "import os, sys; sys.exit(0 if os.environ.get('CHOSEN') == 'yes' else 'missing')"
    run_to_end(python(code), {"CHOSEN": "yes"})
    with pytest.raises(CommandFailedError, match="missing"):
        run_to_end(python(code), {"CHOSEN": "no"})


def test_a_process_is_ended_once_its_file_has_the_lines(tmp_path):
    file = tmp_path / "log"
    code = f"""
import time
with open({str(file)!r}, "w", buffering=1) as log:
    log.write("header\\n")
    log.write("first\\n")
    time.sleep(600)
"""
    assert time_to_lines(python(code), file, 2) > 0.0
    assert file.read_text().splitlines() == ["header", "first"]


def test_lines_of_an_earlier_run_do_not_count(tmp_path):
    file = tmp_path / "log"
    file.write_text("header\nfirst\n")
    with pytest.raises(CommandFailedError, match="broken"):
        time_to_lines(python("import sys; sys.exit('broken')"), file, 2)
