"""Finding a ball in a picture: circles by Hough, then its contour to a fraction of a pixel, as a cone of rays."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from arlight.calibration.ball.ball_edges import CONTOUR_POINTS, Edges, find_edges
from arlight.calibration.ball.ball_outline import BallError, BallOutline, project_rays
from arlight.camera import Camera

Array = NDArray[np.float64]
Picture = NDArray[np.float32]

_SEARCH_WIDTH_PX = 640
_SMALLEST_RADIUS_PX = 12.0
_LEAST_CONTOUR = 0.6
"""Share of the contour that must show an edge; circles that are no ball reach about 0.3."""
_REACH, _FINE_REACH = 0.22, 0.05
"""How far from a guess edges are looked for, relative to the radius, at first and at last."""
_INLIER_PX = 1.0
_TIGHT_PX = 0.4
_TRIALS = 600
_LEAST_SUPPORT = 0.4
_SMOOTHING_PX = 0.7
_CANDIDATES = 40
_HOUGH_PASSES = ((0.8, 150.0), (0.6, 60.0), (0.5, 30.0))
"""How round a circle must be and how strong its edges; later passes see fainter ones."""
_NEARLY = 0.1
_AS_GOOD = 0.85
"""A larger circle with this share of the best one's contour is preferred: a ball mirrors the horizon as a ring."""


@dataclass(frozen=True, slots=True)
class FoundBall:
    """A ball's outline, and how much of it was seen."""

    outline: BallOutline
    """The cone of rays that touch it."""
    contour_share: float
    """Share of the contour where the picture has an edge within a pixel, 0 to 1."""
    residual_px: float
    """Rms distance of those edges from the contour [px]; nan where there are none."""


def contrast_picture(radiance: NDArray[np.float32]) -> Picture:
    """(h, w) logarithm of the luminance, smoothed a little, 0 at the darkest and 1 at the brightest per cent."""
    luminance = radiance @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    positive = luminance[luminance > 0.0]
    floor = float(np.percentile(positive, 5.0)) * 0.2 if positive.size else 1.0
    logarithm = np.log(np.maximum(luminance, 0.0) + floor)
    low, high = np.percentile(logarithm, [1.0, 99.0])
    scaled = np.clip((logarithm - low) / max(high - low, 1e-6), -0.2, 1.2).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(scaled, (0, 0), _SMOOTHING_PX), np.float32)


def find_ball(radiance: NDArray[np.float32], camera: Camera) -> FoundBall:
    """The ball in a picture.

    1. Circles by Hough's transform, in a reduced picture of the logarithm of the light.
    2. Each one's contour is refined as in `refine_outline`.
    3. Of those with an edge nearly all round the largest is taken: inside a mirrored ball there are rings, too.

    Args:
        radiance: (h, w, 3) linear.
        camera: that took the picture.

    Raises:
        BallError: there is none.
    """
    picture = contrast_picture(radiance)
    found = [refine_outline(picture, camera, start) for start in _candidates(picture, camera)]
    found = [ball for ball in found if _inside(camera, ball.outline) and ball.contour_share >= _LEAST_CONTOUR]
    if not found:
        raise BallError(
            "no ball was found in the picture; it must be wholly in it, sharp and at least "
            f"{2 * _SMALLEST_RADIUS_PX:.0f} pixels wide, against a background of another brightness; "
            "or say where it is: --circle X Y RADIUS [px]"
        )
    best = max(ball.contour_share for ball in found)
    return max(
        (ball for ball in found if ball.contour_share >= _AS_GOOD * best), key=lambda ball: ball.outline.half_angle_rad
    )


