"""`arlight probe`: design a sheet and write what is needed to print and use it, or a tone wedge for a printer."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from arlight.calibration.printer.predicted_error import Conditions, PredictedError, advice, predict_error
from arlight.commands.options.probe import RASTER_PER_MM, ProbeOptions
from arlight.optics import Slab
from arlight.probe.design import Probe
from arlight.probe.halftone import MM_PER_INCH, Halftones, Tones, render_halftones, require_dots
from arlight.probe.layout import design_probe
from arlight.probe.output import write_probe
from arlight.probe.printer_profile import PrinterProfile, load_profile
from arlight.probe.resolution import Dpi
from arlight.probe.wedge import write_wedge_folder

ACCEPTABLE_ERROR = 0.03
"""Predicted error relative to |L~_0| from which the command warns."""

_UNMEASURED_DOT_GAIN = 0.1
"""What printers' dots grow by at half coverage where no profile says so."""
_DEFAULT_DPI: Dpi = 600


def run(options: ProbeOptions) -> int:
    """Write the sheet or the wedge; returns the exit status.

    Raises:
        ProbeError: the design is impossible, does not fit the page or the printer, or the profile cannot be used.
        OutputError: the folder cannot be written.
    """
    profile = None if options.printer_profile is None else load_profile(options.printer_profile)
    dpi = _resolution(options, profile)
    console = Console(soft_wrap=True, highlight=False, markup=False)
    if options.wedge:
        tone = None if profile is None else profile.paper or profile.film
        console.print(f"  {write_wedge_folder(options.output, dpi or _DEFAULT_DPI, options.paper, tone)}")
        return 0
    probe = _design(options, dpi)
    dots, predicted, notes = None, None, []
    if dpi is not None:
        tones = Tones() if profile is None else profile.tones
        with Console(stderr=True).status(f"dots of {dpi} dpi"):
            dots, predicted = _printed(probe, dpi, tones)
        notes = _notes(probe, predicted, tones, dpi)
    written = write_probe(probe, options.output, options.paper, options.mirror_film, dots, notes)
    _summarise(console, probe, notes, written)
    return 0


def _resolution(options: ProbeOptions, profile: PrinterProfile | None) -> Dpi | None:
    if profile is not None and options.dpi is not None:
        profile.require_dpi(options.dpi)
    return options.dpi if profile is None else profile.dpi


def _design(options: ProbeOptions, dpi: Dpi | None) -> Probe:
    per_mm = options.pixels_per_mm
    if dpi is not None:
        require_dots(Slab(options.glass_mm, options.refractive_index), options.order, options.design, dpi)
        # a raster pixel is a whole number of dots: what is laid out in pixels is printed in dots
        per_mm = dpi / MM_PER_INCH / _dots_per_pixel(dpi)
    return design_probe(
        order=options.order,
        design=options.design,
        glass_mm=options.glass_mm,
        refractive_index=options.refractive_index,
        pixels_per_mm=per_mm,
        paper=options.paper,
    )


def _dots_per_pixel(dpi: Dpi) -> int:
    return max(1, int(dpi / MM_PER_INCH / RASTER_PER_MM))


def _printed(probe: Probe, dpi: Dpi, tones: Tones) -> tuple[Halftones, PredictedError]:
    fine = replace(probe, pixels_per_mm=probe.pixels_per_mm * _dots_per_pixel(dpi))
    dots = render_halftones(fine, tones)
    known = tones.film is not None and tones.paper is not None
    conditions = Conditions() if known else Conditions(dot_gain=_UNMEASURED_DOT_GAIN)
    return dots, predict_error(fine, dots, tones, conditions)


def _notes(probe: Probe, predicted: PredictedError, tones: Tones, dpi: Dpi) -> list[str]:
    """What is to be expected of this printer, for the guide and the summary."""
    errors = ", ".join(f"{order}: {100.0 * error:.1f} %" for order, error in enumerate(predicted.total))
    gains = [
        f"{name} {100.0 * tone.dot_gain:.0f} %"
        for name, tone in (("film", tones.film), ("paper", tones.paper))
        if tone is not None
    ]
    compensated = f"compensated ({', '.join(gains)})" if gains else "not compensated, taken for 10 %"
    return [
        f"Predicted error of the light's coefficients by order, relative to |L_0|, single frame: {errors}. "
        f"Dot gain is {compensated}.",
        *(line[0].upper() + line[1:] + "." for line in advice(probe, predicted, ACCEPTABLE_ERROR, dpi)),
    ]


def _summarise(console: Console, probe: Probe, notes: Sequence[str], written: Sequence[Path]) -> None:
    patterns = sum(block.kind == "pattern" for block in probe.blocks)
    console.print(
        f"order {probe.order}, {probe.design}: {patterns} patterned blocks, {len(probe.markers)} markers, "
        f"{probe.sheet_mm[0]:.1f} x {probe.sheet_mm[1]:.1f} mm"
    )
    for note in notes:
        console.print(note)
    for path in written:
        console.print(f"  {path}")
