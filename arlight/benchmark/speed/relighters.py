"""Relighters of the default object, made once a sheet, size and setting."""

from arlight.camera import Camera
from arlight.probe.design import Probe
from arlight.rendering.default_object import default_object
from arlight.rendering.relight import Relighter
from arlight.rendering.settings import RelightSettings

FINEST = RelightSettings(directions=1024, shadow_texels=256, supersampling=4, mesh_faces=80_000)
"""Settings of the pictures that others are compared with."""


class Relighters:
    """Keeps what is slow to make; release it when done."""

    def __init__(self) -> None:
        self._made: dict[tuple[int, tuple[int, int], RelightSettings], Relighter] = {}

    def of(self, probe: Probe, camera: Camera, settings: RelightSettings | None = None) -> Relighter:
        """The default object over a sheet.

        Raises:
            RenderingUnavailableError: there is no headless OpenGL.
        """
        settings = settings or RelightSettings()
        key = (probe.order, camera.image_size, settings)
        if key not in self._made:
            self._made[key] = Relighter(default_object(settings.lit_faces), probe, camera, settings)
        return self._made[key]

    def release(self) -> None:
        """Give everything back."""
        for relighter in self._made.values():
            relighter.release()
        self._made.clear()
