"""What measuring reads: planes of every layout, wherever they lie in memory, and nothing beside them."""

from dataclasses import fields

import numpy as np
import pytest

from arlight.camera import Camera, Pose
from arlight.errors import CameraError
from arlight.probe.layout import design_probe
from arlight.tracking.block_means import BlockMeans
from arlight.tracking.blocks import BlockMeter
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat

PROBE = design_probe(order=2)
FORMATS = {
    "rgb": PixelFormat("rgb", True, 8),
    "deep": PixelFormat("bt2020", True, 12),
    "grey": PixelFormat("gray", True, 8),
    "4:2:0": PixelFormat("bt709", False, 8, (1, 1), (0.0, 0.5)),
    "4:2:0 deep": PixelFormat("bt709", False, 10, (1, 1), (0.0, 0.5)),
    "4:2:2": PixelFormat("bt709", False, 8, (1, 0)),
    "4:4:0": PixelFormat("bt709", False, 8, (0, 1)),
    "4:1:1": PixelFormat("bt601", False, 8, (2, 0)),
    "4:1:0": PixelFormat("bt601", False, 8, (2, 2), (1.5, 1.5)),
}


def planes_of(format_, size, seed):
    """Random planes of a picture (w, h), none of whose codes is extreme."""
    generator = np.random.default_rng(seed)
    top = 2**format_.bit_depth
    shapes = [size[::-1], *[format_.chroma_size(size)[::-1]] * 2][: format_.plane_count]
    low, high = (0.45, 0.55) if format_.matrix not in ("rgb", "gray") else (0.2, 0.7)
    return [
        generator.integers(int((low if c else 0.2) * top), int((high if c else 0.7) * top), shape).astype(format_.dtype)
        for c, shape in enumerate(shapes)
    ]


@pytest.mark.parametrize("samples", [10**6, 150])
@pytest.mark.parametrize("name", FORMATS)
def test_nothing_beside_the_planes_is_read(camera, look, name, samples):
    # the sheet runs over all four borders of the picture
    pose = look(10.0, 20.0, 90.0)
    format_ = FORMATS[name]
    planes = planes_of(format_, camera.image_size, 7)
    meter = BlockMeter(PROBE, camera, samples)
    plain = meter.measure(Frame(0, 0.0, tuple(planes), format_), pose, 0.3)
    assert plain.valid.sum() > 5
    for fill in (0, np.iinfo(format_.dtype).max):
        wide = [np.full((p.shape[0] + 3, p.shape[1] + 37), fill, p.dtype) for p in planes]
        inside = []
        for around, plane in zip(wide, planes, strict=True):
            around[1:-2, 5:-32] = plane
            inside.append(around[1:-2, 5:-32])
        # columns two codes apart, and rows from the bottom up
        apart = [np.repeat(p, 2, axis=1)[:, ::2] for p in planes]
        upward = [np.ascontiguousarray(p[::-1])[::-1] for p in planes]
        for other in (inside, apart, upward):
            means = meter.measure(Frame(0, 0.0, tuple(other), format_), pose, 0.3)
            for part in fields(BlockMeans):
                np.testing.assert_array_equal(getattr(means, part.name), getattr(plain, part.name))


@pytest.mark.parametrize("size", [(17, 9), (8, 8), (33, 2), (2, 31)])
@pytest.mark.parametrize("name", FORMATS)
def test_pictures_of_few_pixels_are_no_obstacle(size, name, look):
    matrix = np.array([[20.0, 0, size[0] / 2], [0, 20.0, size[1] / 2], [0, 0, 1]])
    format_ = FORMATS[name]
    meter = BlockMeter(PROBE, Camera(size, matrix, np.zeros(5)))
    for distance in (30.0, 100.0, 1000.0):
        means = meter.measure(Frame(0, 0.0, tuple(planes_of(format_, size, 8)), format_), look(20.0, 0.0, distance))
        assert np.all(np.isfinite(means.values))
        assert np.all(means.samples <= size[0] * size[1])


@pytest.mark.parametrize("name", ["rgb", "4:2:0"])
def test_poses_that_show_nothing_measure_nothing(camera, look, name):
    format_ = FORMATS[name]
    frame = Frame(0, 0.0, tuple(planes_of(format_, camera.image_size, 9)), format_)
    meter = BlockMeter(PROBE, camera)
    good = look(20.0, 30.0, 190.0)
    behind = Pose(good.rotation, -good.translation)
    lost = Pose(good.rotation * np.nan, good.translation)
    nowhere = Pose(good.rotation, np.full(3, np.inf))
    far = Pose(good.rotation, good.translation + (1e9, 0.0, 0.0))
    below = Pose(good.rotation @ np.diag([1.0, -1.0, -1.0]), good.translation)
    for pose in (behind, lost, nowhere, far, below):
        means = meter.measure(frame, pose, 0.3)
        assert not np.any(means.valid)
        assert np.all(means.samples == 0)
        assert np.all(means.values == 0.0)
    assert meter.measure(frame, good, 0.3).valid.sum() > 10


def test_frames_of_another_size_are_refused(camera, look):
    frame = Frame(0, 0.0, tuple(planes_of(FORMATS["rgb"], (320, 240), 10)), FORMATS["rgb"])
    with pytest.raises(CameraError, match="320"):
        BlockMeter(PROBE, camera).measure(frame, look(20.0, 30.0, 190.0))
