"""The report of a run: one self-contained HTML page, coefficients over time, light beside thumbnails."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.color import encoded_from_linear
from arlight.errors import OutputError
from arlight.fourier import synthesise
from arlight.results.record import LogHeader, LogRecord
from arlight.results.sample import EvenSample
from arlight.results.statistics import RunStatistics
from arlight.video.frame import Frame

_THUMBNAILS = 12
# from half of them on, as many as a chart shows points
_RECORDS = 800
_THUMBNAIL_WIDTH_PX = 256
_DISK_PX = 144
# share of the disk's pixels that may be brighter than its white
_BRIGHTEST = 0.995

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 1100px; padding: 0 1rem; color: #222; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 2rem; }
table { border-collapse: collapse; } td { padding: .15rem 1.2rem .15rem 0; vertical-align: top; }
td:first-child { color: #666; }
svg { width: 100%; height: auto; }
.frames { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 1rem; }
figure { margin: 0; } figure div { display: flex; gap: .5rem; align-items: center; }
figure img.frame { width: 210px; border-radius: 3px; } figure img.disk { width: 112px; height: 112px; }
figcaption, .note { color: #666; font-size: .85rem; }
"""


@dataclass(frozen=True, slots=True)
class Thumbnail:
    """A small picture of a frame."""

    record: LogRecord
    """What the log says of the frame."""
    image: NDArray[np.uint8]
    """(h, w, 3) sRGB."""


@dataclass(slots=True)
class ReportRecorder:
    """Remembers, during a run, what its report will show; constant memory, and the length need not be known."""

    header: LogHeader
    """What the frames have in common."""
    records: EvenSample[LogRecord] = field(default_factory=lambda: EvenSample(_RECORDS))
    """Frames without their pictures."""
    thumbnails: EvenSample[Thumbnail] = field(default_factory=lambda: EvenSample(2 * _THUMBNAILS))
    """Pictures of some frames, less than twice as many as are shown."""

    def add(self, record: LogRecord, frame: Frame) -> None:
        """Remember a finished frame."""
        self.records.add(record)
        self.thumbnails.offer(lambda: Thumbnail(record, _small_picture(frame)))

    def write(self, path: Path, statistics: RunStatistics) -> None:
        """Write the page.

        Raises:
            OutputError: the file cannot be written.
        """
        thumbnails = self.thumbnails.items
        step = max(1, -(-len(thumbnails) // _THUMBNAILS))
        page = report_page(self.header, self.records.items, thumbnails[::step], statistics)
        try:
            path.write_text(page, encoding="utf-8")
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error.strerror}); choose another --report") from error


