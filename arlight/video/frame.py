"""One picture of a video: its planes as decoded, and exact conversion between them and linear light."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from arlight.color import Transfer
from arlight.video import conversion, dimming
from arlight.video.conversion import FloatImage, Planes
from arlight.video.layout import PictureCodes
from arlight.video.pixel_format import PixelFormat


class Region(NamedTuple):
    """A rectangle of pixels, x0 <= x < x1 and y0 <= y < y1."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.x1 - self.x0, self.y1 - self.y0

    def grown(self, margin_px: int) -> "Region":
        """The rectangle with a margin on every side; it may leave the picture."""
        return Region(self.x0 - margin_px, self.y0 - margin_px, self.x1 + margin_px, self.y1 + margin_px)

    def joined(self, other: "Region") -> "Region":
        """The smallest rectangle that holds both."""
        return Region(min(self.x0, other.x0), min(self.y0, other.y0), max(self.x1, other.x1), max(self.y1, other.y1))

    def clipped(self, size: tuple[int, int]) -> "Region":
        """The part inside a picture of `size` (w, h) [px]; empty where they do not meet."""
        x0, y0 = min(max(self.x0, 0), size[0]), min(max(self.y0, 0), size[1])
        return Region(x0, y0, max(x0, min(self.x1, size[0])), max(y0, min(self.y1, size[1])))


class Shade(NamedTuple):
    """Light taken away from a part of a picture."""

    region: Region
    """Its edges at multiples of 4 pixels, or at the picture's own [px]."""
    left: FloatImage
    """(3, rows, columns) share of red, green and blue linear light that is left, clamped to [0, 1], at every 4th pixel
    from the region's first, one beyond its last: interpolated between."""


