"""Light paths from a point of the paper to the sky, made by Mitsuba's own dielectric.

The stack looks the same from every point of the paper, so one set of paths serves all of them: a path is where it
crosses the film, where it meets the paper again, what the glass lets through of it, and where it leaves. What film and
paper take is known only when the path is put somewhere on the sheet.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from arlight.optics import Slab
from arlight.validation.mitsuba_library import load_mitsuba

Array = NDArray[np.float64]

MOST_CROSSINGS = 8
MOST_PAPER_HITS = 4
_DIMENSIONS = 20
_REFLECTION, _TRANSMISSION = 0, 1


@dataclass(frozen=True, slots=True)
class StackPaths:
    """Paths that leave a paper point at the origin; irradiance is the sum of weight * film * paper * radiance."""

    weight: Array
    """(paths,) pi times the share of the paths times what the faces let through [sr]."""
    direction: Array
    """(paths, 3) unit vectors in which they leave the sheet."""
    film_mm: Array
    """(paths, MOST_CROSSINGS, 2) where they cross the film, relative to the paper point [mm]; a place counts as often
    as it stands."""
    film_count: NDArray[np.int64]
    """(paths,) crossings."""
    paper_mm: Array
    """(paths, MOST_PAPER_HITS, 2) where they meet the paper again [mm]."""
    paper_count: NDArray[np.int64]
    """(paths,) further meetings with the paper."""


def trace_stack(slab: Slab, direct_log2: int = 13, bounced_log2: int = 11, seed: int = 0) -> StackPaths:
    """Trace a set of paths; all sets of one size have the same directions up to a random shift of their sequence.

    What is transmitted by both faces, and the first reflection by each face, are followed apart, each with its weight;
    from there on Mitsuba's dielectric chooses at random.

    Args:
        slab: the glass.
        direct_log2: 2 to this many paths go straight to the sky.
        bounced_log2: 2 to this many begin with a reflection by the lower face, and as many by the upper face.
        seed: of the low-discrepancy sequences.

    Raises:
        ValidationUnavailableError: Mitsuba is not there.
    """
    walk = _Walk(load_mitsuba(), slab)
    starts: tuple[tuple[int, tuple[int, ...]], ...] = (
        (direct_log2, (_TRANSMISSION, _TRANSMISSION)),
        (bounced_log2, (_REFLECTION,)),
        (bounced_log2, (_TRANSMISSION, _REFLECTION)),
    )
    for stratum, (log2, forced) in enumerate(starts):
        sequence = qmc.Sobol(_DIMENSIONS, rng=np.random.default_rng([seed, stratum]))
        for numbers in sequence.random_base2(log2):
            walk.follow(numbers, forced, np.pi / 2**log2)
    return walk.paths()


def interface_reflectance_table(slab: Slab, count: int = 4096) -> Array:
    """(count,) reflectance of one face by Mitsuba, for cosines in air evenly spaced over [0, 1]."""
    mitsuba = load_mitsuba()
    cosines = np.linspace(0.0, 1.0, count)
    return np.array([float(mitsuba.fresnel(float(c), slab.refractive_index)[0]) for c in cosines])


class _Walk:
    """Random walks in the stack: paper | gap | lower face | glass | film | upper face."""

    def __init__(self, mitsuba: ModuleType, slab: Slab) -> None:
        self._mitsuba, self._slab = mitsuba, slab
        self._glass = mitsuba.load_dict({"type": "dielectric", "int_ior": float(slab.refractive_index), "ext_ior": 1.0})
        # a share of light, not radiance: no factor for the solid angle's compression in glass
        self._context = mitsuba.BSDFContext(mitsuba.TransportMode.Importance)
        self._interaction = mitsuba.SurfaceInteraction3f()
        self._found: list[tuple[float, Array, list[Array], list[Array]]] = []

    def follow(self, numbers: Array, forced: tuple[int, ...], weight: float) -> None:
        """Follow one path with given random numbers; the first events at the faces are forced."""
        chances, orders = iter(numbers[2:].tolist()), iter(forced)
        film: list[Array] = []
        paper: list[Array] = []
        place, direction, in_glass = np.zeros(2), _cosine_direction(numbers[0], numbers[1]), False
        # paths that need more random numbers than the sequence has dimensions carry next to nothing
        while len(film) < MOST_CROSSINGS and len(paper) < MOST_PAPER_HITS:
            upward = bool(direction[2] > 0)
            if in_glass:
                place = place + self._slab.glass_mm * direction[:2] / abs(direction[2])
            at_film = in_glass and upward
            if at_film:
                film.append(place)
            chance = next(chances, None)
            if chance is None:
                return
            turned, direction, share = self._meet_face(direction, in_glass, next(orders, None), chance)
            weight *= share
            if at_film and not turned:
                self._found.append((weight, direction, film, paper))
                return
            if at_film:
                film.append(place)
            in_glass = in_glass == turned
            if not in_glass:
                paper.append(place)
                first, second = next(chances, None), next(chances, None)
                if first is None or second is None:
                    return
                direction = _cosine_direction(first, second)

    def paths(self) -> StackPaths:
        """All that reached the sky."""
        weight, direction, film, paper = zip(*self._found, strict=True)
        return StackPaths(
            np.array(weight),
            np.array(direction),
            _padded(film, MOST_CROSSINGS),
            np.array([len(places) for places in film]),
            _padded(paper, MOST_PAPER_HITS),
            np.array([len(places) for places in paper]),
        )

    def _meet_face(
        self, direction: Array, in_glass: bool, order: int | None, chance: float
    ) -> tuple[bool, Array, float]:
        """Whether Mitsuba's dielectric turns a path back, the new direction, and the weight."""
        # in its frame the air is above the face: what comes from the air comes from above
        comes_from = -1.0 if in_glass else 1.0
        flip = comes_from if direction[2] < 0 else -comes_from
        self._interaction.wi = self._mitsuba.Vector3f(*(-direction * [1.0, 1.0, flip]).tolist())
        self._context.component = 0xFFFFFFFF if order is None else order
        sample, value = self._glass.sample(self._context, self._interaction, chance, [0.5, 0.5])
        outgoing = np.array(sample.wo, float).reshape(3) * [1.0, 1.0, flip]
        return bool(outgoing[2] * direction[2] < 0), outgoing, float(value[0])


def _cosine_direction(first: float, second: float) -> Array:
    """Directions upward, their density proportional to the cosine."""
    radius, azimuth = np.sqrt(first), 2.0 * np.pi * second
    return np.array([radius * np.cos(azimuth), radius * np.sin(azimuth), np.sqrt(max(0.0, 1.0 - first))])


def _padded(places: tuple[list[Array], ...], most: int) -> Array:
    padded = np.zeros((len(places), most, 2))
    for row, path in zip(padded, places, strict=True):
        row[: len(path)] = path if path else np.zeros((0, 2))
    return padded
