import wave
from dataclasses import replace
from fractions import Fraction

import av
import numpy as np
import pytest

from arlight.errors import VideoError
from arlight.video.reader import VideoReader


def frames_of(path):
    with VideoReader(path) as reader:
        return list(reader), reader.damage


AWKWARD = {
    "plain": {},
    "variable rate": {"ticks": [0, 1, 5, 6, 20, 21]},
    "does not start at 0": {"ticks": [90, 91, 92, 93, 94, 95]},
    "fine unit of time": {"ticks": [0, 3003, 6003, 9004, 12007, 15015], "time_base": Fraction(1, 90000)},
    "one frame": {"frames": 1},
    "reordered": {"options": {"bf": "3", "g": "6"}},
    "10 bit": {"layout": "yuv420p10le"},
    "422": {"layout": "yuv422p"},
    "444": {"layout": "yuv444p"},
    "grey": {"layout": "gray", "codec": "ffv1", "name": "clip.mkv"},
    "grey h264": {"layout": "gray"},
    "rgb": {"layout": "bgr0", "codec": "ffv1", "name": "clip.mkv"},
    "16 bit rgb": {"layout": "rgb48le", "codec": "ffv1", "name": "clip.mkv"},
    "alpha": {"layout": "rgba", "codec": "png", "name": "clip.mov"},
    "packed": {"layout": "yuyv422", "codec": "rawvideo", "name": "clip.avi"},
    "odd size": {"layout": "yuv444p", "size": (65, 47)},
    "odd 420": {"codec": "ffv1", "size": (65, 47), "name": "clip.mkv"},
    "motion jpeg": {"codec": "mjpeg", "layout": "yuvj420p", "name": "clip.avi"},
    "old": {"codec": "mpeg4", "name": "clip.avi"},
    "transport stream": {"codec": "mpeg2video", "name": "clip.ts"},
    "with sound": {"sound": "aac"},
    "full range": {"tags": {"matrix": 1, "range": 2, "transfer": 13, "primaries": 1}},
    "601": {"tags": {"matrix": 6, "range": 1, "transfer": 6, "primaries": 6}},
}


@pytest.mark.parametrize("kind", AWKWARD)
def test_awkward_videos_are_read_whole(make_clip, kind):
    options = AWKWARD[kind]
    frames, damage = frames_of(make_clip(**options))
    assert damage is None
    assert [f.index for f in frames] == list(range(options.get("frames", 6)))
    assert {f.size for f in frames} == {options.get("size", (64, 48))}
    times = np.array([f.time_s for f in frames])
    assert np.all(np.diff(times) > 0)
    if ".ts" not in options.get("name", ""):
        unit = options.get("time_base", Fraction(1, 30))
        expected = [float(t * unit) for t in options.get("ticks", range(len(frames)))]
        # Matroska rounds to milliseconds
        np.testing.assert_allclose(times, expected, atol=6e-4 if ".mkv" in options.get("name", "") else 1e-9)
    assert all(0.2 < f.linear_rgb().mean() < 0.3 for f in frames)


@pytest.mark.parametrize("layout", ["yuv420p", "yuv422p", "yuv444p", "yuv420p10le"])
@pytest.mark.parametrize("number", [1, 5, 9])
@pytest.mark.parametrize("full", [False, True])
def test_colours_agree_with_another_library(make_clip, layout, number, full):
    tags = {"matrix": number, "range": 2 if full else 1, "transfer": 13, "primaries": 1}
    clip = make_clip("clip.mkv", codec="ffv1", layout=layout, tags=tags)
    frame = frames_of(clip)[0][0]
    with av.open(str(clip)) as container:
        # in two steps at 16 bits, because that library's direct conversion rounds at 8 bits on the way
        fine = next(container.decode(video=0)).reformat(format="yuv444p16le", interpolation="BILINEAR")
        image = fine.reformat(format="rgb48le", src_colorspace=number, src_color_range=2 if full else 1).to_ndarray()
    # it takes chroma to lie in the centre, whatever the stream says
    offset = tuple(0.5 if s else 0.0 for s in frame.format.chroma_shift)
    frame = replace(frame, format=replace(frame.format, chroma_offset_px=offset))
    # and widens codes to 16 bits by a shift, which is exact at limited range only
    white, tolerance = (65535, 0.8) if full else (65280, 0.05)
    difference = frame.encoded_rgb(chroma="bilinear") * 255 - image / white * 255
    # a wrong matrix or range is off by more than 5 levels
    assert np.abs(difference).max() < tolerance


@pytest.mark.parametrize("location", ["left", "center", "topleft", "bottomleft"])
def test_chroma_sites_are_read_from_the_stream(make_clip, location):
    with VideoReader(make_clip(options={"chroma_sample_location": location})) as reader:
        assert reader.format.chroma_offset_px == {
            "left": (0, 0.5), "center": (0.5, 0.5), "topleft": (0, 0), "bottomleft": (0, 1),
        }[location]  # fmt: skip


