"""What a decoded picture's layout and colour tags mean."""

import re
from fractions import Fraction
from functools import cache
from typing import NamedTuple

import av
import av.filter
import av.logging

from arlight.color import Transfer
from arlight.errors import VideoError
from arlight.video.pixel_format import CHROMA_LOCATIONS, HD_LINES, Matrix, PixelFormat, chroma_offset_px

PLANAR = re.compile(
    r"(?P<kind>yuvj?a?|gbra?|gray)(?P<sampling>4[1-4][0-4])?(?P<p>p?)(?P<bits>9|10|12|14|16)?(?P<end>le)?$"
)
SHIFTS = {"410": (2, 2), "411": (2, 0), "420": (1, 1), "422": (1, 0), "440": (0, 1), "444": (0, 0)}
MATRICES: dict[int, Matrix] = {
    1: "bt709", 4: "fcc", 5: "bt601", 6: "bt601", 7: "smpte240m", 9: "bt2020",
}  # fmt: skip
"""Matrix coefficients by their number in ITU-T H.273."""
TRANSFERS: dict[int, Transfer] = {
    1: "bt709", 2: "srgb", 4: "gamma22", 5: "gamma28", 6: "bt709", 7: "bt709", 8: "linear", 11: "bt709", 12: "bt709",
    13: "srgb", 14: "bt709", 15: "bt709", 18: "hlg",
}  # fmt: skip
"""Transfer by its number in ITU-T H.273. Tagged camera curves are inverted as such, because the light of the scene is
wanted, not that of a display; untagged pictures (2, or the reserved 0 and 3) are read as sRGB."""
TRANSFER_NUMBERS: dict[Transfer, int] = {
    "bt709": 1, "gamma22": 4, "gamma28": 5, "linear": 8, "srgb": 13, "hlg": 18,
}  # fmt: skip
"""What a transfer is tagged as."""
UNSPECIFIED = 2
FULL_RANGE = 2
GREY_IS_LIMITED = frozenset({"h264", "hevc", "av1", "vp8", "vp9", "mpeg1video", "mpeg2video", "mpeg4", "libdav1d"})
"""Codecs whose untagged luma is limited range even without chroma; still-picture codecs use all codes for grey."""


class ColourTags(NamedTuple):
    """A stream's colour tags, by their numbers in ITU-T H.273 and, for the range, the decoder library's."""

    matrix: int
    """Matrix coefficients; 2 is unspecified."""
    range: int
    """1 limited, 2 full, 0 unspecified."""
    transfer: int
    """Transfer characteristics; 2 is unspecified."""
    primaries: int
    """Colour primaries; 2 is unspecified."""


def colour_tags(picture: av.VideoFrame) -> ColourTags:
    """The tags of a decoded picture."""
    return ColourTags(
        int(picture.colorspace), int(picture.color_range), int(picture.color_trc), int(picture.color_primaries)
    )


def tags_of(format_: PixelFormat, source: ColourTags | None) -> ColourTags:
    """The tags to encode a Y'CbCr picture with: those of its source where they say the same, else the format's own."""
    matrix = next(number for number, name in MATRICES.items() if name == format_.matrix)
    if source and MATRICES.get(source.matrix) == format_.matrix:
        matrix = source.matrix
    transfer = TRANSFER_NUMBERS[format_.transfer]
    if source and TRANSFERS.get(source.transfer) == format_.transfer:
        transfer = source.transfer
    return ColourTags(matrix, FULL_RANGE if format_.full_range else 1, transfer, source.primaries if source else 1)


