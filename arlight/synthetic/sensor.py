"""What a camera makes of linear light: lens blur, vignetting, shot and read noise, sRGB, 8 bits."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.camera import Camera
from arlight.color import encoded_from_linear
from arlight.errors import ArlightError


@dataclass(frozen=True, slots=True)
class Sensor:
    """Imaging defects of a camera. Values are linear, 1 is full scale.

    The defaults are a phone's in good light, whose video pixels are each binned from several of the sensor's.
    """

    blur_px: float = 0.6
    """Standard deviation of the lens blur, a Gaussian in linear light [px]."""
    vignetting: float = 0.0
    """Strength of the darkening toward the corners: 1 for the natural cos^4 of the angle off the axis, 0 for none."""
    read_noise: float = 0.0015
    """Standard deviation of the noise in the dark."""
    gain: float = 3e-5
    """Variance of the shot noise per unit of signal: 1 / electrons at full scale."""

    def __post_init__(self) -> None:
        for name in ("blur_px", "vignetting", "read_noise", "gain"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ArlightError(f"{name} of the sensor must be finite and not negative, found {value}")

    def expose(
        self, radiance: NDArray[np.float32], camera: Camera, generator: np.random.Generator
    ) -> NDArray[np.uint8]:
        """One 8-bit sRGB picture of the light that falls on the sensor.

        Args:
            radiance: (h, w, 3) linear, 1 is full scale; larger values are clipped after the blur.
            camera: its ray map says how far off the axis a pixel looks.
            generator: source of the noise.

        Returns:
            (h, w, 3) uint8.
        """
        signal = radiance
        if self.blur_px > 0:
            blurred = cv2.GaussianBlur(signal, (0, 0), self.blur_px, borderType=cv2.BORDER_REPLICATE)
            signal = np.asarray(blurred, np.float32)
        if self.vignetting > 0:
            signal = signal * self.falloff(camera)[..., None]
        if self.read_noise > 0 or self.gain > 0:
            noise = generator.standard_normal(signal.shape, dtype=np.float32)
            noise *= np.sqrt(np.float32(self.read_noise**2) + np.float32(self.gain) * np.maximum(signal, 0.0))
            signal = signal + noise
        return np.rint(encoded_from_linear(signal) * np.float32(255.0)).astype(np.uint8)

    def falloff(self, camera: Camera) -> NDArray[np.float32]:
        """(h, w) relative illumination of the sensor, cos^(4 * vignetting) of the angle off the optical axis."""
        return np.power(1.0 + np.sum(camera.ray_map**2, axis=-1), np.float32(-2.0 * self.vignetting))
