"""Finding the sheet in frames, choosing views, measuring them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from arlight.calibration.layers.view_measurement import SeenSheet, ViewMeter, find_sheet, light_plane_points, varied
from arlight.camera import Pose
from arlight.tracking.pose import ProbePose
from arlight.video.frame import Frame


def seen_from(toward, distance_mm=300.0):
    """A view from a direction; its picture does not matter."""
    toward = np.asarray(toward, float) / np.linalg.norm(toward)
    side = np.cross([0.3, 1.0, 0.1], toward)
    side /= np.linalg.norm(side)
    rotation = np.stack([side, np.cross(-toward, side), -toward])
    pose = Pose(rotation, -rotation @ (distance_mm * toward))
    return SeenSheet(Frame.from_rgb(np.zeros((4, 4, 3), np.uint8)), ProbePose(pose, 0.1, "tracked", 0.6, 4))


@pytest.fixture(scope="module")
def hemisphere():
    """Views from 40 directions up to 65 degrees off the normal, most of them close together."""
    generator = np.random.default_rng(2)
    tilt = np.deg2rad(np.concatenate([generator.uniform(10, 12, 30), generator.uniform(0, 65, 10)]))
    azimuth = np.concatenate([generator.uniform(0.0, 0.2, 30), generator.uniform(0, 2 * np.pi, 10)])
    return [
        seen_from([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)]) for t, a in zip(tilt, azimuth, strict=True)
    ]


def test_the_sheet_is_found_in_every_frame_where_it_is(filmed_sheet):
    assert [seen.frame.index for seen in filmed_sheet.seen] == [frame.index for frame in filmed_sheet.frames]
    for seen, truth in zip(filmed_sheet.seen, filmed_sheet.truth, strict=True):
        # a hundredth of a pixel at half a metre
        away = seen.offset_mm - truth.pose.camera_centre_mm
        assert np.linalg.norm(away) < 1e-3 * np.linalg.norm(seen.offset_mm)


def test_frames_without_the_sheet_are_left_out(filmed_sheet):
    empty = Frame.from_rgb(np.full((480, 640, 3), 90, np.uint8), 1, 0.25)
    frames = [filmed_sheet.frames[0], empty, filmed_sheet.frames[1]]
    seen = find_sheet(frames, filmed_sheet.probe, filmed_sheet.camera, light=2)
    assert [view.frame for view in seen] == [frames[0], frames[2]]
    assert all(view.light == 2 for view in seen)
    assert find_sheet([], filmed_sheet.probe, filmed_sheet.camera) == []


def test_views_lie_on_the_light_plane_as_far_out_as_they_are_tilted(filmed_sheet):
    above, low, lower = (seen_from([x, 0.0, z]) for x, z in ((0.0, 1.0), (0.5, 1.0), (2.0, 1.0)))
    points = light_plane_points([above, low, lower], filmed_sheet.probe)
    np.testing.assert_allclose(points[0], 0.0, atol=1e-12)
    assert 0.0 < points[1, 0] < points[2, 0] < 0.5
    np.testing.assert_allclose(points[:, 1], 0.0, atol=1e-12)
    farther = seen_from([0.5, 0.0, 1.0], 900.0)
    np.testing.assert_allclose(light_plane_points([farther], filmed_sheet.probe)[0], points[1], atol=1e-12)


def test_few_views_are_all_taken(filmed_sheet, hemisphere):
    assert varied(hemisphere, filmed_sheet.probe, 40) == hemisphere
    assert varied([], filmed_sheet.probe, 5) == []


@pytest.mark.parametrize("count", [1, 2, 5, 12])
def test_chosen_views_are_some_of_them_in_order(filmed_sheet, hemisphere, count):
    chosen = varied(hemisphere, filmed_sheet.probe, count)
    place = [next(i for i, view in enumerate(hemisphere) if view is one) for one in chosen]
    assert len(place) == count
    assert place == sorted(set(place))


def test_chosen_views_differ_more_than_those_at_hand(filmed_sheet, hemisphere):
    def nearest(views):
        points = light_plane_points(views, filmed_sheet.probe)
        return min(np.linalg.norm(a - b) for a, b in itertools.combinations(points, 2))

    generator = np.random.default_rng(4)
    drawn = [nearest([hemisphere[i] for i in generator.choice(40, 8, replace=False)]) for _ in range(200)]
    assert nearest(varied(hemisphere, filmed_sheet.probe, 8)) > max(drawn)


def test_every_view_that_was_left_out_is_near_one_that_was_chosen(filmed_sheet, hemisphere):
    chosen = light_plane_points(varied(hemisphere, filmed_sheet.probe, 10), filmed_sheet.probe)
    between = min(np.linalg.norm(a - b) for a, b in itertools.combinations(chosen, 2))
    for point in light_plane_points(hemisphere, filmed_sheet.probe):
        assert np.linalg.norm(chosen - point, axis=1).min() <= between + 1e-12


def test_a_view_is_measured_by_itself(filmed_sheet, measured_views):
    meter = ViewMeter(filmed_sheet.probe, filmed_sheet.camera, filmed_sheet.assembly)
    meter.measure(filmed_sheet.seen[5])
    again = meter.measure(filmed_sheet.seen[2])
    np.testing.assert_array_equal(again.means.values, measured_views[2].means.values)
    assert again.blur_px == measured_views[2].blur_px


def test_measured_blur_is_the_lenss(measured_views):
    # 0.6 px; alignment and resampling of the sheet's raster add a little
    for view in measured_views:
        assert view.blur_px == pytest.approx(0.6, abs=0.12)
        assert view.means.valid.mean() > 0.9


def test_a_view_keeps_the_number_of_its_light(filmed_sheet):
    meter = ViewMeter(filmed_sheet.probe, filmed_sheet.camera, filmed_sheet.assembly)
    assert meter.measure(replace(filmed_sheet.seen[0], light=3)).light == 3
