"""The object that is drawn, prepared while the first frames are read and estimated."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from arlight.camera import Camera, Pose
from arlight.commands.options.relighting import RelightingOptions
from arlight.effort import Effort
from arlight.estimation.lighting import Lighting
from arlight.estimation.shown_light import Need
from arlight.pipeline import FrameRelighter
from arlight.probe.design import Probe
from arlight.rendering.default_object import default_object
from arlight.rendering.mesh import Mesh
from arlight.rendering.relight import Relighter
from arlight.rendering.settings import RelightSettings
from arlight.rendering.transfer_cache import user_cache_folder
from arlight.video.frame import Frame


def make_relighter(
    options: RelightingOptions, probe: Probe, camera: Camera, order: int | None = None
) -> FrameRelighter:
    """Load the object and begin to fold its shadows into matrices, which goes on beside the caller's work.

    Args:
        options: the object and how it stands on the sheet.
        probe: the sheet.
        camera: intrinsics of the frames to come.
        order: highest order of the light; the sheet's by default.

    Raises:
        MeshError: the object cannot be used.
    """
    mesh = default_object(options.settings.lit_faces) if options.object is None else _read(options.object)
    return _PreparedRelighter(mesh, probe, camera, options.settings, order)


class _PreparedRelighter:
    """A relighter that is made in a thread of its own; the first frame to be drawn waits for it.

    What is wrong with the object on this sheet is raised by `render`.
    """

    def __init__(self, mesh: Mesh, probe: Probe, camera: Camera, settings: RelightSettings, order: int | None) -> None:
        thread = ThreadPoolExecutor(1, "prepare")
        self._made = thread.submit(
            Relighter, mesh, probe, camera, settings, order=order, cache_folder=user_cache_folder()
        )
        # once the frames are under way, for it is not needed at once
        self._need = thread.submit(lambda: self._made.result().need)
        thread.shutdown(wait=False)

    @property
    def need(self) -> Need | None:
        return self._need.result() if self._need.done() and self._need.exception() is None else None

    def render(
        self, frame: Frame, camera_from_probe: Pose | None, lighting: Lighting | None, effort: Effort | None = None
    ) -> Frame:
        return self._made.result().render(frame, camera_from_probe, lighting, effort)

    def release(self) -> None:
        if self._made.exception() is None:
            self._made.result().release()


def _read(path: Path) -> Mesh:
    # here, because reading files needs trimesh, which takes long to load
    from arlight.rendering.mesh_file import load_mesh

    return load_mesh(path)
