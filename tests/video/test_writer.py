import os
import signal
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import av
import numpy as np
import pytest

from arlight.errors import OutputError
from arlight.video.frame import Frame
from arlight.video.pixel_format import PixelFormat, chroma_offset_px
from arlight.video.reader import VideoReader
from arlight.video.writer import VideoWriter, encoded_format

FINEST = {"crf": 1, "preset": "veryfast"}


def copied(source, output, **options):
    """The source's and the output's frames after a pass through the writer."""
    with VideoReader(source) as reader, VideoWriter(output, reader, **options) as writer:
        before = list(reader)
        for frame in before:
            writer.write(frame)
    return before, list(VideoReader(output))


def packets_of(path, kind):
    with av.open(str(path)) as container:
        stream = container.streams.get({kind: 0})[0]
        return [(p.pts * p.time_base, bytes(p)) for p in container.demux(stream) if p.dts is not None]


@pytest.mark.parametrize("ending", [".mp4", ".mov", ".mkv"])
@pytest.mark.parametrize(
    ("ticks", "time_base"),
    [
        ([0, 1, 5, 6, 20, 21], Fraction(1, 30)),
        ([90, 91, 92, 93, 95, 99], Fraction(1, 30)),
        ([0, 3003, 6003, 9004, 12007, 15015], Fraction(1, 90000)),
    ],
)
def test_times_are_kept(make_clip, tmp_path, ending, ticks, time_base):
    before, after = copied(make_clip(ticks=ticks, time_base=time_base), tmp_path / f"out{ending}")
    # Matroska's unit is a millisecond
    tolerance = 6e-4 if ending == ".mkv" else 1e-9
    np.testing.assert_allclose([f.time_s for f in after], [f.time_s for f in before], atol=tolerance)


@pytest.mark.parametrize("location", ["left", "center", "topleft"])
@pytest.mark.parametrize("layout", ["yuv420p", "yuv420p10le"])
@pytest.mark.parametrize("tags", [(1, 1, 13, 1), (6, 1, 6, 6), (9, 2, 18, 9), (2, 0, 2, 2)])
def test_colour_tags_depth_and_sites_are_kept(make_clip, tmp_path, location, layout, tags):
    names = ("matrix", "range", "transfer", "primaries")
    source = make_clip(
        layout=layout, tags=dict(zip(names, tags, strict=True)), options={"chroma_sample_location": location}
    )
    before, after = copied(source, tmp_path / "out.mp4", **FINEST)
    assert after[0].format == before[0].format
    with VideoReader(tmp_path / "out.mp4") as reader:
        assert reader.tags[2:] == tags[2:]
        assert tags[0] == 2 or reader.tags == tags
    for a, b in zip(before, after, strict=True):
        scale = 2 ** (a.format.bit_depth - 8)
        errors = [np.abs(p.astype(float) - q).mean() / scale for p, q in zip(a.planes, b.planes, strict=True)]
        assert max(errors) < 0.5


@pytest.mark.parametrize(
    "options",
    [
        {"layout": "yuv422p"}, {"layout": "yuv444p"}, {"codec": "ffv1", "layout": "bgr0", "name": "clip.mkv"},
        {"codec": "ffv1", "layout": "gray", "name": "clip.mkv"},
        {"codec": "ffv1", "layout": "gbrp12le", "name": "clip.mkv"},
        {"codec": "mjpeg", "layout": "yuvj422p", "name": "clip.avi"}, {"rotation": 90}, {"rotation": 270},
    ],
    ids=str,
)  # fmt: skip
def test_other_formats_become_420_of_the_same_light(make_clip, tmp_path, options):
    before, after = copied(make_clip(**options), tmp_path / "out.mp4", **FINEST)
    assert after[0].format.chroma_shift == (1, 1)
    assert after[0].format.bit_depth == min(before[0].format.bit_depth, 10)
    for a, b in zip(before, after, strict=True):
        difference = a.linear_rgb(chroma="bilinear") - b.linear_rgb(chroma="bilinear")
        # one level of 8 bits is 0.008 of full scale where the curve is steepest
        assert np.abs(difference.mean((0, 1))).max() < 0.002
        assert np.sqrt(np.mean(difference**2)) < 0.01


