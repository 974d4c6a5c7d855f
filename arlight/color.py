"""Transfer functions between encoded values and linear light. Encoded and linear values are relative to full scale."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Transfer = Literal["srgb", "bt709", "linear", "gamma22", "gamma28", "hlg"]

HLG_A, HLG_B, HLG_C = 0.17883277, 0.28466892, 0.55991073
"""Constants of the camera curve of hybrid log-gamma (ITU-R BT.2100, table 5)."""
POWER_CURVES: dict[Transfer, tuple[float, float, float]] = {
    "srgb": (1.0 / 2.4, 0.055, 0.04045),
    "bt709": (0.45, 0.099, 0.081),
    "linear": (1.0, 0.0, 1e-4),
    "gamma22": (1.0 / 2.2, 0.0, 1e-4),
    "gamma28": (1.0 / 2.8, 0.0, 1e-4),
}
"""(p, b, e) of the curves whose encoded values are (1 + b) L^p - b, and above e, where a straight toe ends."""


def linear_from_encoded(encoded: ArrayLike, transfer: Transfer = "srgb") -> NDArray[np.float32]:
    """Linear light of encoded values; values outside [0, 1] are clamped.

    Args:
        encoded: any shape, 1 is full scale.
        transfer: `srgb` (IEC 61966-2-1), `bt709` (the inverse of the camera curve of BT.709, BT.601 and BT.2020),
            `linear`, a pure power, or `hlg` (the inverse of the camera curve of hybrid log-gamma, BT.2100).
    """
    e = np.clip(np.asarray(encoded, np.float32), 0.0, 1.0)
    match transfer:
        case "linear":
            return e
        case "srgb":
            return np.where(e <= 0.04045, e / 12.92, ((e + 0.055) / 1.055) ** 2.4).astype(np.float32)
        case "bt709":
            return np.where(e < 0.081, e / 4.5, ((e + 0.099) / 1.099) ** (1 / 0.45)).astype(np.float32)
        case "gamma22":
            return e ** np.float32(2.2)
        case "gamma28":
            return e ** np.float32(2.8)
        case "hlg":
            return np.where(e <= 0.5, e**2 / 3.0, (np.exp((e - HLG_C) / HLG_A) + HLG_B) / 12.0).astype(np.float32)


def encoded_from_linear(linear: ArrayLike, transfer: Transfer = "srgb") -> NDArray[np.float32]:
    """Encoded values of linear light; the inverse of `linear_from_encoded`, clamped to [0, 1]."""
    x = np.clip(np.asarray(linear, np.float32), 0.0, 1.0)
    match transfer:
        case "linear":
            return x
        case "srgb":
            return np.where(x <= 0.0031308, x * 12.92, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)
        case "bt709":
            return np.where(x < 0.018, x * 4.5, 1.099 * x**0.45 - 0.099).astype(np.float32)
        case "gamma22":
            return x ** np.float32(1 / 2.2)
        case "gamma28":
            return x ** np.float32(1 / 2.8)
        case "hlg":
            upper = HLG_A * np.log(np.maximum(12.0 * x - HLG_B, 0.5)) + HLG_C
            return np.where(x <= 1.0 / 12.0, np.sqrt(3.0 * x), upper).astype(np.float32)
