"""Reads an object from any file that trimesh loads: scenes are flattened, colours and textures kept as base colour."""

import struct
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import trimesh
from numpy.typing import NDArray

from arlight.color import linear_from_encoded
from arlight.errors import MeshError
from arlight.rendering.mesh import Mesh
from arlight.rendering.tessellation import creased_normals, fit_to_budget

UpAxis = Literal["auto", "y", "z"]

MAX_VERTICES = 20_000
"""More vertices than this are clustered away: lighting and drawing cost grows with them."""
_TEXTURE_SIDE = 1024
_LOADER_ERRORS = (
    *(ArithmeticError, AssertionError, AttributeError, EOFError, ImportError, LookupError, MemoryError, OSError),
    *(RuntimeError, SyntaxError, TypeError, ValueError, struct.error),
)
"""What trimesh's parsers raise on damaged files: they check little before they read."""
_PLAIN_REFLECTANCE = 0.5
"""Base colour of a mesh that has none."""
_Y_UP = {".glb", ".gltf", ".obj"}


def load_mesh(path: Path | str, up: UpAxis = "auto", max_vertices: int = MAX_VERTICES) -> Mesh:
    """Read an object, in the file's own unit, turned so that z is up.

    Normals are computed anew, smooth up to a crease of 40 degrees. Coarse faces are divided so that light and shadow
    can vary across them; more than `max_vertices` are merged.

    Args:
        path: GLB, glTF, OBJ, PLY, STL, OFF or whatever else trimesh reads.
        up: the file's up axis; `auto` is y for glTF and OBJ and z for the others.
        max_vertices: budget.

    Raises:
        MeshError: the file is missing, unreadable, or holds no usable triangles.
    """
    path = Path(path)
    if not path.is_file():
        raise MeshError(f"{path}: no such file; a triangle mesh (GLB, OBJ, PLY, STL) is expected there")
    try:
        mesh = fit_to_budget(_joined([from_trimesh(part) for part in _parts(path)]), max_vertices)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from error
    y_up = up == "y" or (up == "auto" and path.suffix.lower() in _Y_UP)
    return mesh.standing_upright() if y_up else mesh


def _parts(path: Path) -> list[trimesh.Trimesh]:
    formats = sorted(trimesh.exchange.load.mesh_formats())
    if path.suffix.lower().lstrip(".") not in formats:
        raise MeshError(f"unknown format {path.suffix or '(no suffix)'!r}; trimesh reads {', '.join(formats)}")
    try:
        scene = trimesh.load_scene(path, process=False)
        parts = scene.dump()
    except _LOADER_ERRORS as error:
        raise MeshError(f"could not be read as a mesh ({type(error).__name__}: {error}); is it complete?") from error
    triangles = [part for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces) > 0]
    if not triangles:
        raise MeshError("holds no faces; a triangle mesh is needed, not points or lines")
    return triangles


def from_trimesh(part: trimesh.Trimesh) -> Mesh:
    """A mesh that trimesh holds, split at creases and texture seams, in its own unit and axes.

    Raises:
        MeshError: it holds no usable triangles.
    """
    vertices, faces = np.asarray(part.vertices, float), np.asarray(part.faces)
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise MeshError(f"a face names vertex {faces.max()} of {len(vertices)}; the file is damaged")
    if not np.all(np.isfinite(vertices)):
        bad = int(np.count_nonzero(~np.isfinite(vertices).all(axis=1)))
        raise MeshError(f"{bad} of {len(vertices)} vertices are not finite; repair the mesh")
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    faces = faces[area > 1e-12 * np.ptp(vertices, axis=0).max() ** 2]
    if len(faces) == 0:
        raise MeshError("all its faces are degenerate: they have no area")
    normals, source, split_faces, closed = creased_normals(vertices, faces)
    colour, uv, image = _appearance(part)
    return Mesh(
        vertices[source],
        normals,
        split_faces,
        colour[source],
        uv=None if uv is None else uv[source],
        layer=None if uv is None else np.zeros(len(source), np.float32),
        textures=None if image is None else image[None],
        closed=closed,
    )


def _appearance(
    part: trimesh.Trimesh,
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None, NDArray[np.uint8] | None]:
    """Linear colour per vertex, texture coordinates and sRGB image; the last two None without a texture."""
    count = len(part.vertices)
    visual: Any = part.visual
    if visual.kind == "texture":
        material = visual.material
        factor = _factor(material)
        image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
        uv = visual.uv
        colour = np.broadcast_to(factor, (count, 3)).astype(np.float32)
        if image is None or uv is None or len(uv) != count or not np.all(np.isfinite(uv)):
            return colour, None, None
        pixels = np.asarray(image.convert("RGB").resize((_TEXTURE_SIDE, _TEXTURE_SIDE)))
        return colour, np.asarray(uv, np.float32)[:, :2], pixels
    if not visual.defined:
        return np.full((count, 3), _PLAIN_REFLECTANCE, np.float32), None, None
    encoded = np.asarray(visual.vertex_colors, float)[:, :3] / 255.0
    return linear_from_encoded(encoded), None, None


def _factor(material: Any) -> NDArray[np.float32]:
    """The material's own colour, linear: glTF stores it so, the others as sRGB."""
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        factor = material.baseColorFactor
        return np.ones(3, np.float32) if factor is None else (np.asarray(factor[:3]) / 255.0).astype(np.float32)
    if getattr(material, "image", None) is not None:
        return np.ones(3, np.float32)
    return linear_from_encoded(np.asarray(material.main_color[:3], float) / 255.0)


def _joined(parts: list[Mesh]) -> Mesh:
    """One mesh; its textures become layers of one stack, a white layer serves the parts that have none."""
    textured = any(part.textures is not None for part in parts)
    offsets = np.cumsum([0] + [len(part.vertices_mm) for part in parts[:-1]])
    white = np.full((_TEXTURE_SIDE, _TEXTURE_SIDE, 3), 255, np.uint8)
    images = [white if part.textures is None else part.textures[0] for part in parts]
    stack, layers = _distinct(images) if textured else (None, [0] * len(parts))
    counts = [len(part.vertices_mm) for part in parts]
    blank = [np.zeros((count, 2), np.float32) for count in counts]
    return Mesh(
        np.concatenate([part.vertices_mm for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.faces + o for part, o in zip(parts, offsets, strict=True)]).astype(np.int32),
        np.concatenate([part.base_colour for part in parts]),
        np.concatenate([b if p.uv is None else p.uv for p, b in zip(parts, blank, strict=True)]) if textured else None,
        np.repeat(np.array(layers, np.float32), counts) if textured else None,
        stack,
        closed=all(part.closed for part in parts),
    )


def _distinct(images: list[NDArray[np.uint8]]) -> tuple[NDArray[np.uint8], list[int]]:
    """The different images, stacked, and which of them each one is; halved until the stack is moderate."""
    keys = [image.tobytes() for image in images]
    order = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    held = dict(zip(keys, images, strict=True))
    stack = [held[key] for key in order]
    side = _TEXTURE_SIDE
    while side > 128 and len(stack) * side * side > 8 * _TEXTURE_SIDE**2:
        side //= 2
    if side < _TEXTURE_SIDE:
        stack = [np.asarray(cv2.resize(i, (side, side), interpolation=cv2.INTER_AREA), np.uint8) for i in stack]
    return np.stack(stack), [order[key] for key in keys]
