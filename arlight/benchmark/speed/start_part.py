"""How soon a fresh `arlight run` has its first result, with what it keeps between runs and without."""

import sys
import tempfile
from pathlib import Path

from arlight.benchmark.speed.child_process import arlight_command, run_to_end, time_to_lines
from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.spread import paired_ratio, spread

IMPORTS = "Python importing NumPy, OpenCV and PyAV"


def measure_start(clip: FilmedClip, repeats: int, folder: Path) -> Findings:
    """Wall time from the start of the process to the first frame in the log.

    Args:
        clip: what is run.
        repeats: how often, in turns with a process that only imports what any such program needs.
        folder: for what is written.
    """
    log = folder / "first.jsonl"
    command = arlight_command(["run", clip.path, "--output", folder / "first.mp4", "--lighting", log])
    imports = [sys.executable, "-c", "import numpy, cv2, av"]
    # the header is a line of its own
    time_to_lines(command, log, 2)
    warm, yardstick, cold = [], [], []
    for _ in range(repeats):
        yardstick.append(run_to_end(imports).wall_s)
        warm.append(time_to_lines(command, log, 2))
    for _ in range(max(1, repeats // 2)):
        with tempfile.TemporaryDirectory(prefix="arlight-bench-") as empty:
            cold.append(time_to_lines(command, log, 2, {"XDG_CACHE_HOME": empty, "NUMBA_CACHE_DIR": empty}))
    ratio = Ratio(paired_ratio(warm, yardstick), IMPORTS, 1e3 * spread(warm).median)
    found = Findings(ratios={f"first result, {clip.workload.name}": ratio})
    found.details["start"] = {
        "name": clip.workload.name,
        "first_result_s": spread(warm).median,
        "first_result_cold_s": spread(cold).median,
        "imports_alone_s": spread(yardstick).median,
    }
    return found
