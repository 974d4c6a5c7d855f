"""How the cost of estimating and of drawing grows with one thing at a time."""

from collections.abc import Sequence
from pathlib import Path

from arlight.benchmark.speed.contest import Contender, contend, contender
from arlight.benchmark.speed.findings import Findings
from arlight.benchmark.speed.playback import FilmedClip, load_clip
from arlight.benchmark.speed.relighters import Relighters
from arlight.benchmark.speed.spread import spread
from arlight.benchmark.speed.workloads import Workload, still_workload
from arlight.lighting_tracker import TrackerSettings
from arlight.rendering.settings import RelightSettings

SHEET_WIDTHS_PX = (250.0, 400.0, 650.0)
SIZES = ((854, 480), (1280, 720), (1920, 1080), (3840, 2160))
MESH_FACES = (1_000, 4_000, 16_000, 80_000)
_SHEET_IN_EVERY_SIZE_PX = 400.0


def growth_workloads() -> tuple[Workload, ...]:
    """What must be filmed for `measure_sheets` and `measure_sizes`, beside the sheets of all orders."""
    return tuple(dict.fromkeys([*_by_width(), *_by_size()]))


def _by_width() -> tuple[Workload, ...]:
    return tuple(still_workload((1280, 720), width) for width in SHEET_WIDTHS_PX)


def _by_size() -> tuple[Workload, ...]:
    return tuple(still_workload(size, _SHEET_IN_EVERY_SIZE_PX) for size in SIZES)


def grow_with_sheet_order(clips: Sequence[FilmedClip], frames: int, relighters: Relighters) -> Findings:
    """Cost over the order of the sheet, the object as large on every sheet as on the last."""
    found = []
    for clip in clips:
        share = clip.probe.sheet_mm[0] / clips[-1].probe.sheet_mm[0]
        settings = RelightSettings(size_mm=RelightSettings().size_mm * share)
        each = contender(
            clip, TrackerSettings(order=clip.probe.order), relighters.of(clip.probe, clip.camera, settings)
        )
        contend(clip, frames, [each])
        found.append((clip.probe.order, each))
    return _grown("order of the sheet", found)


def grow_with_order_setting(clip: FilmedClip, frames: int, relighters: Relighters) -> Findings:
    """Cost over the order that is asked for, on one sheet."""
    orders = range(clip.probe.order + 1)
    contenders = [
        contender(clip, TrackerSettings(order=order), relighters.of(clip.probe, clip.camera)) for order in orders
    ]
    contend(clip, frames, contenders)
    return _grown("order asked for", list(zip(orders, contenders, strict=True)))


def grow_with_sheet_width(folder: Path, frames: int, relighters: Relighters) -> Findings:
    """Cost over the sheet's width in the picture."""
    clips = [load_clip(folder, workload) for workload in _by_width()]
    return _grown(
        "width of the sheet, px",
        [(clip.workload.scene.sheet_width_px, _alone(clip, frames, relighters)) for clip in clips],
    )


def grow_with_size(folder: Path, frames: int, relighters: Relighters) -> Findings:
    """Cost over the picture's height, the sheet in it as large as ever."""
    found = []
    for workload in _by_size():
        clip = load_clip(folder, workload)
        found.append((clip.camera.image_size[1], _alone(clip, frames, relighters)))
    return _grown("height of the picture, px", found)


def grow_with_mesh(clip: FilmedClip, frames: int, relighters: Relighters) -> Findings:
    """Cost over the triangles that are drawn."""
    contenders = [
        contender(
            clip,
            TrackerSettings(order=clip.probe.order),
            relighters.of(clip.probe, clip.camera, RelightSettings(mesh_faces=faces)),
        )
        for faces in MESH_FACES
    ]
    contend(clip, frames, contenders)
    return _grown("triangles of the object", list(zip(MESH_FACES, contenders, strict=True)))


def _alone(clip: FilmedClip, frames: int, relighters: Relighters) -> Contender:
    each = contender(clip, TrackerSettings(order=clip.probe.order), relighters.of(clip.probe, clip.camera))
    contend(clip, frames, [each])
    return each


def _grown(axis: str, measured: Sequence[tuple[float, Contender]]) -> Findings:
    rows = [
        {
            "value": value,
            "estimate_ms": 1e3 * spread(each.estimate_s).median,
            "relight_ms": 1e3 * spread(each.relight_s).median,
        }
        for value, each in measured
    ]
    return Findings(details={"growth": {axis: rows}})
