"""The whole loop, as `arlight run` runs it, beside a plain transcode: the same decoding and encoding alone."""

from dataclasses import asdict
from pathlib import Path
from time import perf_counter, process_time

from arlight.benchmark.speed.findings import Findings, Ratio
from arlight.benchmark.speed.playback import FilmedClip
from arlight.benchmark.speed.spread import paired_ratio, spread
from arlight.benchmark.speed.workloads import FRAME_RATE
from arlight.pipeline import Pipeline
from arlight.presets import EncodingSettings, Preset
from arlight.rendering.relight import Relighter
from arlight.results.frame_loop import FrameLoop, Sinks
from arlight.video.reader import VideoReader
from arlight.video.repetition import repeat_clip
from arlight.video.transcode import plain_transcode
from arlight.video.writer import VideoWriter

TRANSCODE = "plain transcode"
_WARM_UP_FRAMES = 24


def measure_loop(
    clip: FilmedClip, frames: int, repeats: int, preset: Preset, relighter: Relighter, folder: Path
) -> Findings:
    """Wall time of the loop over a clip that is long enough, in turns with a transcode of the same clip.

    Args:
        clip: the workload; it is repeated without being encoded anew.
        frames: length of the clip that is run, at least.
        repeats: how often each is run.
        preset: settings of all stages.
        relighter: draws the object; made with the preset's settings.
        folder: for the clips that are written.
    """
    # an OpenGL context belongs to the thread that drew last
    relighter.release()
    short, long = folder / "short.mp4", folder / "long.mp4"
    repeat_clip(clip.path, short, float(_WARM_UP_FRAMES / FRAME_RATE))
    count = repeat_clip(clip.path, long, float(frames / FRAME_RATE))
    pipeline = Pipeline(clip.probe, clip.camera, relighter, preset.tracker)
    _run(short, pipeline, preset.encoding, folder, {})
    loop_s, loop_cpu_s, transcode_s, transcode_cpu_s = [], [], [], []
    stages_ms: dict[str, list[float]] = {}
    for _ in range(repeats):
        cpu_s = process_time()
        transcode_s.append(_transcode(long, preset.encoding, folder / "transcoded.mp4"))
        transcode_cpu_s.append(process_time() - cpu_s)
        pipeline.reset()
        cpu_s = process_time()
        loop_s.append(_run(long, pipeline, preset.encoding, folder, stages_ms))
        loop_cpu_s.append(process_time() - cpu_s)
    name, ratio = f"loop, {clip.workload.name}", paired_ratio(loop_s, transcode_s)
    found = Findings(ratios={name: Ratio(ratio, TRANSCODE, 1e3 * spread(loop_s).median / count)})
    found.ratios[f"CPU of the {name}"] = Ratio(
        paired_ratio(loop_cpu_s, transcode_cpu_s), TRANSCODE, 1e3 * spread(loop_cpu_s).median / count
    )
    found.details["loop"] = [
        {
            "name": clip.workload.name,
            "frames": count,
            "frames_per_second": count / spread(loop_s).median,
            "transcode_frames_per_second": count / spread(transcode_s).median,
            "wall_ms": asdict(spread(loop_s).scaled(1e3 / count)),
            "cpu_ms": asdict(spread(loop_cpu_s).scaled(1e3 / count)),
            "over_transcode": asdict(ratio),
            "stages_wall_ms": {stage: asdict(spread(values)) for stage, values in stages_ms.items()},
        }
    ]
    return found


def _run(
    path: Path,
    pipeline: Pipeline,
    encoding: EncodingSettings,
    folder: Path,
    stages_ms: dict[str, list[float]],
) -> float:
    """Wall time of a run over a clip [s]; that of every frame's stages is added to those known [ms]."""
    begun = perf_counter()
    with VideoReader(path) as reader, Sinks() as sinks:
        sinks.video = VideoWriter(folder / "relit.mp4", like=reader, crf=encoding.crf, preset=encoding.encoder_preset)
        with FrameLoop(reader, pipeline, sinks) as records:
            for record in records:
                for stage, ms in record.timings_ms.items():
                    stages_ms.setdefault(stage, []).append(ms)
    return perf_counter() - begun


def _transcode(path: Path, encoding: EncodingSettings, target: Path) -> float:
    """Wall time of a plain transcode [s]."""
    begun = perf_counter()
    plain_transcode(path, target, encoding.crf, encoding.encoder_preset)
    return perf_counter() - begun