def ball_at(
    radiance: NDArray[np.float32], camera: Camera, center_px: tuple[float, float], radius_px: float
) -> FoundBall:
    """The ball at a circle that is known: its contour is refined where the picture shows it, else taken as given.

    Raises:
        BallError: the circle leaves the picture, or is too small.
    """
    width, height = camera.image_size
    if not radius_px >= _SMALLEST_RADIUS_PX:
        raise BallError(f"the circle's radius must be at least {_SMALLEST_RADIUS_PX:g} pixels, found {radius_px:g}")
    x, y = center_px
    if not (radius_px <= x <= width - 1 - radius_px and radius_px <= y <= height - 1 - radius_px):
        raise BallError(
            f"the circle at ({x:g}, {y:g}) with radius {radius_px:g} leaves the picture of {width}x{height} pixels; "
            "the whole ball must be in it: check --circle X Y RADIUS [px]"
        )
    given = BallOutline.through_circle(camera, center_px, radius_px)
    found = refine_outline(contrast_picture(radiance), camera, given)
    center, radius = found.outline.circle_px(camera)
    near = np.hypot(*(center - center_px)) < _REACH * radius_px and abs(radius - radius_px) < _REACH * radius_px
    if near and found.contour_share >= _LEAST_CONTOUR:
        return found
    return FoundBall(given, 0.0, float("nan"))


def refine_outline(picture: Picture, camera: Camera, start: BallOutline) -> FoundBall:
    """Fit the cone to edges near a first guess.

    Lamps and the horizon that the ball mirrors are stronger edges than its contour, so every edge counts the same: the
    cone that meets an edge in the most directions is looked for, and then fitted to the edges nearest to it.

    Args:
        picture: (h, w), from `contrast_picture`.
        camera: that took it.
        start: right to a fifth of its radius.
    """
    nothing = FoundBall(start, 0.0, float("nan"))
    if not _is_sensible(camera, start):
        return nothing
    edges = find_edges(picture, camera, start, _REACH)
    outline = _most_supported(edges, start, _REACH, 1.5 * _INLIER_PX)
    for _ in range(2):
        if outline is None or not _is_sensible(camera, outline):
            return nothing
        edges = find_edges(picture, camera, outline, _FINE_REACH)
        # a dark shadow at the ball's foot pulls edges aside there: the arc that agrees best decides
        outline = _most_supported(edges, outline, _FINE_REACH, _TIGHT_PX)
        if outline is not None:
            outline = _fitted(edges, outline)
    if outline is None:
        return nothing
    away = _offsets_px(edges, outline)
    nearest = _nearest(edges, np.abs(away))
    inlier = nearest[nearest < _INLIER_PX]
    residual = float(np.sqrt(np.mean(inlier**2))) if inlier.size else float("nan")
    return FoundBall(outline, inlier.size / CONTOUR_POINTS, residual)


def _is_sensible(camera: Camera, outline: BallOutline) -> bool:
    if not 0.0 < outline.half_angle_rad < 1.2 or outline.axis[2] < 0.2:
        return False
    return _SMALLEST_RADIUS_PX / 2 <= outline.circle_px(camera)[1] < max(camera.image_size)


def _most_supported(edges: Edges, start: BallOutline, reach: float, tolerance_px: float) -> BallOutline | None:
    """The cone through three edges that meets an edge in the most directions, not too far from the first guess."""
    count = len(edges.rays)
    if np.unique(edges.direction).size < CONTOUR_POINTS // 4:
        return None
    generator = np.random.default_rng(0)
    triples = edges.rays[generator.integers(0, count, (_TRIALS, 3))]
    scaled, valid = _cones(triples)
    limit = 2.0 * reach * start.half_angle_rad
    half_angles = np.arccos(np.clip(1.0 / np.linalg.norm(scaled, axis=1), -1.0, 1.0))
    cosine = scaled @ start.axis / np.linalg.norm(scaled, axis=1)
    valid &= (np.abs(half_angles - start.half_angle_rad) < limit) & (np.arccos(np.clip(cosine, -1.0, 1.0)) < limit)
    if not valid.any():
        return None
    scaled, half_angles = scaled[valid], half_angles[valid]
    # (trials, edges) distance of each edge from each cone, in pixels near enough
    axes = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    away = np.arccos(np.clip(axes @ edges.rays.T, -1.0, 1.0)) - half_angles[:, None]
    met = np.abs(away) * edges.px_per_rad < tolerance_px
    support = [np.unique(edges.direction[row]).size for row in met]
    best = int(np.argmax(support))
    if support[best] < _LEAST_SUPPORT * CONTOUR_POINTS:
        return None
    return BallOutline(axes[best], float(half_angles[best]))


