"""`arlight run` as a user meets it: what it writes, what it refuses, how it ends."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import av
import numpy as np
import pytest
import trimesh

from arlight.camera import Camera
from arlight.probe.layout import design_probe
from arlight.probe.storage import load_probe, save_probe
from arlight.results.log import read_log
from arlight.video.frame import Frame
from arlight.video.reader import VideoReader
from arlight.video.writer import VideoWriter

FRAMES = 12
# the object is prepared in a fraction of a second, its looks do not matter here
QUICK = ("--directions", 48, "--shadow-texels", 16, "--supersampling", 1)


def frames_of(path: Path) -> list[Frame]:
    with VideoReader(path) as reader:
        return list(reader)


def copy_with_sidecars(footage: Path, folder: Path, name: str = "orbit.mp4") -> Path:
    folder.mkdir(exist_ok=True)
    for file in ("orbit.mp4", "probe.json", "camera.json"):
        shutil.copy(footage / file, folder / (name if file == "orbit.mp4" else file))
    return folder / name


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_a_clip_becomes_a_relit_clip_a_log_and_a_report(arlight, footage, tmp_path):
    done = arlight(
        "run",
        footage / "orbit.mp4",
        "--output",
        "relit.mp4",
        "--lighting",
        "log.jsonl",
        "--report",
        "report.html",
        *QUICK,
    )
    assert done.status == 0, done.errors
    assert sorted(files(tmp_path)) == ["log.jsonl", "relit.mp4", "report.html"]
    log = read_log(tmp_path / "log.jsonl")
    assert [record.frame for record in log.records] == list(range(FRAMES))
    assert all(record.status == "tracked" for record in log.records)
    assert log.header.source == str(footage / "orbit.mp4")
    original, relit = frames_of(footage / "orbit.mp4"), frames_of(tmp_path / "relit.mp4")
    assert [frame.time_s for frame in relit] == [frame.time_s for frame in original]
    # the object stands in the middle of the picture; the corners are only encoded again
    before, after = original[5].linear_rgb(), relit[5].linear_rgb()
    assert np.abs(after - before)[90:150, 130:190].mean() > 0.05
    assert np.abs(after - before)[:20, :20].mean() < 0.01
    assert "12" in done.output
    assert "100.0 % tracked" in done.output
    assert "frames/s" in done.output
    for name in ("relit.mp4", "log.jsonl", "report.html"):
        assert name in done.output


def test_lighting_only(arlight, footage, tmp_path):
    done = arlight("run", footage / "orbit.mp4", "--no-render")
    assert done.status == 0, done.errors
    assert sorted(files(tmp_path)) == ["orbit.jsonl"]
    assert len(read_log(tmp_path / "orbit.jsonl").records) == FRAMES


def test_the_log_alone_names_stages_with_their_time(arlight, footage, tmp_path):
    arlight("run", footage / "orbit.mp4", "--no-render")
    timings = read_log(tmp_path / "orbit.jsonl").records[-1].timings_ms
    assert "decode" in timings
    assert "encode" not in timings
    assert all(ms >= 0.0 for ms in timings.values())


def test_without_outputs_the_relit_clip_is_named_after_the_clip(arlight, footage, tmp_path):
    assert arlight("run", footage / "orbit.mp4", *QUICK).status == 0
    assert sorted(files(tmp_path)) == ["orbit-relit.mp4"]


def test_an_object_of_the_users(arlight, footage, tmp_path):
    mesh = tmp_path / "box.ply"
    trimesh.creation.box((1.0, 1.0, 1.0)).export(mesh)
    done = arlight("run", footage / "orbit.mp4", "--object", mesh, "--size-mm", 30, "--output", "relit.mp4", *QUICK)
    assert done.status == 0, done.errors
    assert len(frames_of(tmp_path / "relit.mp4")) == FRAMES


def test_a_clip_of_one_frame(arlight, footage, tmp_path):
    clip = copy_with_sidecars(footage, tmp_path / "one", "one.mp4")
    first = frames_of(clip)[0]
    with VideoWriter(clip, frame_rate=25) as writer:
        writer.write(first)
    done = arlight("run", clip, "--lighting", "log.jsonl", "--output", "relit.mp4", "--report", "report.html", *QUICK)
    assert done.status == 0, done.errors
    assert len(read_log(tmp_path / "log.jsonl").records) == 1
    assert len(frames_of(tmp_path / "relit.mp4")) == 1


@pytest.mark.parametrize("pixels", ["gray", "yuv420p10le", "yuv422p", "bgr0"])
def test_grey_deep_and_rgb_video(arlight, footage, tmp_path, pixels):
    clip = copy_with_sidecars(footage, tmp_path / "other", "other.mkv")
    with av.open(str(footage / "orbit.mp4")) as source, av.open(str(clip), "w") as target:
        stream = target.add_stream("ffv1", rate=25, width=320, height=240, pix_fmt=pixels)
        for picture in source.decode(video=0):
            target.mux(stream.encode(picture.reformat(format=pixels)))
        target.mux(stream.encode(None))
    done = arlight("run", clip, "--lighting", "log.jsonl", "--output", "relit.mkv", *QUICK)
    assert done.status == 0, done.errors
    log = read_log(tmp_path / "log.jsonl")
    assert [record.status for record in log.records] == ["tracked"] * FRAMES
    assert len(frames_of(tmp_path / "relit.mkv")) == FRAMES
    if pixels == "gray":
        light = log.records[-1].coefficients
        assert light is not None
        # a grey picture has grey light
        np.testing.assert_allclose(light[0, 0], light[0, 2], rtol=0.02)


def test_odd_sizes(arlight, footage, tmp_path):
    clip = copy_with_sidecars(footage, tmp_path / "odd", "odd.mkv")
    with VideoReader(footage / "orbit.mp4") as reader, VideoWriter(clip, frame_rate=25) as writer:
        for frame in reader:
            image = np.rint(255.0 * frame.encoded_rgb()).astype(np.uint8)
            writer.write(Frame.from_rgb(np.ascontiguousarray(image[:-1, :-1]), frame.index, frame.time_s))
    width, height = frames_of(clip)[0].size
    camera = Camera.load(clip.parent / "camera.json")
    Camera((width, height), camera.camera_matrix, camera.distortion).save(clip.parent / "camera.json")
    done = arlight("run", clip, "--output", "relit.mp4", *QUICK)
    assert done.status == 0, done.errors
    assert "100.0 % tracked" in done.output


REFUSED = {
    "a missing clip": (["none.mp4"], r"none\.mp4"),
    "a text file": (["notes.mp4"], r"notes\.mp4: cannot be read as a video"),
    "an empty file": (["empty.mp4"], r"empty\.mp4: is empty"),
    "a folder": (["folder"], r"folder: .*found a folder"),
    "a missing probe": (["clip.mp4", "--probe", "none.json"], r"none\.json"),
    "a probe that is none": (["clip.mp4", "--probe", "notes.mp4"], r"notes\.mp4"),
    "a missing camera": (["clip.mp4", "--camera", "none.json"], r"none\.json: cannot be read"),
    "a camera that is none": (["clip.mp4", "--camera", "probe.json"], r"probe\.json: .*camera_matrix|image_size"),
    "a camera of another size": (["clip.mp4", "--camera", "large.json"], r"large\.json: is for pictures of 640x480"),
    "an output that is the clip": (["clip.mp4", "--output", "clip.mp4"], r"clip\.mp4: --output would overwrite"),
    "a log that is the probe": (["clip.mp4", "--lighting", "probe.json"], r"probe\.json: --lighting would overwrite"),
    "a report that is the camera": (["clip.mp4", "--report", "camera.json"], r"camera\.json: --report would overwrite"),
    "an output that is the object": (["clip.mp4", "--object", "o.mp4", "--output", "o.mp4"], r"o\.mp4: --output would"),
    "a log that is the output": (["clip.mp4", "--output", "x.mp4", "--lighting", "x.mp4"], r"x\.mp4: .*same file"),
    "an output in no folder": (["clip.mp4", "--output", "no/x.mp4"], r"no\b.*does not exist|no: no such folder"),
    "a log in no folder": (["clip.mp4", "--lighting", "no/x.jsonl"], r"no: no such folder"),
    "an output that is a folder": (["clip.mp4", "--lighting", "folder"], r"folder: --lighting is a folder"),
    "an unknown container": (["clip.mp4", "--output", "x.avi"], r"x\.avi: expected a name that ends in"),
    "a missing object": (["clip.mp4", "--object", "none.glb"], r"none\.glb: no such file"),
    "an object without faces": (["clip.mp4", "--object", "points.ply"], r"points\.ply: .*"),
    "an object with NaN": (["clip.mp4", "--object", "nan.obj"], r"nan\.obj: .*finite|nan\.obj: .*NaN"),
    "an output that is not drawn": (["clip.mp4", "--no-render", "--output", "x.mp4"], r"x\.mp4: --no-render"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_refused_and_nothing_is_touched(arlight, footage, tmp_path, case):
    arguments, message = REFUSED[case]
    copy_with_sidecars(footage, tmp_path, "clip.mp4")
    (tmp_path / "folder").mkdir()
    (tmp_path / "notes.mp4").write_text("not a video")
    (tmp_path / "empty.mp4").touch()
    (tmp_path / "o.mp4").write_text("precious")
    (tmp_path / "clip-relit.mp4").write_text("precious")
    camera = Camera.load(tmp_path / "camera.json")
    Camera((640, 480), camera.camera_matrix, camera.distortion).save(tmp_path / "large.json")
    trimesh.PointCloud(np.eye(3)).export(tmp_path / "points.ply")
    (tmp_path / "nan.obj").write_text("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n")
    before = files(tmp_path)
    done = arlight("run", *arguments)
    assert done.status == 1
    assert files(tmp_path) == before
    assert "Traceback" not in done.errors
    assert any(line.startswith("arlight: ") for line in done.errors.splitlines())
    assert re.search(message, done.errors), done.errors


def test_a_clip_without_a_probe_asks_for_it(arlight, footage, tmp_path):
    shutil.copy(footage / "orbit.mp4", tmp_path / "clip.mp4")
    done = arlight("run", "clip.mp4")
    assert done.status == 1
    assert "--probe FILE" in done.errors


def test_a_clip_with_no_sheet_in_it_leaves_everything_as_it_was(arlight, empty_table, tmp_path):
    (tmp_path / "old.mp4").write_text("precious")
    done = arlight("run", empty_table, "--output", "old.mp4", "--lighting", "new.jsonl", "--report", "new.html", *QUICK)
    assert done.status == 1
    assert "table.mp4: no frame showed the sheet" in done.errors
    assert files(tmp_path) == {"old.mp4": b"precious"}


def test_a_probe_with_other_markers_is_named(arlight, footage, tmp_path):
    probe = load_probe(footage / "probe.json")
    other = replace(probe, markers=tuple(replace(marker, id=marker.id + 20) for marker in probe.markers))
    save_probe(other, tmp_path / "other.json")
    done = arlight("run", footage / "orbit.mp4", "--probe", "other.json", "--no-render")
    assert done.status == 1
    assert "other.json: does not match the footage" in done.errors
    assert "20-27" in done.errors
    assert sorted(files(tmp_path)) == ["other.json"]


def test_a_probe_with_the_markers_elsewhere_is_named(arlight, footage, tmp_path):
    save_probe(design_probe(3), tmp_path / "other.json")
    done = arlight("run", footage / "orbit.mp4", "--probe", "other.json", "--no-render")
    assert done.status == 1
    assert "other.json" in done.errors
    assert sorted(files(tmp_path)) == ["other.json"]


def test_a_probe_whose_markers_match_but_not_its_stripes_is_named(arlight, footage, tmp_path):
    probe = load_probe(footage / "probe.json")
    patterns = [block for block in probe.blocks if block.kind == "pattern"]
    phases = iter(np.random.default_rng(1).permutation([block.phase_deg for block in patterns]).tolist())
    blocks = tuple(replace(b, phase_deg=next(phases)) if b.kind == "pattern" else b for b in probe.blocks)
    save_probe(replace(probe, blocks=blocks), tmp_path / "other.json")
    (tmp_path / "old.mp4").write_text("precious")
    done = arlight("run", footage / "orbit.mp4", "--probe", "other.json", "--output", "old.mp4", *QUICK)
    assert done.status == 1
    assert "other.json: does not match the footage" in done.errors
    assert "no light explains" in done.errors
    assert sorted(files(tmp_path)) == ["old.mp4", "other.json"]
    assert (tmp_path / "old.mp4").read_text() == "precious"


@pytest.mark.parametrize("order", [0, 1])
def test_an_order_can_be_asked_for(arlight, footage, order):
    done = arlight(
        "run", footage / "orbit.mp4", "--order", order, "--output", "relit.mp4", "--lighting", "log.jsonl",
        "--report", "report.html", *QUICK,
    )  # fmt: skip
    assert done.status == 0, done.errors
    log = read_log("log.jsonl")
    assert len(log.header.frequencies) == {0: 1, 1: 3}[order]
    assert {record.order for record in log.records} == {order}
    assert {record.coefficients.shape for record in log.records} == {(len(log.header.frequencies), 3)}
    assert len(frames_of(Path("relit.mp4"))) == FRAMES


def test_an_order_beyond_the_sheet_s_is_refused(arlight, footage, tmp_path):
    done = arlight("run", footage / "orbit.mp4", "--order", 2, "--no-render")
    assert done.status == 1
    assert re.search(r"--order 2: .*probe\.json measures orders 0 to 1", done.errors)
    assert files(tmp_path) == {}


def test_an_existing_output_is_replaced_when_the_run_ends(arlight, footage, tmp_path):
    (tmp_path / "relit.mp4").write_text("old")
    assert arlight("run", footage / "orbit.mp4", "--output", "relit.mp4", *QUICK).status == 0
    assert sorted(files(tmp_path)) == ["relit.mp4"]
    assert len(frames_of(tmp_path / "relit.mp4")) == FRAMES


def start(folder: Path, *arguments: object) -> subprocess.Popen:
    command = [sys.executable, "-m", "arlight", *map(str, arguments)]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_lines(path: Path, count: int, process: subprocess.Popen) -> None:
    deadline = time.monotonic() + 120.0
    while not (path.exists() and path.read_bytes().count(b"\n") >= count):
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline, f"{path.name} did not grow to {count} lines"
        time.sleep(0.02)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_leaves_complete_files(long_clip, tmp_path, number):
    (tmp_path / "relit.mp4").write_text("old")
    process = start(tmp_path, "run", long_clip, "--output", "relit.mp4", "--lighting", "log.jsonl", *QUICK)
    wait_for_lines(tmp_path / "log.jsonl", 8, process)
    process.send_signal(number)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert "interrupted" in output
    log = read_log(tmp_path / "log.jsonl")
    assert not log.truncated
    assert 7 <= len(log.records) < 1500
    assert len(frames_of(tmp_path / "relit.mp4")) == len(log.records)
    assert sorted(files(tmp_path)) == ["log.jsonl", "relit.mp4"]


def test_a_killed_run_leaves_readable_files(long_clip, tmp_path):
    (tmp_path / "relit.mp4").write_text("old")
    process = start(tmp_path, "run", long_clip, "--output", "relit.mp4", "--lighting", "log.jsonl", *QUICK)
    wait_for_lines(tmp_path / "log.jsonl", 12, process)
    process.kill()
    process.communicate(timeout=60)
    log = read_log(tmp_path / "log.jsonl")
    assert len(log.records) >= 11
    assert (tmp_path / "relit.mp4").read_text() == "old"
    # a frame is encoded before it is logged, and the last one may still be in the container's hands
    assert len(frames_of(tmp_path / "relit.partial.mp4")) >= len(log.records) - 1


def test_a_damaged_clip_gives_what_it_holds_and_says_so(arlight, footage, long_clip, tmp_path):
    clip = copy_with_sidecars(footage, tmp_path / "cut", "cut.mp4")
    with VideoReader(long_clip) as reader, VideoWriter(clip, like=reader) as writer:
        for frame in reader:
            if frame.index == 40:
                break
            writer.write(frame)
    whole = clip.read_bytes()
    rng = np.random.default_rng(8)
    middle = len(whole) // 2
    # the index stays whole: it is the pictures that are spoilt
    clip.write_bytes(whole[:middle] + rng.bytes(6000) + whole[middle + 6000 :])
    (tmp_path / "old.jsonl").write_text("old")
    done = arlight("run", clip, "--no-render", "--lighting", "old.jsonl")
    assert done.status == 1
    assert "cut.mp4: " in done.errors
    assert "damaged" in done.errors
    assert (tmp_path / "old.jsonl").read_text() == "old"
    assert 5 <= len(read_log(tmp_path / "old.partial.jsonl").records) < 40


def test_without_opengl_frames_are_lit_all_the_same_and_who_asks_for_it_is_told_the_remedy(footage, tmp_path):
    environment = os.environ | {
        "LIBGL_DRIVERS_PATH": "/nonexistent", "__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent",
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
    }  # fmt: skip
    (tmp_path / "work").mkdir()
    command = [sys.executable, "-m", "arlight", "run", str(footage / "orbit.mp4")]
    run = partial(subprocess.run, cwd=tmp_path / "work", env=environment, capture_output=True, text=True, check=False)
    asked = run([*command, "--renderer", "moderngl"])
    assert asked.returncode == 1
    assert "libegl1 libgl1-mesa-dri" in asked.stderr
    assert "--renderer native" in asked.stderr
    assert files(tmp_path / "work") == {}
    lit = run([*command, "--output", "relit.mp4", "--lighting", "log.jsonl"])
    assert lit.returncode == 0, lit.stderr
    assert json.loads((tmp_path / "work" / "log.jsonl").read_text().splitlines()[1])["status"] == "tracked"
    assert len(frames_of(tmp_path / "work" / "relit.mp4")) == FRAMES
