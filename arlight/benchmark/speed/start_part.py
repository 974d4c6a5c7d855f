"""How soon a fresh `arlight run` has its first result, with what it keeps between runs and without."""

import sys
import tempfile
from pathlib import Path

from arlight.benchmark.speed.child_process import arlight_command, run_to_end, time_to_lines
from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.spread import paired_ratio, spread
from arlight.benchmark.speed.workloads import FRAME_RATE
from arlight.video.writer import VideoWriter

IMPORTS = "Python importing NumPy, OpenCV and PyAV"


def measure_start(clip: FilmedClip, repeats: int, folder: Path) -> Findings:
    """Wall time from the start of the process to the first frame in the log, and CPU time of running a single frame.

    Args:
        clip: what is run.
        repeats: how often, in turns with a process that only imports what any such program needs.
        folder: for what is written.
    """
    log, relit, single = folder / "first.jsonl", folder / "first.mp4", folder / "single.mp4"
    with VideoWriter(single, frame_rate=FRAME_RATE) as writer:
        writer.write(clip.frames[0])
    sidecars: list[str | Path] = [
        "--probe",
        clip.path.with_name("probe.json"),
        "--camera",
        clip.path.with_name("camera.json"),
    ]
    outputs: list[str | Path] = ["--output", relit, "--lighting", log]
    command = arlight_command(["run", clip.path, *outputs])
    whole = arlight_command(["run", single, *sidecars, *outputs])
    imports = [sys.executable, "-c", "import numpy, cv2, av"]
    run_to_end(whole)
    # the header is a line of its own
    warm = [time_to_lines(command, log, 2) for _ in range(repeats)]
    pairs = [(run_to_end(whole), run_to_end(imports)) for _ in range(repeats)]
    cold = []
    for _ in range(max(1, repeats // 2)):
        with tempfile.TemporaryDirectory(prefix="arlight-bench-") as empty:
            cold.append(time_to_lines(command, log, 2, {"XDG_CACHE_HOME": empty, "NUMBA_CACHE_DIR": empty}))
    own_s, imports_s = [own.cpu_s for own, _ in pairs], [other.cpu_s for _, other in pairs]
    ratio = Ratio(paired_ratio(own_s, imports_s), IMPORTS, 1e3 * spread(own_s).median)
    found = Findings(ratios={f"run of one frame, {clip.workload.name}": ratio})
    found.details["start"] = {
        "name": clip.workload.name,
        "first_result_s": spread(warm).median,
        "first_result_cold_s": spread(cold).median,
        "run_of_one_frame_cpu_s": spread(own_s).median,
        "imports_cpu_s": spread(imports_s).median,
    }
    return found
