import base64
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from arlight.camera import Pose


@dataclass(frozen=True)
class Pdf:
    """What a test needs of a PDF that reportlab wrote."""

    pages: int
    page_pt: tuple[float, float]
    drawing: str
    """The page's operators."""
    images: dict[tuple[int, int], bytes]
    """Decoded samples by (width, height)."""


def _decoded(body: bytes, head: bytes) -> bytes:
    if b"ASCII85Decode" in head:
        body = base64.a85decode(b"<~" + body.strip(), adobe=True)
    return zlib.decompress(body) if b"FlateDecode" in head else body


def _parse(path: Path) -> Pdf:
    content = path.read_bytes()
    box = re.search(rb"/MediaBox \[ ?([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+)", content)
    assert box is not None
    images, drawing = {}, ""
    stream = rb"<<((?:(?!>>).)*?/Length \d+(?:(?!stream).)*?)>>\s*stream\r?\n(.*?)endstream"
    for match in re.finditer(stream, content, re.S):
        head, body = match.group(1), match.group(2)
        data = _decoded(body, head)
        if b"/Image" in head:
            width, height = (int(re.search(rb"/" + key + rb" (\d+)", head).group(1)) for key in (b"Width", b"Height"))
            images[(width, height)] = data
        else:
            drawing += data.decode("latin-1")
    left, bottom, right, top = (float(number) for number in box.groups())
    return Pdf(len(re.findall(rb"/Type /Page\b", content)), (right - left, top - bottom), drawing, images)


@pytest.fixture(scope="session")
def read_pdf():
    return _parse


@pytest.fixture(scope="session")
def look() -> Callable[..., Pose]:
    """The pose of a camera that looks at a point off_mm beside the middle, from a direction and a distance."""

    def pose(tilt_deg: float, azimuth_deg: float, distance_mm: float, roll_deg: float = 0.0, off_mm=(0.0, 0.0)) -> Pose:
        tilt, azimuth, roll = np.radians([tilt_deg, azimuth_deg, roll_deg])
        up = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
        right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        level = np.stack([right, np.cross(-up, right), -up])
        turned = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]]) @ level
        return Pose(turned, np.array([0.0, 0.0, distance_mm]) - turned @ np.array([*off_mm, 0.0]))

    return pose