def report_page(
    header: LogHeader, records: Sequence[LogRecord], thumbnails: Sequence[Thumbnail], statistics: RunStatistics
) -> str:
    """The page as HTML."""
    # here, because only a finished report needs matplotlib, which takes long to load
    from arlight.results.charts import coefficient_chart

    rows = "".join(f"<tr><td>{escape(k)}</td><td>{escape(v)}</td></tr>" for k, v in _facts(header, statistics))
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Light in {escape(Path(header.source).name)}</title>
<style>{_STYLE}</style></head><body>
<h1>Light in {escape(Path(header.source).name)}</h1>
<table>{rows}</table>
<h2>Coefficients over time</h2>
{coefficient_chart(header, records)}
<p class="note">Coefficients of the received lighting, luminance of linear RGB [radiance * sr, 1 is the camera's full
scale]; bands are two standard deviations. The strip shows where the sheet was tracked (green), bridged (amber) and
lost (red).</p>
<h2>Recovered light</h2>
<div class="frames">{_figures(header, thumbnails)}</div>
<p class="note">Disks: the light that the sheet receives from every direction, seen from above with the sheet's x to
the right and y up; the centre is straight above, the rim is the horizon. All disks share one exposure.</p>
</body></html>
"""


def light_disk(
    coefficients: NDArray[np.complex128], frequencies: NDArray[np.int64], size_px: int
) -> NDArray[np.float64]:
    """Received lighting (size, size, 3) over the light plane, row 0 at +y, negative lobes cut; nan outside the disk."""
    axis = (np.arange(size_px) + 0.5) / size_px - 0.5
    x, y = np.meshgrid(axis, -axis)
    points = np.stack([x, y], axis=-1).reshape(-1, 2)
    light = np.maximum(synthesise(coefficients, points, frequencies), 0.0)
    light[np.hypot(points[:, 0], points[:, 1]) > 0.5] = np.nan
    return light.reshape(size_px, size_px, 3)


def _facts(header: LogHeader, statistics: RunStatistics) -> list[tuple[str, str]]:
    stages = ", ".join(f"{stage} {ms:.1f}" for stage, ms in statistics.median_ms.items())
    width, height = header.camera.image_size
    return [
        ("clip", f"{header.source}, {width} x {height}"),
        ("probe", f"{header.probe}, {header.sheet_mm[0]:g} x {header.sheet_mm[1]:g} mm"),
        ("frames", f"{statistics.frames}, {100.0 * statistics.tracked_share:.1f} % tracked"),
        ("speed", f"{statistics.frames_per_second:.1f} frames/s; ms per frame (medians): {stages}"),
        ("residual", f"median chi-square per degree of freedom {statistics.median_chi2:.2f}"),
    ]


def _figures(header: LogHeader, thumbnails: Sequence[Thumbnail]) -> str:
    disks = [None if t.record.coefficients is None else _disk_of(header, t.record.coefficients) for t in thumbnails]
    known = [disk for disk in disks if disk is not None]
    white = float(np.nanquantile(np.stack(known), _BRIGHTEST)) if known else 1.0
    return "".join(_figure(t, disk, white) for t, disk in zip(thumbnails, disks, strict=True))


def _disk_of(header: LogHeader, coefficients: NDArray[np.complex128]) -> NDArray[np.float64]:
    return light_disk(coefficients, header.frequencies[: len(coefficients)], _DISK_PX)


def _figure(thumbnail: Thumbnail, disk: NDArray[np.float64] | None, white: float) -> str:
    record = thumbnail.record
    frame = f'<img class="frame" alt="frame {record.frame}" src="{_data_uri(".jpg", thumbnail.image[..., ::-1])}">'
    light = (
        "" if disk is None else f'<img class="disk" alt="light" src="{_data_uri(".png", _disk_image(disk, white))}">'
    )
    caption = f"frame {record.frame}, {record.time_s:.2f} s, {record.status}"
    return f"<figure><div>{frame}{light}</div><figcaption>{caption}</figcaption></figure>"


def _disk_image(disk: NDArray[np.float64], white: float) -> NDArray[np.uint8]:
    """BGRA picture of a disk, transparent outside."""
    inside = np.isfinite(disk[..., 0])
    encoded = encoded_from_linear(np.where(inside[..., None], disk, 0.0) / max(white, 1e-12))
    image = np.concatenate([encoded[..., ::-1], inside[..., None]], axis=-1)
    return np.rint(255.0 * image).astype(np.uint8)


def _small_picture(frame: Frame) -> NDArray[np.uint8]:
    encoded = frame.encoded_rgb(chroma="bilinear")
    height, width = encoded.shape[:2]
    small_width = min(_THUMBNAIL_WIDTH_PX, width)
    size = (small_width, max(1, round(height * small_width / width)))
    return np.rint(255.0 * cv2.resize(encoded, size, interpolation=cv2.INTER_AREA)).astype(np.uint8)


def _data_uri(extension: str, image: NDArray[np.uint8]) -> str:
    _, data = cv2.imencode(extension, np.ascontiguousarray(image))
    kind = "jpeg" if extension == ".jpg" else extension.lstrip(".")
    return f"data:image/{kind};base64,{b64encode(data.tobytes()).decode()}"
