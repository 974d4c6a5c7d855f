"""`arlight calibrate printer`: a printer's profile from its printed wedge."""

from dataclasses import replace
from pathlib import Path

from rich.console import Console

from arlight.calibration.printer.wedge_reading import read_wedge, tone_of_values
from arlight.commands.options.calibrate_printer import CalibratePrinterOptions
from arlight.commands.outputs import abandon, prepare_outputs
from arlight.errors import ProbeError
from arlight.probe.printer_profile import PrinterProfile, load_profile, save_profile
from arlight.probe.resolution import Dpi
from arlight.probe.tone import ToneCurve


def run(options: CalibratePrinterOptions) -> int:
    """Write the profile; returns the exit status.

    Raises:
        ProbeError: nothing was given to measure, or it cannot be read.
        OutputError: the profile cannot be written.
    """
    output = prepare_outputs({"--output": options.output}, [options.photo, options.film_photo])["--output"]
    profile = _profile(options)
    try:
        save_profile(profile, output.growing)
        path = output.keep()
    except BaseException:
        abandon([output], worth_keeping=False)
        raise
    console = Console(soft_wrap=True, highlight=False, markup=False)
    for name, tone in (("paper", profile.paper), ("film", profile.film)):
        if tone is None:
            console.print(f"{name}: not measured; give its photograph with --update {path}")
        else:
            console.print(
                f"{name}: dot gain {100.0 * tone.dot_gain:.1f} % at half coverage, solid ink leaves "
                f"{100.0 * tone.solid:.1f} %"
            )
    console.print(f"  {path}")
    return 0


def _profile(options: CalibratePrinterOptions) -> PrinterProfile:
    paper = _measured("--values", options.photo, options.values, options.dpi)
    film = _measured("--film-values", options.film_photo, options.film_values, options.dpi)
    found = paper or film
    if found is None:
        raise ProbeError("nothing to measure: give a photograph of the printed wedge, --film-photo, or --values")
    profile = PrinterProfile(found[0]) if options.update is None else load_profile(options.update)
    for one in (paper, film):
        if one is not None:
            profile.require_dpi(one[0])
    return replace(
        profile,
        paper=profile.paper if paper is None else paper[1],
        film=profile.film if film is None else film[1],
    )


def _measured(
    option: str, photo: Path | None, values: tuple[float, ...], dpi: Dpi | None
) -> tuple[Dpi, ToneCurve] | None:
    """Resolution and curve of one medium; None where nothing was given."""
    if photo is not None and values:
        raise ProbeError(f"{photo}: {option} stands for the same wedge; give one of them")
    if photo is not None:
        reading = read_wedge(photo)
        if dpi is not None:
            PrinterProfile(reading.dpi).require_dpi(dpi)
        try:
            return reading.dpi, tone_of_values(reading.values)
        except ProbeError as error:
            raise ProbeError(f"{photo}: {error}") from error
    if not values:
        return None
    if dpi is None:
        raise ProbeError(f"{option}: give the resolution that the wedge was printed with as --dpi, such as --dpi 600")
    return dpi, tone_of_values(values)