@pytest.mark.parametrize("size", [(65, 47), (64, 47), (65, 48)])
def test_odd_sizes_are_padded_by_the_edge(make_clip, tmp_path, size):
    source = make_clip("clip.mkv", codec="ffv1", layout="yuv420p", size=size)
    before, after = copied(source, tmp_path / "out.mp4", **FINEST)
    w, h = size
    assert after[0].size == (w + w % 2, h + h % 2)
    for a, b in zip(before, after, strict=True):
        inside = np.abs(b.planes[0][:h, :w].astype(int) - a.planes[0])
        assert inside.mean() < 0.6
        assert np.abs(b.planes[0][:, -1].astype(int) - b.planes[0][:, w - 1]).max() <= 4


@pytest.mark.parametrize(
    ("sound", "ending"), [("aac", ".mp4"), ("aac", ".mkv"), ("pcm_s16le", ".mkv"), ("flac", ".mp4")]
)
def test_sound_is_copied_packet_by_packet(make_clip, tmp_path, sound, ending):
    source, output = make_clip("clip.mkv", frames=30, sound=sound), tmp_path / f"out{ending}"
    copied(source, output)
    before, after = packets_of(source, "audio"), packets_of(output, "audio")
    spoken = [(t, data) for t, data in before if t >= 0]
    heard = [(t, data) for t, data in after if t >= 0]
    assert len(heard) > 5
    assert [data for _, data in heard] == [data for _, data in spoken[: len(heard)]]
    np.testing.assert_allclose([float(t) for t, _ in heard], [float(t) for t, _ in spoken[: len(heard)]], atol=1.1e-3)
    # to the end of the last picture, and not beyond
    assert len(spoken) - len(heard) <= 2


def test_sound_ends_with_the_last_frame_written(make_clip, tmp_path):
    source, output = make_clip("clip.mkv", frames=60, sound="pcm_s16le"), tmp_path / "out.mkv"
    with VideoReader(source) as reader, VideoWriter(output, reader) as writer:
        for frame in list(reader)[:15]:
            writer.write(frame)
    assert 0.4 < float(packets_of(output, "audio")[-1][0]) < 0.51


def test_sound_may_be_left_out(make_clip, tmp_path):
    copied(make_clip(sound="aac"), tmp_path / "out.mp4", audio=False)
    with av.open(str(tmp_path / "out.mp4")) as container:
        assert not container.streams.audio


def test_synthetic_frames_need_no_source(tmp_path):
    rng = np.random.default_rng(0)
    image = np.kron(rng.integers(40, 216, (3, 4, 3)), np.ones((16, 16, 1))).astype(np.uint8)
    with VideoWriter(tmp_path / "out.mp4", frame_rate=Fraction(30000, 1001), **FINEST) as writer:
        for i in range(5):
            writer.write(Frame.from_rgb(image, i, i * 1001 / 30000))
    with VideoReader(tmp_path / "out.mp4") as reader:
        frames = list(reader)
        assert reader.frame_rate == Fraction(30000, 1001)
        assert reader.tags == (5, 1, 13, 1)
    np.testing.assert_allclose([f.time_s for f in frames], np.arange(5) * 1001 / 30000, atol=1e-5)
    flat = np.s_[4::16, 4::16]
    np.testing.assert_allclose(frames[0].encoded_rgb()[flat] * 255, image[flat], atol=3.0)


