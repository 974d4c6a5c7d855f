"""The object that is drawn, where it stands and what draws it."""

from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from arlight.camera import Camera
from arlight.commands.options.relighting import RelightingOptions
from arlight.pipeline import FrameRelighter
from arlight.probe.design import Probe
from arlight.rendering.default_object import default_object
from arlight.rendering.mesh import Mesh
from arlight.rendering.relight import Relighter


def make_relighter(
    options: RelightingOptions, probe: Probe, camera: Camera, order: int | None = None
) -> FrameRelighter:
    """Load the object and fold its shadows into matrices, with a progress line.

    Args:
        options: the object and how it stands on the sheet.
        probe: the sheet.
        camera: intrinsics of the frames to come.
        order: highest order of the light; the sheet's by default.

    Raises:
        MeshError: the object cannot be used.
        RenderingUnavailableError: there is no headless OpenGL.
    """
    mesh = default_object() if options.object is None else _read(options.object)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("preparing the object", total=1.0)
        return Relighter(
            mesh, probe, camera, options.settings, lambda share: progress.update(task, completed=share), order
        )


def _read(path: Path) -> Mesh:
    # here, because reading files needs trimesh, which takes long to load
    from arlight.rendering.mesh_file import load_mesh

    return load_mesh(path)
