"""Peak memory of `arlight run` on a short clip and on a long one made by repeating it."""

from pathlib import Path

from arlight.benchmark.speed.child_process import arlight_command, run_to_end
from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.playback import FilmedClip
from arlight.video.repetition import repeat_clip


def measure_memory(clip: FilmedClip, seconds: tuple[float, float], folder: Path) -> Findings:
    """Peak memory over the length of the clip.

    Args:
        clip: what is repeated.
        seconds: lengths of a short and of a long clip [s].
        folder: for what is read and written.
    """
    runs = []
    path, sidecars = folder / "repeated.mp4", clip.path.parent
    inputs: list[str | Path] = ["run", path, "--probe", sidecars / "probe.json", "--camera", sidecars / "camera.json"]
    outputs: list[str | Path] = ["--output", folder / "relit.mp4", "--lighting", folder / "light.jsonl"]
    for length in seconds:
        frames = repeat_clip(clip.path, path, length)
        done = run_to_end(arlight_command([*inputs, *outputs]))
        runs.append({"seconds": length, "frames": frames, "peak_mb": done.peak_memory_mb, "wall_s": done.wall_s})
    found = Findings(errors={"peak memory, long clip over short": runs[-1]["peak_mb"] / runs[0]["peak_mb"]})
    found.details["memory"] = runs
    return found