@cache
def planar_name(name: str) -> str:
    """The layout with one plane a component and at least the same depth that stands for a layout.

    Args:
        name: the decoder library's name of a layout, such as `nv12`.
    """
    match = PLANAR.match(name)
    if match and (match["end"] or not match["bits"]):
        return name
    layout = av.VideoFormat(name, 64, 64)
    bits = max((c.bits for c in layout.components), default=8)
    depth = next(d for d in (8, 10, 12, 16) if bits <= d or d == 16)
    suffix = "" if depth == 8 else f"{depth}le"
    if name.startswith(("gray", "ya", "mono")):
        return f"gray{suffix}"
    if layout.is_rgb or layout.has_palette or name.startswith(("bayer", "xyz")) or len(layout.components) < 3:
        return f"gbrp{suffix}"
    shift = (64 // layout.chroma_width(64), 64 // layout.chroma_height(64))
    sampling = {(1, 1): "444", (2, 1): "422", (2, 2): "420", (4, 1): "411", (1, 2): "440", (4, 4): "410"}[shift]
    return f"yuv{sampling}p{suffix}"


def pixel_format(name: str, tags: ColourTags, location: str | None, size: tuple[int, int], codec: str) -> PixelFormat:
    """What the codes of a picture mean.

    Args:
        name: layout, one of those `planar_name` answers with.
        tags: the stream's colour tags.
        location: where chroma lies (ITU-T H.273 names), None where the stream does not say: left.
        size: coded width and height [px]; untagged pictures of 720 lines or more are BT.709, smaller ones BT.601.
        codec: the decoder's name.

    Raises:
        VideoError: a matrix or a transfer that is not understood.
    """
    match = PLANAR.match(name)
    if match is None:
        raise ValueError(f"{name} is not a planar layout")
    depth = int(match["bits"] or 8)
    transfer = _transfer(tags)
    kind = match["kind"]
    if kind.startswith("gbr"):
        return PixelFormat("rgb", tags.range != 1, depth, transfer=transfer)
    if kind == "gray":
        full = tags.range == FULL_RANGE or (tags.range == 0 and codec not in GREY_IS_LIMITED)
        return PixelFormat("gray", full, depth, transfer=transfer)
    shift = SHIFTS[match["sampling"]]
    offset = chroma_offset_px(location or "left", shift)
    return PixelFormat(
        _matrix(tags, size), tags.range == FULL_RANGE or kind.startswith("yuvj"), depth, shift, offset, transfer
    )


def chroma_location(picture: av.VideoFrame) -> str | None:
    """Where a decoded picture says its chroma lies, None where it does not say.

    The Python bindings do not expose it; the decoder library's own `showinfo` filter reports it in its log.
    """
    graph = av.filter.Graph()
    source = graph.add_buffer(
        width=picture.width, height=picture.height, format=picture.format, time_base=Fraction(1, 1000)
    )
    report, sink = graph.add("showinfo", "checksum=0"), graph.add("buffersink")
    source.link_to(report)
    report.link_to(sink)
    graph.configure()
    level = av.logging.get_level()
    try:
        av.logging.set_level(av.logging.INFO)
        with av.logging.Capture() as lines:
            graph.push(picture)
            graph.pull()
    finally:
        av.logging.set_level(level)
    found = re.search(r"\bcl:(\w+)", " ".join(message for _, part, message in lines if "showinfo" in part))
    return found[1] if found and found[1] in CHROMA_LOCATIONS else None


def _matrix(tags: ColourTags, size: tuple[int, int]) -> Matrix:
    if tags.matrix in (0, UNSPECIFIED, 3):
        return "bt709" if min(size) >= HD_LINES else "bt601"
    if tags.matrix not in MATRICES:
        known = ", ".join(sorted(set(MATRICES.values())))
        raise VideoError(
            f"its colour matrix (number {tags.matrix} of ITU-T H.273) is not understood; expected one of {known}: "
            "convert it, for instance with ffmpeg -vf scale=out_color_matrix=bt709"
        )
    return MATRICES[tags.matrix]


def _transfer(tags: ColourTags) -> Transfer:
    if tags.transfer in (0, 3):
        return "srgb"
    if tags.transfer not in TRANSFERS:
        raise VideoError(
            f"its transfer curve (number {tags.transfer} of ITU-T H.273) is not understood; expected sRGB, BT.709, "
            "HLG, a gamma or linear light: record or convert without PQ or a log profile"
        )
    return TRANSFERS[tags.transfer]
