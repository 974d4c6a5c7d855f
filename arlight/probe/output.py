"""Everything that `arlight probe` writes, into one folder, all of it or nothing."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from arlight.errors import OutputError
from arlight.probe.design import Probe
from arlight.probe.guide import write_guide
from arlight.probe.halftone import Halftones
from arlight.probe.layout import require_page
from arlight.probe.pages import Paper
from arlight.probe.preview import preview_image
from arlight.probe.printing import write_pdfs
from arlight.probe.rasters import render_rasters, write_rasters
from arlight.probe.storage import save_probe


def write_probe(
    probe: Probe,
    folder: Path | str,
    paper: Paper = "a4",
    mirror_film: bool = True,
    dots: Halftones | None = None,
    notes: Sequence[str] = (),
) -> list[Path]:
    """Write probe.json, the rasters, the PDFs, preview.png and guide.pdf.

    The files are made beside their places and moved there when all are complete: a failure leaves what stood in the
    folder as it was.

    Args:
        probe: the sheet.
        folder: where to; made if it does not exist.
        paper: page that is printed on.
        mirror_film: print the film mirrored, for ink that faces the glass.
        dots: the layers as a bilevel printer's dots, which the PDFs then hold; in grey, for the printer to screen, by
            default.
        notes: what the guide says about this printer beside the rest, one paragraph each.

    Returns:
        The files, probe.json first.

    Raises:
        ProbeError: the sheet does not fit the page.
        OutputError: the folder or a file in it cannot be written.
    """
    require_page(probe, paper)
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=".probe-", dir=folder) as temporary:
            made = _make(probe, Path(temporary), paper, mirror_film, dots, notes)
            return _move(made, folder)
    except OSError as error:
        raise OutputError(
            f"{folder}: the probe cannot be written there ({error.strerror or error}); choose another folder"
        ) from error


def _make(
    probe: Probe, folder: Path, paper: Paper, mirror_film: bool, dots: Halftones | None, notes: Sequence[str]
) -> list[Path]:
    rasters = render_rasters(probe)
    save_probe(probe, folder / "probe.json")
    paths = [folder / "probe.json", *write_rasters(rasters, probe.pixels_per_mm, folder)]
    paths += write_pdfs(probe, dots or rasters, folder, paper, mirror_film)
    preview_image(probe, rasters).save(folder / "preview.png", compress_level=9)
    write_guide(probe, folder / "guide.pdf", paper, mirror_film, None if dots is None else dots.dpi, notes)
    return [*paths, folder / "preview.png", folder / "guide.pdf"]


def _move(made: list[Path], folder: Path) -> list[Path]:
    places = [folder / path.name for path in made]
    for place in places:
        # looked at first: the moves below must not stop halfway
        if place.is_dir():
            raise OutputError(f"{place}: is a folder, but a file is to be written there; choose another output folder")
    for path, place in zip(made, places, strict=True):
        path.replace(place)
    return places
