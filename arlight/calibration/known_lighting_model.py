"""What the blocks show under known light, for a trial assembly, and how it changes with every unknown."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.block_corrections import STEPS as BLOCK_STEPS
from arlight.calibration.block_corrections import with_corrections
from arlight.calibration.known_lighting_light import KnownLight
from arlight.calibration.known_lighting_parameters import LOWER_FACE, PARAMETERS, REFLECTANCE, assembly_of
from arlight.calibration.known_lighting_parameters import STEPS as LAYER_STEPS
from arlight.calibration.known_lighting_views import LitView, SheetGeometry, turned_rows
from arlight.estimation.resampling import measured_frequencies
from arlight.estimation.response import BlockResponse, optical_transfer
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe

Array = NDArray[np.float64]

VIEW_STEPS = np.array([1e-3, 1e-4, 1e-4, 1e-4, 1e-4])
"""Steps of a view's unknowns."""
VIEW_STDDEV = np.array([0.5, 0.01, 0.01, 0.002, 0.002])
"""Prior spread of a view's unknowns: blur's variance [px^2], where the pose puts the sheet (x, y) [mm], and from where
the sheet is seen (x, y) [rad]."""


@dataclass(frozen=True, slots=True)
class Unknowns:
    """A trial of everything that is estimated."""

    layers: Array
    """Values of `PARAMETERS`."""
    blocks: Array
    """(blocks, 4) corrections."""
    views: Array
    """(views, 5) blur's variance [px^2], pose (x, y) [mm], direction (x, y) [rad]."""
    exposures: Array
    """(lightings, 3) factor on each light's radiance."""

    @property
    def assembly(self) -> Assembly:
        """The sheet that they describe."""
        return with_corrections(assembly_of(self.layers), self.blocks, float(self.layers[REFLECTANCE]))


@dataclass(frozen=True, slots=True)
class ViewPrediction:
    """What one view should show; errors of it are linear in small changes of the unknowns."""

    lit: Array
    """(blocks, 7, 3) rows of the light, blur included."""
    mirror: Array
    """(blocks, 7) rows of a mirror reflection of 1 in the upper face."""
    mirrored: Array
    """(blocks, 3) mirror reflection that the environment predicts."""

    @property
    def rows(self) -> Array:
        """(blocks, 7, 3) light and mirror reflection together."""
        return self.lit + self.mirror[..., None] * self.mirrored[:, None]


class SheetModel:
    """One trial assembly under the known lights."""

    def __init__(self, probe: Probe, lights: list[KnownLight], unknowns: Unknowns) -> None:
        """Solve the stack, and take the lights' coefficients at the frequencies that it measures."""
        assembly = unknowns.assembly
        self._response = BlockResponse(probe, assembly)
        self._geometry = SheetGeometry.of(probe, assembly)
        self._lower_face = float(unknowns.layers[LOWER_FACE])
        self._index = probe.refractive_index
        frequencies = measured_frequencies(probe, assembly)
        self._coefficients = [light.packed(frequencies)[self._response.places] for light in lights]

    def predict(self, view: LitView, own: Array, exposure: Array) -> ViewPrediction:
        """Rows of a view.

        Args:
            view: its geometry; the values are not read.
            own: (5,) unknowns of the view.
            exposure: (3,) factor on the light's radiance.
        """
        geometry = self._geometry
        toward = view.toward + own[3:5] / self._index
        seen = replace(view, toward=toward).in_phase(geometry.film_phase, geometry.view_phase(toward)).means
        transfer = optical_transfer(seen.cycles_per_px, float(own[0]))
        light = self._coefficients[view.lighting] * exposure
        lit = np.einsum("brk,bkc->brc", self._response.light(seen), light) * transfer[..., None]
        mirror = self._lower_face * self._response.lower_mirror(seen) * transfer
        turn = geometry.film_phase - view.film_phase + 2.0 * np.pi * geometry.cycles_per_mm @ own[1:3]
        mirror = turned_rows(mirror, turn)
        mirror[:, 0] += 1.0
        return ViewPrediction(turned_rows(lit, turn), mirror, view.mirrored * exposure)


class Linearisation:
    """Predictions about a trial, with one-sided differences; everything that views share is prepared once."""

    def __init__(self, probe: Probe, lights: list[KnownLight], unknowns: Unknowns) -> None:
        self._at = unknowns
        self._model = SheetModel(probe, lights, unknowns)
        layers, blocks = unknowns.layers, unknowns.blocks
        # steps lead away from the limits
        self._layer_steps = np.array(
            [-s if v + s > p.high else s for v, s, p in zip(layers, LAYER_STEPS, PARAMETERS, strict=True)]
        )
        self._layers = [
            SheetModel(probe, lights, replace(unknowns, layers=layers + step * unit))
            for step, unit in zip(self._layer_steps, np.eye(len(layers)), strict=True)
        ]
        self._blocks = [
            SheetModel(probe, lights, replace(unknowns, blocks=blocks + step * unit))
            for step, unit in zip(BLOCK_STEPS, np.eye(blocks.shape[1]), strict=True)
        ]

    def predict(self, view: LitView, number: int) -> ViewPrediction:
        """Prediction of the view of that number."""
        return self._model.predict(view, self._at.views[number], self._at.exposures[view.lighting])

    def differences(self, view: LitView, number: int) -> tuple[Array, Array]:
        """How the rows change.

        Returns:
            (blocks, 7, 3, p): with the layers' parameters, then the view's unknowns;
            (blocks, 7, 3, 4): with the block's own corrections.
        """
        own, exposure = self._at.views[number], self._at.exposures[view.lighting]
        base = self.predict(view, number).rows
        shared = [
            (model.predict(view, own, exposure).rows - base) / step
            for model, step in zip(self._layers, self._layer_steps, strict=True)
        ]
        for step, unit in zip(VIEW_STEPS, np.eye(len(VIEW_STEPS)), strict=True):
            shared.append((self._model.predict(view, own + step * unit, exposure).rows - base) / step)
        single = [
            (model.predict(view, own, exposure).rows - base) / step
            for model, step in zip(self._blocks, BLOCK_STEPS, strict=True)
        ]
        return np.stack(shared, axis=-1), np.stack(single, axis=-1)
