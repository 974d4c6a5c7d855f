"""Photographs with their exposure, as a still camera leaves them: 8-bit files with EXIF."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageOps, UnidentifiedImageError

from arlight.errors import ArlightError

_TOO_DEEP = ("I", "F", "I;16", "I;16B", "I;16L")


class PhotographError(ArlightError):
    """A photograph, or a bracket of them, that cannot be used."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """How much light a picture was given."""

    time_s: float
    """Exposure time [s]."""
    f_number: float | None = None
    """Aperture; None where the file does not say."""
    iso: float | None = None
    """Sensitivity; None where the file does not say."""

    def equivalent_s(self, other: "Exposure") -> float:
        """Time that gives as much brightness with the other's aperture and sensitivity [s]; what is unknown is taken as
        unchanged."""
        time = self.time_s
        if self.f_number and other.f_number:
            time *= (other.f_number / self.f_number) ** 2
        if self.iso and other.iso:
            time *= self.iso / other.iso
        return time


@dataclass(frozen=True, slots=True, eq=False)
class Photograph:
    """One 8-bit picture and how long it was exposed."""

    name: str
    """What to call it in messages."""
    encoded: NDArray[np.uint8]
    """(h, w, 3) RGB codes."""
    exposure_s: float
    """Exposure time, brought to one aperture and sensitivity for all pictures [s]."""


def read_picture(path: Path) -> tuple[NDArray[np.uint8], Exposure | None]:
    """An 8-bit picture, upright as its EXIF says, and its exposure.

    Returns:
        (h, w, 3) RGB codes; the exposure, None where the file does not tell the time.

    Raises:
        PhotographError: the file is missing, no picture, or not of 8 bits.
    """
    try:
        with Image.open(path) as picture:
            if picture.mode in _TOO_DEEP:
                raise PhotographError(
                    f"{path}: has more than 8 bits a channel ({picture.mode}); export it as 8-bit sRGB, PNG or JPEG"
                )
            exposure = _exposure(picture)
            upright = ImageOps.exif_transpose(picture)
            return np.array((upright or picture).convert("RGB"), np.uint8), exposure
    except FileNotFoundError as error:
        raise PhotographError(f"{path}: no such picture") from error
    except (UnidentifiedImageError, Image.DecompressionBombError, SyntaxError, ValueError) as error:
        raise PhotographError(f"{path}: not a readable picture; export it as 8-bit sRGB, PNG or JPEG") from error
    except OSError as error:
        raise PhotographError(f"{path}: cannot be read ({error}); export it again as 8-bit sRGB") from error


def load_photographs(paths: list[Path], exposures_s: tuple[float, ...] | None = None) -> list[Photograph]:
    """Pictures with their exposures.

    Args:
        paths: files, in any order.
        exposures_s: exposure time of each [s]; from EXIF (time, aperture, sensitivity) by default. A single picture may
            have none: it then counts as 1 s.

    Raises:
        PhotographError: a file cannot be used, or an exposure is missing.
    """
    if exposures_s is not None and len(exposures_s) != len(paths):
        raise PhotographError(
            f"--exposures: {len(exposures_s)} times for {len(paths)} pictures; give one time a picture"
        )
    read = [read_picture(path) for path in paths]
    if exposures_s is not None:
        times = list(exposures_s)
    elif len(paths) == 1 and read[0][1] is None:
        times = [1.0]
    else:
        times = _exif_times(paths, [exposure for _, exposure in read])
    return [Photograph(str(path), codes, time) for path, (codes, _), time in zip(paths, read, times, strict=True)]


def _exif_times(paths: list[Path], exposures: list[Exposure | None]) -> list[float]:
    silent = [str(path) for path, exposure in zip(paths, exposures, strict=True) if exposure is None]
    if silent:
        raise PhotographError(
            f"{', '.join(silent)}: no exposure time in EXIF; state the times of all {len(paths)} pictures "
            "in their order: --exposures S S ..."
        )
    known = [exposure for exposure in exposures if exposure is not None]
    return [exposure.equivalent_s(known[0]) for exposure in known]


def _exposure(picture: Image.Image) -> Exposure | None:
    tags = picture.getexif().get_ifd(ExifTags.IFD.Exif)
    time = _number(tags.get(ExifTags.Base.ExposureTime))
    if time is None:
        return None
    return Exposure(time, _number(tags.get(ExifTags.Base.FNumber)), _number(tags.get(ExifTags.Base.ISOSpeedRatings)))


def _number(value: object) -> float | None:
    """A positive finite number, or None."""
    if isinstance(value, tuple) and value:
        value = value[0]
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if np.isfinite(number) and number > 0.0 else None
