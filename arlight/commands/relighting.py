"""The object that is drawn, where it stands and what draws it."""

from dataclasses import dataclass

from rich.console import Console
from rich.progress import Progress

from arlight.camera import Camera
from arlight.commands.options import OptionalFile
from arlight.pipeline import FrameRelighter
from arlight.probe.design import Probe
from arlight.rendering.default_object import default_object
from arlight.rendering.mesh_file import load_mesh
from arlight.rendering.relight import Relighter, RelightSettings


@dataclass(frozen=True)
class RelightingOptions:
    """The object that is drawn on the sheet."""

    object: OptionalFile = None
    """A mesh to draw (.glb, .obj, .ply, .stl); an object of our own by default."""
    size_mm: float = 60.0
    """Largest side of the object [mm]."""
    position_mm: tuple[float, float] = (0.0, 0.0)
    """Where the object stands, from the sheet's centre: right and up as printed [mm]."""
    yaw_deg: float = 0.0
    """Turn of the object about its vertical axis, counter-clockwise from above [deg]."""
    roughness: float = 0.3
    """Roughness of the object's gloss, 0.05 (polished) to 1."""


def make_relighter(options: RelightingOptions, probe: Probe, camera: Camera) -> FrameRelighter:
    """Load the object and fold its shadows into matrices, with a progress line.

    Raises:
        MeshError: the object cannot be used.
        RenderingUnavailable: there is no headless OpenGL.
    """
    settings = RelightSettings(
        size_mm=options.size_mm, position_mm=options.position_mm, yaw_deg=options.yaw_deg, roughness=options.roughness
    )
    mesh = default_object() if options.object is None else load_mesh(options.object)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("preparing the object", total=1.0)
        return Relighter(mesh, probe, camera, settings, lambda share: progress.update(task, completed=share))