@pytest.mark.parametrize("rotation", [90, 180, 270])
@pytest.mark.parametrize("size", [(64, 48), (50, 34)])
def test_phone_rotation_is_applied(make_clip, rotation, size):
    upright, _ = frames_of(make_clip(size=size))
    with VideoReader(make_clip("turned.mp4", size=size, rotation=rotation)) as reader:
        turned = next(iter(reader))
        assert turned.size == reader.size == (size if rotation == 180 else size[::-1])
    with av.open(str(make_clip("turned.mp4", size=size, rotation=rotation))) as container:
        angle = next(container.decode(video=0)).rotation
    assert angle % 360 == rotation
    expected = np.rot90(upright[0].linear_rgb(chroma="bilinear"), rotation // 90)
    np.testing.assert_allclose(turned.linear_rgb(chroma="bilinear"), expected, atol=1e-5)


def test_a_reader_may_be_read_twice_and_left_early(make_clip):
    with VideoReader(make_clip()) as reader:
        assert next(iter(reader)).index == 0
        assert [f.index for f in reader] == [f.index for f in reader] == list(range(6))
        assert (reader.frame_rate, reader.frame_count, reader.size) == (30, 6, (64, 48))


def test_every_pass_gives_the_same_frames_also_after_closing(make_clip):
    with VideoReader(make_clip(options={"bf": "2"})) as reader:
        passes = [list(reader), list(reader)]
    passes.append(list(reader))
    for frames in passes[1:]:
        for a, b in zip(passes[0], frames, strict=True):
            assert (a.index, a.time_s) == (b.index, b.time_s)
            assert all(np.array_equal(p, q) for p, q in zip(a.planes, b.planes, strict=True))


@pytest.mark.parametrize("earlier_passes", [0, 1])
def test_a_pass_goes_on_when_the_reader_is_closed(make_clip, earlier_passes):
    with VideoReader(make_clip(frames=30, sound="aac")) as reader:
        for _ in range(earlier_passes):
            list(reader)
        frames = iter(reader)
        next(frames)
    assert [frame.index for frame in frames] == list(range(1, 30))
    assert (reader.frame_rate, reader.time_base.denominator > 0, reader.frame_count) == (30, True, 30)
    assert (reader.pixel_aspect, reader.audio_codecs) == (None, ["aac"])


def test_frames_outlive_the_reader(make_clip):
    clip = make_clip(frames=30)
    kept, _ = frames_of(clip)
    again, _ = frames_of(clip)
    assert all(np.array_equal(a.planes[0], b.planes[0]) for a, b in zip(kept, again, strict=True))


def test_a_file_that_is_cut_off_yields_what_is_there_and_says_so(make_clip):
    whole = make_clip("whole.mkv", frames=60, options={"g": "10"})
    data = whole.read_bytes()
    cut = whole.with_name("cut.mkv")
    cut.write_bytes(data[: len(data) * 6 // 10])
    frames, damage = frames_of(cut)
    assert 20 < len(frames) < 50
    assert "cut.mkv: ends at" in damage
    first, _ = frames_of(whole)
    assert all(np.array_equal(a.planes[0], b.planes[0]) for a, b in zip(frames[:-1], first, strict=False))


@pytest.mark.parametrize("name", ["clip.mp4", "clip.mkv"])
def test_damaged_pictures_are_left_out_and_reported(make_clip, name):
    clip = make_clip(name, size=(320, 240), frames=60, options={"g": "12"})
    whole, _ = frames_of(clip)
    data = bytearray(clip.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 2000] = bytes(2000)
    clip.write_bytes(data)
    frames, damage = frames_of(clip)
    assert 40 < len(frames) < 60
    assert "damaged pictures" in damage
    by_time = {f.time_s: f.planes[0] for f in whole}
    assert {f.time_s for f in frames} < set(by_time)


def broken_files(folder):
    (folder / "empty.mp4").touch()
    (folder / "text.mp4").write_text("no video\n" * 100)
    with wave.open(str(folder / "sound.wav"), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes(bytes(8000))
    (folder / "folder.mp4").mkdir()


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("missing.mp4", "nothing there"), ("empty.mp4", "0 bytes"), ("text.mp4", "cannot be read"),
        ("sound.wav", "no video stream"), ("folder.mp4", "a folder"),
    ],
)  # fmt: skip
def test_what_is_no_video_is_refused_by_name(tmp_path, name, found):
    broken_files(tmp_path)
    with pytest.raises(VideoError, match=rf"{name}.*{found}"):
        VideoReader(tmp_path / name)


def test_a_file_cut_before_its_index_is_refused(make_clip):
    clip = make_clip()
    clip.write_bytes(clip.read_bytes()[:400])
    with pytest.raises(VideoError, match=r"clip\.mp4.*cut off"):
        VideoReader(clip)


def test_interlaced_video_is_refused_with_the_remedy(make_clip):
    clip = make_clip("clip.ts", codec="mpeg2video", options={"flags": "+ildct+ilme", "field_order": "tt"})
    with pytest.raises(VideoError, match=r"interlaced.*bwdif"):
        VideoReader(clip)
