"""The page of the comparison: relighting errors of every probe, and balls lit by what each probe measured."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from arlight.benchmark.comparison import METHODS, ComparedLight
from arlight.benchmark.relit_objects import MATERIALS, Material
from arlight.calibration.ball.mirror_ball import MapGrid
from arlight.camera import Pose
from arlight.environment import Environment

Array = NDArray[np.float64]

# Okabe and Ito's palette
_COLORS = dict(zip(METHODS, ("#0072B2", "#E69F00", "#009E73", "#999999"), strict=True))
_MARKERS = dict(zip(METHODS, "os^D", strict=True))
_LABELS = {
    "planar sheet": "planar sheet\n(one picture)",
    "mirrored ball": "mirrored ball\n(one picture)",
    "matte ball": "matte ball\n(one picture)",
    "mirrored ball, bracketed": "mirrored ball\n(a bracket)",
}
_OBJECT_PX = 72
_OBJECT_GRID_ROWS = 48
_OBJECT_ALBEDO = 0.6
_INK = "#222222"
_SHOWN: tuple[tuple[str, Material], ...] = (
    ("matte", Material("matte", None)),
    ("gloss", Material("gloss", 0.3)),
    ("mirror", Material("mirror", 0.05)),
)


def draw_comparison(lights: Sequence[ComparedLight], pose: Pose) -> Figure:
    """Errors above, objects under one of the lights below.

    Args:
        lights: what was compared.
        pose: of the sheet, camera_from_probe: the objects are seen from there.
    """
    page = Figure(figsize=(12.0, 9.4), layout="constrained", facecolor="white")
    page.suptitle(f"Planar sheet, mirrored ball and matte ball under the same {len(lights)} lights", fontsize=13)
    above, below = page.subfigures(2, 1, height_ratios=[4.2, 5.2], squeeze=False)[:, 0]
    panels = above.subplots(1, len(MATERIALS), sharey=True, squeeze=False)[0]
    for number, (axes, material) in enumerate(zip(panels, MATERIALS, strict=True)):
        _draw_errors(axes, lights, number, material)
    panels[0].set_ylabel("relighting error\n(rms, relative to the true appearance)", fontsize=9)
    shown = typical_light(lights)
    _draw_objects(below, shown, pose)
    return page


def typical_light(lights: Sequence[ComparedLight]) -> ComparedLight:
    """The light under which the sheet's error on matte objects is the median one."""
    errors = [light.errors[METHODS[0]][0] for light in lights]
    return lights[int(np.argsort(errors)[len(errors) // 2])]


def _draw_errors(axes: Axes, lights: Sequence[ComparedLight], number: int, material: Material) -> None:
    """A dot a light, a bar at the median."""
    spread = np.linspace(-0.22, 0.22, len(lights)) if len(lights) > 1 else np.zeros(1)
    for place, method in enumerate(METHODS):
        errors = np.array([light.errors[method][number] for light in lights])
        axes.plot(place + spread, errors, _MARKERS[method], color=_COLORS[method], alpha=0.55, markersize=4, mew=0)
        median = float(np.median(errors))
        axes.hlines(median, place - 0.36, place + 0.36, color=_COLORS[method], linewidth=2.5)
        axes.text(place, median * 1.12, _percentage(median), ha="center", fontsize=7.5, color=_INK)
    axes.set_yscale("log")
    axes.set_title(material.name.replace(", ", ",\n"), fontsize=10, color=_INK)
    axes.set_xticks(range(len(METHODS)), [_LABELS[m] for m in METHODS], rotation=90, fontsize=8)
    axes.set_yticks([0.01, 0.1, 1.0], ["1 %", "10 %", "100 %"])
    axes.grid(axis="y", linewidth=0.4, color="#cccccc")
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(axis="y", labelsize=8)


def _percentage(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share > 0.0995 else f"{100.0 * share:.1f} %"


def _draw_objects(part: SubFigure, light: ComparedLight, pose: Pose) -> None:
    """Balls of three finishes under the true light and under what every probe measured."""
    part.suptitle(f"Objects under the light of '{light.name}', as each probe has it", fontsize=11, color=_INK)
    maps = {"true": light.true, **light.estimated}
    axes = part.subplots(len(_SHOWN), len(maps))
    for row, (finish, material) in enumerate(_SHOWN):
        for column, (source, radiance) in enumerate(maps.items()):
            place = axes[row, column]
            place.imshow(_object(radiance, material, pose), interpolation="bilinear")
            place.set_xticks([])
            place.set_yticks([])
            place.spines[:].set_visible(False)
            if row == 0:
                place.set_title(_LABELS.get(source, "true light"), fontsize=9, color=_INK)
            if column == 0:
                place.set_ylabel(finish, fontsize=10, color=_INK)


def _object(radiance: NDArray[np.float32], material: Material, pose: Pose) -> Array:
    """(n, n, 4) a ball of a finish, seen by the camera from far away; transparent around it."""
    steps = (np.arange(_OBJECT_PX) + 0.5) / _OBJECT_PX * 2.0 - 1.0
    x, y = np.meshgrid(steps, steps)
    radius = np.hypot(x, y)
    inside = radius < 1.0
    normals = np.stack([x[inside], y[inside], -np.sqrt(1.0 - radius[inside] ** 2)], axis=-1)
    if material.roughness is not None:
        # the direction that is mirrored toward the camera
        normals = np.array([0.0, 0.0, 1.0]) - 2.0 * normals[:, 2:] * normals
    toward = normals @ pose.rotation
    shade = np.zeros((*inside.shape, 4))
    shade[inside, :3] = np.clip(_reflected(radiance, material, toward), 0.0, 1.0) ** (1.0 / 2.2)
    shade[..., 3] = inside
    return shade


def _reflected(radiance: NDArray[np.float32], material: Material, toward: Array) -> Array:
    if material.roughness is not None and material.roughness < 0.1:
        return _OBJECT_ALBEDO * Environment(radiance).radiance_at(toward)
    share = len(radiance) // _OBJECT_GRID_ROWS
    grid = MapGrid(_OBJECT_GRID_ROWS)
    coarse = radiance.reshape(grid.rows, share, 2 * grid.rows, share, 3).mean(axis=(1, 3)).reshape(-1, 3)
    gathered = (material.kernel(toward, grid) @ coarse).astype(float)
    return _OBJECT_ALBEDO * (gathered / np.pi if material.roughness is None else gathered)
