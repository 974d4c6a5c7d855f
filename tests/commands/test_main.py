"""The command itself: help, usage, exit status."""

import re
import subprocess
import sys

import pytest

from arlight.__main__ import main

COMMANDS = ("run", "demo", "probe", "synthesize", "evaluate", "table")


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert all(name in text for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_of_every_command_is_explained(capsys, name):
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])
    assert ended.value.code == 0
    text = " ".join(line.strip("│ ") for line in capsys.readouterr().out.splitlines())
    options = re.split(r"\(default: [^)]*\)", text)[:-1]
    assert options
    for option in options:
        # the option, what it takes, and at least a few words on it
        words = option[option.rindex(" --") :].split()
        assert len(words) >= 5, option


@pytest.mark.parametrize("arguments", [[], ["walk"], ["run"], ["run", "a.mp4", "--no-such-option"], ["evaluate", "a"]])
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
