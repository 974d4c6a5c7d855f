import dataclasses

import cv2
import numpy as np
import pytest

from arlight.camera import Pose
from arlight.color import encoded_from_linear, linear_from_encoded
from arlight.tracking.alignment import SAMPLING_VARIANCE_PX2, FiducialAlignment
from arlight.tracking.alignment_kernels import Picture

TABLE = linear_from_encoded(np.arange(256) / 255.0)
BLUR_PX = 0.75


def whole(luma: np.ndarray) -> Picture:
    return Picture(luma, TABLE)


def moved(pose: Pose, camera, shift_px, turn_deg: float = 0.0) -> Pose:
    """The pose shifted in the picture and turned in the image plane about the sheet's origin."""
    depth = pose.translation[2]
    shift = np.array([*shift_px, 0.0]) * depth / camera.camera_matrix[0, 0]
    turn = Pose.from_rvec([0, 0, np.radians(turn_deg)], np.zeros(3)).rotation
    return Pose(turn @ pose.rotation, pose.translation + shift)


@pytest.mark.parametrize("lens", ["camera", "bent_camera"])
@pytest.mark.parametrize(("tilt", "distance"), [(0.0, 330), (35.0, 300), (60.0, 330), (75.0, 330)])
def test_it_finds_the_pose(sheet, look, photograph, pose_error_px, request, lens, tilt, distance) -> None:
    camera = request.getfixturevalue(lens)
    truth = look(tilt, 40 + tilt, distance, 25)
    found = FiducialAlignment(sheet, camera).align(
        whole(photograph(camera, truth)), moved(truth, camera, (1.5, -1.0), 0.3), BLUR_PX, 2
    )
    assert found is not None
    assert found.accepted
    error, offset = pose_error_px(camera, found.pose, truth)
    assert error < 0.04
    assert np.max(np.abs(offset)) < 0.02
    assert found.residual_rms_px < 0.1
    np.testing.assert_allclose(found.pose.rotation @ found.pose.rotation.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize(("reach_px", "coarsest"), [(1.0, 1), (4.0, 2), (6.0, 4), (9.0, 8)])
def test_the_reach_of_its_levels(sheet, camera, look, photograph, pose_error_px, reach_px, coarsest) -> None:
    truth = look(30, 100, 300)
    picture, alignment = whole(photograph(camera, truth)), FiducialAlignment(sheet, camera)
    for angle in np.radians([0, 72, 144, 216, 288]):
        start = moved(truth, camera, reach_px * np.array([np.cos(angle), np.sin(angle)]))
        found = alignment.align(picture, start, BLUR_PX, coarsest)
        assert found is not None
        assert pose_error_px(camera, found.pose, truth)[0] < 0.04


def test_brightness_contrast_and_shading_do_not_move_it(sheet, camera, look, photograph, pose_error_px) -> None:
    truth = look(40, 250, 300)
    alignment = FiducialAlignment(sheet, camera)
    shade = {
        "plain": None,
        "dim": lambda x, y: np.full_like(x + y, 0.15),
        "sloped": lambda x, y: 0.75 + 0.003 * x - 0.0015 * y,
    }
    poses = {}
    for name, light in shade.items():
        picture = photograph(camera, truth, noise=0.0, light=light, across=4)
        found = alignment.align(whole(picture), truth, BLUR_PX, 1)
        poses[name] = found.pose
    hazy = np.round(encoded_from_linear(0.2 + 0.7 * TABLE[photograph(camera, truth, noise=0.0, across=4)]) * 255)
    poses["hazy"] = alignment.align(whole(hazy.astype(np.uint8)), truth, BLUR_PX, 1).pose
    for name in ("dim", "sloped", "hazy"):
        assert pose_error_px(camera, poses[name], poses["plain"])[0] < 0.012, name


def test_turning_the_sheet_s_own_axes_turns_the_pose(sheet, camera, look, photograph) -> None:
    truth = look(45, 10, 300)
    picture = whole(photograph(camera, truth))
    markers = tuple(
        dataclasses.replace(m, corners_mm=tuple((-y, x) for x, y in m.corners_mm)) for m in sheet.markers[::-1]
    )
    turned = dataclasses.replace(sheet, markers=markers)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    plain = FiducialAlignment(sheet, camera).align(picture, truth, BLUR_PX, 1)
    start = Pose(truth.rotation @ quarter.T, truth.translation)
    other = FiducialAlignment(turned, camera).align(picture, start, BLUR_PX, 1)
    np.testing.assert_allclose(other.pose.rotation @ quarter, plain.pose.rotation, atol=1e-7)
    np.testing.assert_allclose(other.pose.translation, plain.pose.translation, atol=1e-5)
    np.testing.assert_allclose(other.correlation[::-1], plain.correlation, atol=1e-7)
    assert other.blur_px == pytest.approx(plain.blur_px, abs=1e-7)


def test_only_what_is_around_the_markers_matters(sheet, camera, look, photograph) -> None:
    truth = look(30, 10, 420)
    luma = photograph(camera, truth)
    pixels = camera.project(truth, sheet.outline_mm)
    (x0, y0), (x1, y1) = np.floor(pixels.min(axis=0)).astype(int), np.ceil(pixels.max(axis=0)).astype(int)
    scribbled = np.random.default_rng(3).integers(0, 256, luma.shape, dtype=np.uint8)
    scribbled[y0:y1, x0:x1] = luma[y0:y1, x0:x1]
    alignment = FiducialAlignment(sheet, camera)
    a, b = (alignment.align(whole(picture), truth, BLUR_PX, 1) for picture in (luma, scribbled))
    np.testing.assert_array_equal(a.pose.translation, b.pose.translation)


def test_a_plane_is_read_however_it_lies_in_memory(sheet, camera, look, photograph) -> None:
    truth = look(30, 10, 420)
    luma = photograph(camera, truth)
    padded = np.pad(luma, ((0, 0), (0, 24)), constant_values=255)[:, : luma.shape[1]]
    columns, upward = np.repeat(luma, 2, axis=1)[:, ::2], np.ascontiguousarray(luma[::-1])[::-1]
    alignment = FiducialAlignment(sheet, camera)
    found = [alignment.align(whole(picture), truth, BLUR_PX, 4) for picture in (luma, padded, columns, upward)]
    for other in found[1:]:
        np.testing.assert_array_equal(other.pose.rotation, found[0].pose.rotation)
        np.testing.assert_array_equal(other.pose.translation, found[0].pose.translation)


def test_deeper_codes_of_the_same_light_give_the_same_pose(sheet, camera, look, photograph) -> None:
    truth = look(30, 10, 420)
    luma = photograph(camera, truth)
    deep = Picture(luma.astype(np.uint16) * 4 + 3, np.repeat(TABLE, 4))
    np.testing.assert_array_equal(deep.eight_bits(), luma)
    for coarsest in (1, 4):
        # an alignment of its own: templates that a coarser level drew are kept
        a, b = (FiducialAlignment(sheet, camera).align(p, truth, BLUR_PX, coarsest) for p in (whole(luma), deep))
        # the same arithmetic, though the compiler may round it in another order
        np.testing.assert_allclose(a.pose.translation, b.pose.translation, atol=1e-6)


def test_covered_markers_are_left_out(sheet, camera, look, photograph, pose_error_px) -> None:
    truth = look(30, 80, 300)
    covered = (0, 3, 6)
    corners = np.array([sheet.markers[k].corners_mm for k in covered]).reshape(-1, 2)
    boxes = camera.project(truth, np.column_stack([corners, np.zeros(12)])).reshape(3, 4, 2)

    def hand(linear: np.ndarray) -> np.ndarray:
        for box in boxes:
            (x0, y0), (x1, y1) = np.floor(box.min(axis=0)).astype(int), np.ceil(box.max(axis=0)).astype(int)
            linear[y0 : y1 + 1, x0 + 6 : x1 + 1] = np.linspace(0.1, 0.5, y1 + 1 - y0)[:, None]
        return linear

    picture = whole(photograph(camera, truth, cover=hand))
    found = FiducialAlignment(sheet, camera).align(picture, moved(truth, camera, (1, 1)), BLUR_PX, 2)
    assert sorted(np.flatnonzero(~found.used)) == list(covered)
    assert pose_error_px(camera, found.pose, truth)[0] < 0.05


@pytest.mark.parametrize("blur_px", [0.45, 0.8, 1.4])
def test_it_measures_the_blur(sheet, camera, look, photograph, blur_px) -> None:
    truth = look(20, 80, 290)
    picture, alignment = whole(photograph(camera, truth, blur_px=blur_px)), FiducialAlignment(sheet, camera)
    estimate = 0.9
    for _ in range(6):
        estimate = alignment.align(picture, truth, estimate, 1).blur_px
    kernel = cv2.getGaussianKernel(9, blur_px).ravel()
    truth_px = np.sqrt(np.sum(kernel * np.arange(-4, 5) ** 2))
    assert np.sqrt(estimate**2 - SAMPLING_VARIANCE_PX2) == pytest.approx(truth_px, abs=0.08)


def test_the_stated_deviation_is_that_of_repeated_pictures(sheet, camera, look, photograph) -> None:
    truth = look(35, 80, 330)
    clean = TABLE[photograph(camera, truth, noise=0.0)]
    alignment, rng = FiducialAlignment(sheet, camera), np.random.default_rng(5)
    found = []
    for _ in range(16):
        noisy = np.round(encoded_from_linear(clean + 0.06 * rng.normal(size=clean.shape)) * 255).astype(np.uint8)
        found.append(alignment.align(whole(noisy), truth, BLUR_PX, 1))
    mean = Pose(np.mean([f.pose.rotation for f in found], axis=0), np.mean([f.pose.translation for f in found], axis=0))
    outline = sheet.outline_mm
    spread = [np.sum((camera.project(f.pose, outline) - camera.project(mean, outline)) ** 2, axis=1) for f in found]
    measured, stated = np.sqrt(np.mean(spread) * 16 / 15), np.mean([f.stddev_px for f in found])
    # Samples share pixels, so they are not independent; 16 repetitions leave 10 %.
    assert 0.5 < stated / measured < 1.5
    # What each marker still asks for by itself comes from the same noise, per marker instead of for all together.
    assert measured < np.mean([f.residual_rms_px for f in found]) < 6 * measured


def test_one_marker_is_less_certain_than_eight(sheet, camera, look, photograph) -> None:
    truth = look(35, 80, 330)
    picture = whole(photograph(camera, truth))
    alone = dataclasses.replace(sheet, markers=sheet.markers[2:3])
    one = FiducialAlignment(alone, camera).align(picture, truth, BLUR_PX, 1)
    all_ = FiducialAlignment(sheet, camera).align(picture, truth, BLUR_PX, 1)
    assert one.stddev_px > 5 * all_.stddev_px


@pytest.mark.parametrize("level", [0, 128, 255])
def test_a_flat_picture_holds_no_sheet(sheet, camera, look, level) -> None:
    assert (
        FiducialAlignment(sheet, camera).align(whole(np.full((480, 640), level, np.uint8)), look(20, 0, 300), 0.8, 4)
        is None
    )


@pytest.mark.parametrize(
    "pose",
    [
        Pose(np.eye(3), np.array([0.0, 0, 300])),
        Pose(np.diag([1.0, -1, -1]), np.array([5000.0, 0, 300])),
        Pose(np.diag([1.0, -1, -1]), np.array([np.nan, 0, 300])),
        Pose(np.diag([1.0, -1, -1]), np.array([0, 0, -300.0])),
    ],
)
@pytest.mark.parametrize("coarsest", [1, 8])
def test_no_alignment_for_a_sheet_out_of_view(sheet, camera, look, photograph, pose, coarsest) -> None:
    picture = whole(photograph(camera, look(20, 0, 300), across=3))
    assert FiducialAlignment(sheet, camera).align(picture, pose, BLUR_PX, coarsest) is None
