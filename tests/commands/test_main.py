"""The command itself: help, usage, exit status."""

import re
import subprocess
import sys

import pytest

from arlight.__main__ import COMMANDS, main

CALIBRATIONS = ("self", "known", "camera", "printer")
TASKS = [name.split() for name in COMMANDS if name != "calibrate"] + [["calibrate", name] for name in CALIBRATIONS]


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert all(name in text for name in COMMANDS)


def test_help_on_calibration_lists_what_can_be_calibrated(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["calibrate", "--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert all(re.search(rf"• {name}\b", text) for name in CALIBRATIONS)


@pytest.mark.parametrize("task", TASKS, ids=" ".join)
def test_every_option_of_every_command_is_explained(capsys, task):
    with pytest.raises(SystemExit) as ended:
        main([*task, "--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert f"usage: arlight {' '.join(task)} " in text
    # an option begins a line of its frame, what is said of it is indented
    options = re.split(r"^[│ ] (?=--[a-z])", text, flags=re.M)[1:]
    assert options
    for option in options:
        # the option, what it takes, and at least a few words on it
        words = re.split(r"\((?:default|required)\b", option)[0].strip("│ \n").split()
        assert len(words) >= 5, option


WRONG = [
    [], ["walk"], ["run"], ["run", "a.mp4", "--no-such-option"], ["evaluate", "a"], ["calibrate"],
    ["calibrate", "lens"], ["calibrate", "self"],
]  # fmt: skip


@pytest.mark.parametrize("arguments", WRONG)
def test_wrong_usage_ends_with_status_2(capsys, arguments):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "arlight" in capsys.readouterr().err


def test_the_package_loads_no_renderer_until_it_is_asked_for():
    code = "import sys, arlight; print([m for m in ('moderngl', 'cv2', 'matplotlib') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    code = code.replace("import sys, arlight", "import sys; from arlight import LightingTracker").replace("'cv2', ", "")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_command_loads_itself_alone():
    code = "import sys; from arlight.__main__ import main; main(['evaluate', 'none.jsonl', '--truth', 'none.json']); "
    code += "print([m for m in ('matplotlib', 'trimesh', 'reportlab') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert "none.jsonl" in done.stderr