def _cones(triples: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Axis / cos(half angle) (t, 3) of the cones through three rays each (t, 3, 3), and which triples have one."""
    valid = np.abs(np.linalg.det(triples)) > 1e-9
    scaled = np.ones((len(triples), 3))
    scaled[valid] = np.linalg.solve(triples[valid], np.ones((np.count_nonzero(valid), 3, 1)))[..., 0]
    return scaled, valid & (np.linalg.norm(scaled, axis=1) > 1.0)


def _fitted(edges: Edges, outline: BallOutline) -> BallOutline:
    """The cone through the edges near an outline, far ones weighing less (Tukey)."""
    strength = np.minimum(edges.strength, np.median(edges.strength))
    for reach_px in (1.2, 1.0, 0.8, 0.8, 0.8):
        away = _offsets_px(edges, outline)
        weights = strength * np.clip(1.0 - (away / reach_px) ** 2, 0.0, None) ** 2
        # of several edges in one direction the nearest counts
        nearest = _nearest(edges, np.abs(away))[edges.direction]
        weights *= np.abs(away) <= nearest
        if np.count_nonzero(weights) < 8:
            break
        outline = BallOutline.through_rays(edges.rays, weights)
    return outline


def _offsets_px(edges: Edges, outline: BallOutline) -> Array:
    return (outline.polar(edges.rays)[0] - outline.half_angle_rad) * edges.px_per_rad


def _nearest(edges: Edges, distance_px: Array) -> Array:
    """(directions,) distance of the nearest edge in each direction; infinite where there is none."""
    nearest = np.full(CONTOUR_POINTS, np.inf)
    np.minimum.at(nearest, edges.direction, distance_px)
    return nearest


def _candidates(picture: Picture, camera: Camera) -> list[BallOutline]:
    """First guesses, as cones: circles in the picture as it is and with its local contrast evened out."""
    shrink = min(1.0, _SEARCH_WIDTH_PX / picture.shape[1])
    codes = np.clip(picture * 255.0, 0.0, 255.0).astype(np.uint8)
    small = cv2.resize(codes, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    circles: list[Array] = []
    for image in (small, cv2.createCLAHE(8.0, (8, 8)).apply(small)):
        smooth = np.asarray(cv2.GaussianBlur(image, (0, 0), 1.0), np.uint8)
        for perfection, threshold in _HOUGH_PASSES:
            circles += _new_circles(_hough(smooth, shrink, perfection, threshold), circles)
    return [BallOutline.through_circle(camera, circle[:2], float(circle[2])) for circle in circles]


def _hough(image: NDArray[np.uint8], shrink: float, perfection: float, threshold: float) -> Array:
    """Circles (n, 3) x, y, radius in the full picture's pixels, the best first."""
    smallest, largest = max(round(_SMALLEST_RADIUS_PX * shrink), 5), min(image.shape) // 2
    found = cv2.HoughCircles(
        image, cv2.HOUGH_GRADIENT_ALT, 1.5, 8.0, param1=threshold, param2=perfection, minRadius=smallest,
        maxRadius=largest,
    )  # fmt: skip
    if found is None:
        return np.zeros((0, 3))
    circles = np.asarray(found, float).reshape(-1, np.asarray(found).shape[-1])[:_CANDIDATES, :3]
    return np.column_stack([(circles[:, :2] + 0.5) / shrink - 0.5, circles[:, 2] / shrink])


def _new_circles(circles: Array, known: list[Array]) -> list[Array]:
    """The circles that are not nearly one of those known; a guess need not be good."""
    fresh: list[Array] = []
    for circle in circles:
        near = _NEARLY * circle[2]
        if not any(np.all(np.abs(circle - other) < near) for other in (*known, *fresh)):
            fresh.append(circle)
    return fresh


def _inside(camera: Camera, outline: BallOutline) -> bool:
    contour = project_rays(camera, outline.contour_rays(64))
    return bool(np.all((contour >= 0.0) & (contour <= np.array(camera.image_size) - 1.0)))