@pytest.mark.parametrize("tune", ["zerolatency", "psnr"])
def test_a_frame_that_the_encoder_holds_back_is_not_touched_by_the_next(tmp_path, tune):
    levels = 20 + 5 * np.random.default_rng(4).permutation(40)
    with VideoWriter(tmp_path / "out.mp4", tune=tune, preset="fast", crf=4) as writer:
        for i, level in enumerate(levels):
            writer.write(Frame.from_rgb(np.full((32, 48, 3), level, np.uint8), i, i / 30))
    found = [255 * f.encoded_rgb().mean() for f in VideoReader(tmp_path / "out.mp4")]
    np.testing.assert_allclose(found, levels, atol=1.5)


@pytest.mark.parametrize("depth", [8, 10])
@pytest.mark.parametrize("size", [(64, 48), (64, 46), (63, 48)])
def test_where_planes_lie_in_memory_does_not_matter(tmp_path, size, depth):
    rng, (w, h) = np.random.default_rng(8), size
    format_ = PixelFormat("bt709", False, depth, chroma_shift=(1, 1), chroma_offset_px=chroma_offset_px("left", (1, 1)))
    shapes = [(h, w), *[format_.chroma_size(size)[::-1]] * 2]
    planes = tuple(rng.integers(60, 200, shape).astype(format_.dtype) for shape in shapes)
    crossed = np.concatenate([plane.reshape(-1) for plane in (planes[0], planes[2], planes[1])])
    starts = np.cumsum([0, planes[0].size, planes[1].size])
    parts = [
        crossed[start : start + plane.size].reshape(plane.shape) for start, plane in zip(starts, planes, strict=True)
    ]
    apart = Frame(0, 0.0, planes, format_)
    frames = {
        "apart": apart,
        "together": apart.composed(),
        "crossed": replace(apart, planes=(parts[0], parts[2], parts[1])),
    }
    for name, frame in frames.items():
        with VideoWriter(tmp_path / f"{name}.mp4") as writer:
            for i in range(3):
                writer.write(replace(frame, index=i, time_s=i / 30))
    found = [packets_of(tmp_path / f"{name}.mp4", "video") for name in frames]
    assert found[0] == found[1] == found[2]


def test_frames_that_share_a_time_are_kept_apart(tmp_path):
    with VideoWriter(tmp_path / "out.mp4") as writer:
        for i, time_s in enumerate([0.0, 0.1, 0.1, 0.05, 0.2]):
            writer.write(Frame.from_rgb(np.full((16, 16, 3), 40 * i, np.uint8), i, time_s))
    times = [f.time_s for f in VideoReader(tmp_path / "out.mp4")]
    assert len(times) == 5
    assert all(a < b for a, b in pairwise(times))


CRASH = """
import sys, time
from arlight.video.reader import VideoReader
from arlight.video.writer import VideoWriter
reader = VideoReader(sys.argv[1])
writer = VideoWriter(sys.argv[2], reader, preset="medium")
for frame in reader:
    writer.write(frame)
    if frame.index == 39:
        print("written", flush=True)
        time.sleep(60)
"""


