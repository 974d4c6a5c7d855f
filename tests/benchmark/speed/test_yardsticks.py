"""The yardsticks find what they are compared on."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from arlight.benchmark.speed.clip_errors import pose_errors_px
from arlight.benchmark.speed.estimation_pass import single_threaded
from arlight.benchmark.speed.filming import film
from arlight.benchmark.speed.playback import load_clip
from arlight.benchmark.speed.relighters import Relighters
from arlight.benchmark.speed.whole_frames import convert_whole_frame, opengl_drawing
from arlight.benchmark.speed.workloads import Scene, Workload
from arlight.benchmark.speed.yardsticks import AprilTagPose, ArucoPose
from arlight.lighting_tracker import LightingTracker
from arlight.rendering.settings import RelightSettings

CLOSE_PX = 1.0


def test_aruco_finds_the_sheet_nearly_where_it_is(clip):
    yardstick = ArucoPose(clip.probe, clip.camera)
    poses = [yardstick.pose(frame.luma()) for frame in clip.frames]
    errors = pose_errors_px(poses, clip.truth, clip.camera, clip.probe)
    assert np.nanmax(errors) < CLOSE_PX


def test_a_picture_without_the_sheet_has_no_pose(clip):
    assert ArucoPose(clip.probe, clip.camera).pose(np.full((240, 320), 128, np.uint8)) is None


def test_markers_of_another_sheet_are_left_out(clip):
    stranger = replace(clip.probe, markers=tuple(replace(m, id=m.id + 20) for m in clip.probe.markers))
    assert ArucoPose(stranger, clip.camera).pose(clip.frames[0].luma()) is None


def test_april_tags_are_found_nearly_where_they_are(tmp_path):
    pytest.importorskip("pupil_apriltags")
    scene = Scene(order=1, size=(640, 480), path="still", sheet_width_px=420.0, april_tags=True)
    workload = Workload("tags", scene, half_cycle=1)
    film([workload], tmp_path, lambda _name: None)
    clip = load_clip(tmp_path, workload)
    poses = [AprilTagPose(clip.probe, clip.camera).pose(clip.frames[0].luma())]
    assert pose_errors_px(poses, clip.truth[:1], clip.camera, clip.probe)[0] < CLOSE_PX
    # and the sheet is still one that can be tracked
    assert LightingTracker(clip.probe, clip.camera).update(clip.frames[0]).pose.status == "tracked"


def test_opencvs_threads_are_given_back():
    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    try:
        with single_threaded():
            assert cv2.getNumThreads() == 1
        assert cv2.getNumThreads() == 2
        with pytest.raises(KeyError), single_threaded():
            raise KeyError
        assert cv2.getNumThreads() == 2
    finally:
        cv2.setNumThreads(before)


def test_the_whole_frame_shows_the_object_where_its_own_box_does(clip):
    relighters = Relighters()
    settings = RelightSettings(directions=64, shadow_texels=32, renderer="moderngl")
    relighter = relighters.of(clip.probe, clip.camera, settings)
    estimate = LightingTracker(clip.probe, clip.camera).update(clip.frames[0])
    drawing = opengl_drawing(relighter, clip.probe, clip.camera)
    try:
        whole = drawing.draw(clip.truth[0].pose, estimate.lighting).copy()
        drawn = relighter.draw_object(clip.truth[0].pose, estimate.lighting)
    finally:
        drawing.release()
        relighters.release()
    assert drawn is not None
    region, image = drawn
    assert whole.shape == (240, 320, 4)
    box = whole[region.y0 : region.y1, region.x0 : region.x1]
    assert np.abs(box - image).max() < 0.02
    assert whole[..., 3].sum() == pytest.approx(box[..., 3].sum())


def test_a_converted_frame_has_all_its_planes(clip):
    frame = clip.frames[0]
    back = convert_whole_frame(frame)
    assert back.shape == (360, 320)
    assert np.abs(back[:240].astype(int) - frame.planes[0]).mean() < 3.0
