"""Many distant lights gathered into few, where most is gained: a lone lamp keeps a group to itself."""

import heapq
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class LightGroups(NamedTuple):
    """Lights that are near each other, as one light each; every channel's strength is preserved."""

    positions: Array
    """(g, 2) centroids of the lights."""
    strengths: Array
    """(g, channels) sums of the lights."""
    members: tuple[Indices, ...]
    """Which lights belong to each group."""


def group_lights(positions: Array, strengths: Array, count: int) -> LightGroups:
    """Gather lights into at most `count` groups of small scatter.

    What a group loses of a wave is its strength times its variance, to second order. So the group that scatters most is
    halved, at its centroid, until there are enough.

    Args:
        positions: (n, 2), in any unit.
        strengths: (n, channels), not negative; lights without strength are left out.
        count: of groups, at least one.
    """
    mass = strengths.sum(axis=1)
    shining = np.flatnonzero(mass > 0.0)
    if shining.size == 0:
        return LightGroups(np.zeros((0, 2)), np.zeros((0, strengths.shape[1])), ())
    groups = [shining]
    scatter = [(-_scatter(positions, mass, shining).sum(), 0)]
    while len(groups) < count and scatter and scatter[0][0] < 0.0:
        _, number = heapq.heappop(scatter)
        whole = groups[number]
        axis = int(np.argmax(_scatter(positions, mass, whole)))
        along = positions[whole, axis]
        beyond = along > np.average(along, weights=mass[whole])
        if beyond.all() or not beyond.any():
            continue  # no farther apart than rounding
        groups[number] = whole[~beyond]
        groups.append(whole[beyond])
        for half in (number, len(groups) - 1):
            heapq.heappush(scatter, (-_scatter(positions, mass, groups[half]).sum(), half))
    centroids = np.stack([np.average(positions[group], axis=0, weights=mass[group]) for group in groups])
    return LightGroups(centroids, np.stack([strengths[group].sum(axis=0) for group in groups]), tuple(groups))


def _scatter(positions: Array, mass: Array, group: Indices) -> Array:
    """(2,) sum over a group of mass times squared distance from its centroid, along each axis."""
    at, weight = positions[group], mass[group]
    return np.asarray(weight @ (at - np.average(at, axis=0, weights=weight)) ** 2, float)