@pytest.mark.parametrize("ending", [".mp4", ".mov", ".mkv"])
@pytest.mark.skipif(os.name != "posix", reason="needs a signal that cannot be caught")
def test_a_killed_program_leaves_what_it_wrote(make_clip, tmp_path, ending):
    source, output = make_clip("clip.mkv", frames=60, sound="aac"), tmp_path / f"out{ending}"
    command = [sys.executable, "-c", CRASH, str(source), str(output)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"written\n"
        process.send_signal(signal.SIGKILL)
    frames, before = list(VideoReader(output)), list(VideoReader(source))
    assert 38 <= len(frames) <= 40
    times = [f.time_s for f in before[: len(frames)]]
    np.testing.assert_allclose([f.time_s for f in frames], times, atol=6e-4)
    assert float(packets_of(output, "audio")[-1][0]) > 1.15


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
def test_an_interrupted_run_leaves_a_complete_file(make_clip, tmp_path, error):
    output = tmp_path / "out.mp4"

    def interrupted():
        with VideoReader(make_clip(frames=30)) as reader, VideoWriter(output, reader) as writer:
            for frame in reader:
                writer.write(frame)
                if frame.index == 12:
                    raise error

    with pytest.raises(error):
        interrupted()
    with VideoReader(output) as reader:
        assert reader.frame_count == len(list(reader)) == 13
        assert reader.damage is None


def test_nothing_is_replaced_before_the_first_frame(make_clip, tmp_path):
    output = tmp_path / "out.mp4"
    output.write_bytes(b"earlier")
    with VideoReader(make_clip()) as reader, VideoWriter(output, reader):
        pass
    assert output.read_bytes() == b"earlier"
    copied(make_clip(), output)
    assert len(list(VideoReader(output))) == 6


def test_the_input_is_never_the_output(make_clip, tmp_path):
    clip = make_clip()
    data = clip.read_bytes()
    (tmp_path / "link.mp4").symlink_to(clip)
    (tmp_path / "hard.mp4").hardlink_to(clip)
    with VideoReader(clip) as reader:
        for name in ("clip.mp4", "link.mp4", "hard.mp4"):
            with pytest.raises(OutputError, match=rf"{name}: is also the input"):
                VideoWriter(tmp_path / name, reader)
    assert clip.read_bytes() == data


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("out.avi", "ends in .mp4"),
        ("out", "ends in .mp4"),
        ("nowhere/out.mp4", "does not exist"),
        ("dir.mp4", "a folder"),
    ],
)
def test_outputs_that_cannot_be_are_refused_at_once(tmp_path, name, found):
    (tmp_path / "dir.mp4").mkdir()
    with pytest.raises(OutputError, match=found):
        VideoWriter(tmp_path / name)


def test_sound_that_does_not_fit_is_refused_before_anything_is_opened(make_clip, tmp_path):
    source, output = make_clip("clip.mkv", sound="pcm_s16le"), tmp_path / "out.mp4"
    with VideoReader(source) as reader:
        with pytest.raises(OutputError, match=r"pcm_s16le.*\.mkv"):
            VideoWriter(output, reader)
        VideoWriter(output, reader, audio=False)
    assert not output.exists()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")  # noqa: PTH110
def test_a_full_disk_is_reported_by_name(tmp_path):
    (tmp_path / "out.mp4").symlink_to("/dev/full")
    image = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)

    def fill():
        with VideoWriter(tmp_path / "out.mp4") as writer:
            for i in range(50):
                writer.write(Frame.from_rgb(image, i, i / 30))

    with pytest.raises(OutputError, match=r"out\.mp4.*space"):
        fill()


def test_frames_of_another_size_are_refused(tmp_path):
    with VideoWriter(tmp_path / "out.mp4") as writer:
        writer.write(Frame.from_rgb(np.zeros((16, 16, 3), np.uint8)))
        with pytest.raises(ValueError, match="expected frames of"):
            writer.write(Frame.from_rgb(np.zeros((16, 18, 3), np.uint8), 1, 0.1))


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (PixelFormat("bt2020", True, 12, (1, 1), (0.0, 0.0)), PixelFormat("bt2020", True, 10, (1, 1), (0.0, 0.0))),
        # a turned 4:2:0 picture may have sites that have no name
        (PixelFormat("bt709", False, 8, (1, 1), (1.0, 0.5)), PixelFormat("bt709", False, 8, (1, 1), (0.0, 0.5))),
        (PixelFormat("rgb", True, 16), PixelFormat("bt601", False, 10, (1, 1), (0.0, 0.5))),
        (PixelFormat("gray", True, 8), PixelFormat("bt601", True, 8, (1, 1), chroma_offset_px("left", (1, 1)))),
    ],
)  # fmt: skip
def test_the_encoded_format_keeps_what_it_can(source, expected):
    chroma = source.chroma_size((16, 8))[::-1]
    planes = tuple(np.zeros(s, source.dtype) for s in ((8, 16), chroma, chroma)[: source.plane_count])
    assert encoded_format(Frame(0, 0.0, planes, source)) == expected
