"""The sheet on its table under a script of lights: what is worked out of a light is kept while it is in use."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera, Pose
from arlight.environment import Environment
from arlight.optics import Slab
from arlight.synthetic.light_script import LightScript
from arlight.synthetic.renderer import Sampling, SheetRenderer, Slot
from arlight.synthetic.sheet import SheetLayers
from arlight.synthetic.transport import IrradianceMap, LightTransport


class Stage:
    """Linear pictures of one sheet at any time of a light script. Belongs to the thread that makes it."""

    def __init__(
        self,
        layers: SheetLayers,
        slab: Slab,
        camera: Camera,
        script: LightScript,
        bounces: int = 3,
        sampling: Sampling | None = None,
    ) -> None:
        """
        Args:
            layers: the printed sheet.
            slab: the glass between film and paper.
            camera: the camera that films it.
            script: which light shines when, in exposed units.
            bounces: how often light between paper and glass is followed.
            sampling: how finely a pixel is sampled.

        Raises:
            RenderingUnavailableError: there is no headless OpenGL.
        """
        self._script = script
        self._transport = LightTransport(layers, slab, bounces)
        self._renderer = SheetRenderer(layers, slab, camera, sampling)
        self._lit_key = lru_cache(maxsize=2)(self._light_key)
        self._shown: dict[Slot, int] = {}

    def picture(self, time_s: float, pose: Pose) -> NDArray[np.float32]:
        """Linear radiance (h, w, 3) at a time [s] from a pose, camera_from_probe [mm]."""
        first, second, share = self._script.state(time_s)
        self._show("first", first)
        if share > 0.0:
            self._show("second", second)
        return self._renderer.render(pose, share)

    def close(self) -> None:
        """Free the OpenGL context."""
        self._renderer.release()

    def _show(self, slot: Slot, key: int) -> None:
        if self._shown.get(slot) != key:
            self._renderer.set_light(slot, *self._lit_key(key))
            self._shown[slot] = key

    def _light_key(self, key: int) -> tuple[Environment, IrradianceMap]:
        environment = self._script.key(key)
        return environment, self._transport.irradiance(environment)
