"""How an object stands on the sheet, how it is lit and what draws it."""

from dataclasses import dataclass
from typing import Literal

RendererName = Literal["native", "moderngl", "pyrender"]


_REFINED_FACES = 16_000


@dataclass(frozen=True, slots=True)
class RelightSettings:
    """How the object stands on the sheet and how it is lit."""

    size_mm: float = 50.0
    """Largest side of the object's bounding box [mm]."""
    position_mm: tuple[float, float] = (0.0, 0.0)
    """Where the middle of the object stands, probe frame [mm]."""
    yaw_deg: float = 0.0
    """Turn of the object about the sheet's normal, counter-clockwise from above [deg]."""
    roughness: float = 0.3
    """Perceptual roughness of the gloss, in [0.05, 1]."""
    normal_reflectance: float = 0.04
    """Fresnel reflectance at normal incidence: 0.04 a varnish, 0 a matte object."""
    surroundings_albedo: float = 0.3
    """ASSUMED albedo of what surrounds the object: light from below is this over pi times the irradiance, in [0, 1]."""
    directions: int = 512
    """Directions of the hemisphere along which the object's shadows are cast."""
    shadow_texels: int = 96
    """Side of the map of the shadow on the sheet."""
    supersampling: int = 2
    """Samples along a pixel's side."""
    mesh_faces: int | None = None
    """Triangles to draw at most; a mesh that has more is simplified. Up to a quarter of them are refined after they are
    lit, by default if that makes no more than 16 000. Only the native renderer refines."""
    renderer: RendererName = "native"
    """`native`: precomputed transfer, drawn by compiled code; `moderngl`: the same by OpenGL, with the gloss of every
    pixel; `pyrender`: the light as a few directional lights with shadow maps, slow."""

    @property
    def lit_faces(self) -> int:
        """Triangles of a mesh that may be refined."""
        return (self.mesh_faces or _REFINED_FACES) // 4
