"""The sheet as an ordinary Mitsuba scene, for Mitsuba's own path integrator: what the gathered transport is held to."""

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from arlight.environment import Environment
from arlight.validation.assembled_layers import AssembledLayers
from arlight.validation.mitsuba_library import load_mitsuba

Array = NDArray[np.float64]

GAP_MM = 0.01
"""Distance of film and upper face, and of lower face and paper: just above what single precision keeps apart."""
_BORDER_MM = 15.0


def reference_radiance(
    layers: AssembledLayers,
    environment: Environment,
    points_mm: Array,
    toward: Array,
    samples: int,
    depth: int = 24,
    seed: int = 0,
) -> tuple[Array, Array]:
    """Mean radiance of a set of points toward a distant viewer by plain path tracing, mirrored light included.

    Args:
        layers: the assembled sheet; nothing but black film lies around it.
        environment: the light, its yaw 0.
        points_mm: (n, 2) points of the film, probe frame [mm].
        toward: (3,) unit vector to the viewer.
        samples: paths a point.
        depth: longest path.
        seed: of the random numbers.

    Returns:
        (3,) mean over the points, and its standard error.

    Raises:
        ValidationUnavailableError: Mitsuba's LLVM variant is not there.
    """
    mi = load_mitsuba("llvm_ad_rgb")
    scene = mi.load_dict(_scene(mi, layers, environment))
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": depth})
    start = np.concatenate([points_mm, np.zeros((len(points_mm), 1))], axis=1) + 5.0 * toward
    start = np.repeat(start, samples, axis=0).astype(np.float32)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(start))
    ray = mi.RayDifferential3f(
        mi.Ray3f(
            mi.Point3f(*(mi.Float(np.ascontiguousarray(axis)) for axis in start.T)), mi.Vector3f(*(-toward).tolist())
        )
    )
    radiance, _, _ = integrator.sample(scene, sampler, ray)
    values = np.stack([np.array(channel) for channel in radiance], axis=-1).astype(float)
    return values.mean(axis=0), values.std(axis=0) / np.sqrt(len(values))


def _scene(mi: ModuleType, layers: AssembledLayers, environment: Environment) -> dict[str, Any]:
    """Paper, glass and film, wide enough that no path leaves sideways, under the environment."""
    border = round(_BORDER_MM * layers.per_mm)
    opacity = np.pad(1.0 - layers.film, border, constant_values=1.0)
    paper = np.pad(layers.paper, border, mode="edge")
    rows, columns = opacity.shape
    half = np.array([columns, rows]) / layers.per_mm / 2.0
    centre = np.array(layers.first_mm) + np.array([1.0, -1.0]) * (half - (border + 0.5) / layers.per_mm)

    def sheet(z: float, down: bool = False) -> Any:
        place = mi.ScalarTransform4f().translate([*centre.tolist(), z]).scale([*half.tolist(), 1.0])
        return place.rotate([1, 0, 0], 180) if down else place

    def texture(values: NDArray[np.float32]) -> dict[str, Any]:
        # Mitsuba counts v upward from the first row, which is our last
        bitmap = mi.Bitmap(np.ascontiguousarray(values[::-1, :, None], np.float32))
        return {"type": "bitmap", "bitmap": bitmap, "raw": True, "filter_type": "bilinear", "wrap_mode": "clamp"}

    glass = {"type": "dielectric", "int_ior": float(layers.slab.refractive_index), "ext_ior": 1.0}
    black = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}}
    film = {"type": "mask", "opacity": texture(opacity), "nested": black}
    lower = -GAP_MM - layers.slab.glass_mm
    sky = mi.Bitmap(_environment_bitmap(environment))
    return {
        "type": "scene",
        "upper": {"type": "rectangle", "to_world": sheet(0.0), "bsdf": glass},
        "film": {"type": "rectangle", "to_world": sheet(-GAP_MM), "bsdf": film},
        "lower": {"type": "rectangle", "to_world": sheet(lower, down=True), "bsdf": glass},
        "paper": {
            "type": "rectangle",
            "to_world": sheet(lower - GAP_MM),
            "bsdf": {"type": "diffuse", "reflectance": texture(paper)},
        },
        "sky": {"type": "envmap", "bitmap": sky, "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90)},
    }


def _environment_bitmap(environment: Environment, rows: int = 257) -> NDArray[np.float32]:
    """The map as Mitsuba reads it once its pole stands upright: azimuths clockwise from +y, first and last row at the
    poles."""
    columns = 2 * (rows - 1)
    theta = np.linspace(0.0, np.pi, rows)[:, None]
    phi = np.pi / 2.0 - 2.0 * np.pi * (np.arange(columns) + 0.5)[None] / columns
    directions = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) * np.ones_like(phi)], axis=-1
    )
    return np.ascontiguousarray(environment.radiance_at(directions), np.float32)
