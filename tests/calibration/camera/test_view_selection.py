"""Views are chosen for being sharp and for differing."""

import cv2
import numpy as np

from arlight.calibration.camera.camera_fit import TargetView
from arlight.calibration.camera.view_selection import edge_sharpness, select_views

SIZE = (640, 480)
GRID = np.array([[x, y] for x in np.linspace(-60, 60, 4) for y in np.linspace(-45, 45, 4)])


def view_at(x, y, scale=2.0):
    return TargetView(f"{x} {y}", GRID, GRID * scale + [x, y])


def test_views_that_are_alike_count_once():
    views = [view_at(320 + 0.5 * k, 240) for k in range(6)] + [view_at(150, 240), view_at(480, 240)]
    chosen = select_views(views, [1.0] * len(views), SIZE, 30)
    assert chosen[-2:] == [6, 7]
    assert len(chosen) == 3


def test_the_most_different_come_first():
    views = [view_at(300 + 5 * k, 240) for k in range(20)]
    assert select_views(views, [1.0] * 20, SIZE, 3)[::2] == [0, 19]


def test_blurred_views_are_left_out():
    views = [view_at(100 + 60 * k, 240) for k in range(6)]
    assert 2 not in select_views(views, [1, 1, 0.3, 1.1, 0.9, 1], SIZE, 6)


def test_points_on_a_line_are_not_chosen():
    line = np.column_stack([np.linspace(-50, 50, 8), np.zeros(8)])
    assert select_views([TargetView("line", line, line + 200)], [1.0], SIZE, 5) == []


def test_sharpness_falls_with_blur_and_not_with_contrast():
    picture = np.kron(np.indices((12, 12)).sum(axis=0) % 2, np.ones((20, 20))) * 160 + 40
    points = np.array([[20.0, 20.0], [220.0, 220.0]])
    sharp, soft, pale = (
        edge_sharpness(image.astype(np.uint8), points)
        for image in (picture, cv2.GaussianBlur(picture, (0, 0), 3), picture / 2)
    )
    assert soft < 0.5 * sharp
    np.testing.assert_allclose(pale, sharp, rtol=0.02)
