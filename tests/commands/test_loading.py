"""What starts quickly must not load what takes long: asked of fresh interpreters, which modules they hold."""

import subprocess
import sys

import pytest

from arlight.__main__ import COMMANDS

HEAVY = {
    *("scipy", "matplotlib", "numba", "trimesh", "networkx", "moderngl", "pyrender", "OpenGL"),
    *("reportlab", "PIL", "OpenEXR", "mitsuba"),
}
"""Packages that take long to load, and that only some of the work needs."""
HELP = [[], *([name] for name in COMMANDS), *(["calibrate", name] for name in ("self", "known", "camera", "printer"))]


def packages_after(code: str) -> set[str]:
    """Top-level packages that an interpreter holds after running the code."""
    report = "print('loaded', *sorted({name.partition('.')[0] for name in sys.modules}))"
    done = subprocess.run([sys.executable, "-c", f"import sys\n{code}\n{report}"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split()[1:])


def test_a_heavy_package_would_be_noticed():
    assert packages_after("import scipy.special") & HEAVY == {"scipy"}


@pytest.mark.parametrize("module", ["arlight.commands.run", "arlight.lighting_tracker", "arlight.rendering.relight"])
def test_the_frame_loop_loads_nothing_heavy(module):
    assert packages_after(f"import {module}") & HEAVY == set()


def test_help_loads_no_machinery():
    code = f"""
from arlight.__main__ import main
for arguments in {HELP}:
    try:
        main([*arguments, "--help"])
    except SystemExit:
        pass
"""
    assert packages_after(code) & (HEAVY | {"av"}) == set()


def test_a_run_loads_nothing_heavy(footage, tmp_path):
    outputs = ["--output", str(tmp_path / "relit.mp4"), "--lighting", str(tmp_path / "light.jsonl")]
    arguments = ["run", str(footage / "orbit.mp4"), *outputs, "--directions", "16"]
    loaded = packages_after(f"from arlight.__main__ import main\nassert main({arguments}) == 0")
    assert loaded & HEAVY == set()
    # and it is the run that was looked at
    assert {"av", "cv2", "arlight"} <= loaded
    assert (tmp_path / "light.jsonl").read_text().count("\n") > 2