class Layer(NamedTuple):
    """Light laid over a part of a picture."""

    region: Region
    """Any [px]."""
    over: FloatImage
    """(h, w, 4) linear light times coverage, and coverage in [0, 1]."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture, immutable: the planes are read-only views, copies only where rows are not contiguous."""

    index: int
    """Number of the frame in its source, from 0."""
    time_s: float
    """Presentation time in the source's own clock [s]; the first frame need not be at 0."""
    planes: Planes
    """Arrays (h, w) of codes: (Y, Cb, Cr) with chroma as stored, one grey plane, or (R, G, B)."""
    format: PixelFormat
    """What the codes mean."""
    places: PictureCodes = field(init=False, repr=False)
    """Where the planes are, as compiled code takes them; to be read only, while the frame is kept."""

    def __post_init__(self) -> None:
        expected = self.format
        w, h = self.planes[0].shape[1], self.planes[0].shape[0]
        chroma = expected.chroma_size((w, h))[::-1]
        shapes = [(h, w), chroma, chroma][: expected.plane_count]
        found = [p.shape for p in self.planes]
        if found != shapes or any(p.dtype != expected.dtype for p in self.planes):
            raise ValueError(f"planes of {expected} must be {expected.dtype.__name__} of {shapes}, found {found}")
        # compiled code reads rows, one below the other
        readable = (p.strides[1] == p.itemsize and p.strides[0] > 0 for p in self.planes)
        views = tuple(p.view() if ok else p.copy() for p, ok in zip(self.planes, readable, strict=True))
        for view in views:
            view.flags.writeable = False
        object.__setattr__(self, "planes", views)
        object.__setattr__(self, "places", PictureCodes.of(views))

    def __reduce__(self) -> tuple[type["Frame"], tuple[int, float, Planes, PixelFormat]]:
        """What makes it anew elsewhere, where its planes are in other places."""
        return Frame, (self.index, self.time_s, self.planes, self.format)

    @classmethod
    def from_rgb(
        cls, image: NDArray[np.uint8], index: int = 0, time_s: float = 0.0, transfer: Transfer = "srgb"
    ) -> "Frame":
        """A frame of an image (h, w, 3), uint8, encoded with `transfer`, full range."""
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
            raise ValueError(f"image must be uint8 (h, w, 3), found {image.dtype} {image.shape}")
        planes = tuple(np.ascontiguousarray(image[..., c]) for c in range(3))
        return cls(index, time_s, planes, PixelFormat("rgb", True, 8, transfer=transfer))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [px]."""
        return self.planes[0].shape[1], self.planes[0].shape[0]

    @property
    def full_region(self) -> Region:
        """The whole picture."""
        return Region(0, 0, *self.size)

    def luma(self) -> NDArray[np.uint8]:
        """Encoded luma (h, w), uint8, 0 black and 255 white; the decoded plane itself where it already is that."""
        return conversion.full_range_luma(self.planes, self.format)

    def linear_luma(self, region: Region | None = None) -> FloatImage:
        """Linear light (h, w) of the encoded luma of a region, in [0, 1]; the whole picture by default."""
        return conversion.linear_luma(self.planes, self.format, self._inside(region))

    def encoded_rgb(self, region: Region | None = None, chroma: conversion.Upsampling = "guided") -> FloatImage:
        """Encoded R'G'B' (h, w, 3) in [0, 1] of a region; the whole picture by default.

        Args:
            region: rectangle inside the picture [px].
            chroma: `guided` upsampling follows luma, `bilinear` does not; see `conversion`.
        """
        return conversion.encoded_rgb(self.planes, self.format, self._inside(region), chroma)

    def linear_rgb(self, region: Region | None = None, chroma: conversion.Upsampling = "guided") -> FloatImage:
        """Linear light (h, w, 3) of a region, 1 is full scale; arguments as in `encoded_rgb`."""
        return conversion.linear_rgb(self.planes, self.format, self._inside(region), chroma)

    def with_linear_rgb(self, region: Region, linear: ArrayLike) -> "Frame":
        """The frame with a region's linear light replaced; what did not change keeps its codes bit by bit.

        Args:
            region: rectangle inside the picture [px].
            linear: (h, w, 3) of the region, 1 is full scale; clamped to [0, 1].

        Returns:
            A frame in the same format; a grey frame becomes 4:2:0 colour.
        """
        inside = self._inside(region)
        image = _image(linear, (*inside.size[::-1], 3), "linear")
        opaque = np.concatenate([image, np.ones((*image.shape[:2], 1), np.float32)], axis=2)
        return self.composed(layer=Layer(inside, opaque))

    def composed(self, shade: Shade | None = None, layer: Layer | None = None) -> "Frame":
        """The frame with light taken away, and then with light laid over it; what that leaves keeps its codes.

        Args:
            shade: what is left of the light of a region; right to a code or so.
            layer: light that covers a region.

        Returns:
            A frame in the same format; a grey frame becomes 4:2:0 colour.
        """
        planes, format_ = conversion.with_chroma(self.planes, self.format)
        planes = _copied(planes)
        if shade is not None:
            region = self._inside(shade.region)
            if dimming.node_box(region, self.size) != region:
                raise ValueError(f"the shade's edges must be at multiples of {dimming.NODE_PX}, found {tuple(region)}")
            dimming.dim(planes, format_, region, _image(shade.left, (3, *dimming.nodes_of(region)), "left"))
        if layer is not None:
            region = self._inside(layer.region)
            conversion.cover(planes, format_, region, _image(layer.over, (*region.size[::-1], 4), "over"))
        return replace(self, planes=planes, format=format_)

    def converted(self, target: PixelFormat) -> "Frame":
        """The frame in another Y'CbCr format of the same transfer, for an encoder that cannot take its own."""
        return replace(self, planes=conversion.converted(self.planes, self.format, target), format=target)

    def _inside(self, region: Region | None) -> Region:
        if region is None:
            return self.full_region
        region = Region(*(int(v) for v in region))
        if region.clipped(self.size) != region:
            raise ValueError(f"region {tuple(region)} leaves the picture of {self.size[0]}x{self.size[1]} pixels")
        return region


def _copied(planes: Planes) -> Planes:
    """Copies that lie one after the other, as an encoder takes them."""
    memory = np.empty(sum(plane.size for plane in planes), planes[0].dtype)
    copies, first = [], 0
    for plane in planes:
        copies.append(memory[first : first + plane.size].reshape(plane.shape))
        copies[-1][:] = plane
        first += plane.size
    return tuple(copies)


def _image(values: ArrayLike, shape: tuple[int, ...], name: str) -> FloatImage:
    """Values as compiled code takes them."""
    image = np.ascontiguousarray(values, np.float32)
    if image.shape != shape:
        raise ValueError(f"{name} must be {shape}, found {image.shape}")
    return image
