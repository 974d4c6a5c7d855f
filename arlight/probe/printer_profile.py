"""What is known of a printer: its resolution and how it prints tones. On disk: format `arlight-printer`, version 1."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from arlight.errors import OutputError, ProbeError
from arlight.probe.fields import Field
from arlight.probe.halftone import Tones
from arlight.probe.resolution import RESOLUTIONS, Dpi
from arlight.probe.tone import ToneCurve

FORMAT = "arlight-printer"
VERSION = 1


@dataclass(frozen=True, slots=True)
class PrinterProfile:
    """A printer with its media."""

    dpi: Dpi
    """Resolution at which the tones were measured: other dots have other tones [1/inch]."""
    paper: ToneCurve | None = None
    """Tone on paper; None where it was not measured."""
    film: ToneCurve | None = None
    """Tone on transparency; None where it was not measured."""

    @property
    def tones(self) -> Tones:
        """What to compensate when the sheet is printed."""
        return Tones(film=self.film, paper=self.paper)

    def require_dpi(self, dpi: int) -> None:
        """Refuse other dots than the profile was measured with.

        Raises:
            ProbeError: the resolutions differ.
        """
        if dpi != self.dpi:
            raise ProbeError(
                f"the printer's profile is of {self.dpi} dpi, found {dpi} dpi, whose dots grow differently; use "
                f"{self.dpi} dpi, or print and measure a wedge at {dpi} dpi"
            )


def save_profile(profile: PrinterProfile, path: Path | str) -> None:
    """Write a profile; reading it back gives an equal one.

    Raises:
        OutputError: the file cannot be written.
    """
    media = {name: curve for name, curve in (("paper", profile.paper), ("film", profile.film)) if curve is not None}
    content: dict[str, Any] = {"format": FORMAT, "version": VERSION, "dpi": profile.dpi}
    content |= {name: {"asked": curve.asked, "printed": curve.printed} for name, curve in media.items()}
    try:
        Path(path).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{path}: the profile cannot be written ({error.strerror}); choose another folder") from error


def load_profile(path: Path | str) -> PrinterProfile:
    """Read a printer's profile.

    Raises:
        ProbeError: the file is missing, is not JSON, has another format, or holds an impossible tone curve; the
            message names file and field.
    """
    path = Path(path)
    if not path.is_file():
        raise ProbeError(f"{path}: no such file; a printer's profile is made by `arlight calibrate printer`")
    content = Field.read(path)
    content.at("format").text([FORMAT])
    content.at("version").integer(VERSION, VERSION)
    number = content.at("dpi").integer(1, 100000)
    dpi = next((known for known in RESOLUTIONS if known == number), None)
    if dpi is None:
        raise content.at("dpi").refuse(f"one of {', '.join(str(known) for known in RESOLUTIONS)}")
    return PrinterProfile(dpi, _curve(content, "paper"), _curve(content, "film"))


def _curve(content: Field, medium: str) -> ToneCurve | None:
    if not content.has(medium):
        return None
    field = content.at(medium)
    asked = tuple(item.number(0.0, 1.0) for item in field.at("asked").items())
    printed = tuple(item.number(0.0, 1.0) for item in field.at("printed").items(len(asked)))
    try:
        return ToneCurve(asked, printed)
    except ProbeError as error:
        raise ProbeError(f"{content.file}: {medium}: {error}") from error
