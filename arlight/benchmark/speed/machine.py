"""The machine that was measured on."""

import os
import platform
from importlib.metadata import version
from pathlib import Path

_PACKAGES = ("arlight", "numpy", "opencv-contrib-python-headless", "av", "moderngl")


def describe_machine() -> dict[str, object]:
    """Processor, cores and versions, for the JSON file."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "versions": {package: version(package) for package in _PACKAGES},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()
