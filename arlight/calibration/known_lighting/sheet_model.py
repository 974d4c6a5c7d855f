"""What the blocks show under known light, for a trial assembly, and how it changes with every unknown."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arlight.calibration.known_lighting.block_corrections import STEPS as BLOCK_STEPS
from arlight.calibration.known_lighting.block_corrections import with_corrections
from arlight.calibration.known_lighting.known_light import KnownLight
from arlight.calibration.known_lighting.lit_views import LitView
from arlight.calibration.layers import layer_parameters
from arlight.calibration.layers.sheet_view import PredictedSheet, SheetView
from arlight.estimation.resampling import measured_frequencies
from arlight.estimation.response import optical_transfer
from arlight.estimation.stripe_rows import turned_rows
from arlight.probe.assembly import Assembly
from arlight.probe.design import Probe
from arlight.tracking.block_layout import BlockLayout

Array = NDArray[np.float64]

NAMES = (*layer_parameters.NAMES, "reflectance")
"""Parameters of the layers and the camera, in the order of their vector; the last is a factor on all that paper and
film send back, which known light tells and unknown light does not."""
EXPECTED = np.append(layer_parameters.EXPECTED, 1.0)
LOW = np.append(layer_parameters.LOW, 0.2)
LAYER_STEPS = np.append(layer_parameters.STEP, 1e-3)
LAYER_STDDEV = np.append(layer_parameters.STDDEV, 0.15)
# light that is not quite distant differs from light to light, and a gain that falls across the sheet is the blocks'
LAYER_STDDEV[[NAMES.index("gradient_x"), NAMES.index("gradient_y")]] = 1e-6
VIGNETTING = (NAMES.index("vignetting_k1"), NAMES.index("vignetting_k2"))
_LOWER_FACE = NAMES.index("lower_face")
_NOT_OF_THE_SHEET = ("vignetting_k1", "vignetting_k2", "lower_face", "gradient_x", "gradient_y")
"""Parameters that leave the stack as it is."""

VIEW_STEPS = np.array([1e-3, 1e-4, 1e-4, 1e-4, 1e-4])
"""Steps of a view's unknowns."""
VIEW_STDDEV = np.array([0.5, 0.01, 0.01, 0.002, 0.002])
"""Prior spread of a view's unknowns: blur's variance [px^2], where the pose puts the sheet (x, y) [mm], and from where
the sheet is seen (x, y) [rad]."""


@dataclass(frozen=True, slots=True)
class Unknowns:
    """A trial of everything that is estimated."""

    layers: Array
    """Values of `NAMES`."""
    blocks: Array
    """(blocks, 4) corrections."""
    views: Array
    """(views, 5) blur's variance [px^2], pose (x, y) [mm], direction (x, y) [rad]."""
    exposures: Array
    """(lightings, 3) factor on each light's radiance."""

    @property
    def assembly(self) -> Assembly:
        """The sheet that they describe."""
        layers = layer_parameters.assembly_of(self.layers[:-1])
        return with_corrections(layers, self.blocks, float(self.layers[-1]))

    @property
    def vignetting(self) -> tuple[float, float]:
        """Radial gain of the lens beside what the camera already has."""
        first, second = (float(self.layers[place]) for place in VIGNETTING)
        return first, second


@dataclass(frozen=True, slots=True)
class ViewPrediction:
    """What one view should show."""

    rows: Array
    """(blocks, 7, 3) light and mirror reflection together, blur included."""
    mirror: Array
    """(blocks, 7) rows of a mirror reflection of 1 in the upper face."""
    mirrored: Array
    """(blocks, 3) mirror reflection that the environment predicts."""


class SheetModel:
    """One trial assembly under the known lights."""

    def __init__(
        self,
        probe: Probe,
        lights: Sequence[KnownLight],
        unknowns: Unknowns,
        *,
        echoes: bool = True,
        sheet: PredictedSheet | None = None,
    ) -> None:
        """Solve the stack, and take the lights' coefficients at the frequencies that it measures.

        Args:
            probe: the sheet as designed.
            lights: the lights by number.
            unknowns: the trial.
            echoes: follow light that goes back and forth inside the glass.
            sheet: of another trial with the same assembly, where there is one.
        """
        assembly = unknowns.assembly
        self.sheet = sheet or PredictedSheet(probe, assembly, echoes=echoes)
        """The stack."""
        self._echoes = echoes
        self._cycles = BlockLayout.of_probe(probe, assembly).cycles_per_mm
        self._tilted_mm = assembly.slab(probe).glass_mm / probe.refractive_index
        self._lower_face = float(unknowns.layers[_LOWER_FACE])
        self._vignetting = unknowns.vignetting
        frequencies = measured_frequencies(probe, assembly)
        self._packed = [light.packed(frequencies) for light in lights]

    def predict(self, view: LitView, own: Array, exposure: Array) -> ViewPrediction:
        """Rows of a view.

        Args:
            view: its geometry; the measured values are not read.
            own: (5,) unknowns of the view.
            exposure: (3,) factor on the light's radiance.
        """
        transfer = optical_transfer(view.sheet.means.cycles_per_px, float(own[0]))
        lit, lower = self._lit(self._turned(view.sheet, own[3:5]))
        mirror = self._lower_face * lower * transfer
        mirror[:, 0] += 1.0
        mirrored = view.mirrored * exposure
        shown = lit * exposure * transfer[..., None] + mirror[..., None] * mirrored[:, None]
        squared = view.sheet.radius_squared
        gain = 1.0 + squared * (self._vignetting[0] + squared * self._vignetting[1])
        shown = turned_rows(shown, 2.0 * np.pi * self._cycles @ own[1:3]) * gain[:, None, None]
        return ViewPrediction(shown, mirror * gain[:, None], mirrored)

    def _lit(self, sheet: SheetView) -> tuple[Array, Array]:
        """Rows (blocks, 7, 3) of the light, and (blocks, 7) of the lower face's mirror reflection."""
        packed, places = self._packed[sheet.light], self.sheet.response.places
        lower = self.sheet.lower_mirror(sheet)
        if not self._echoes:
            return np.einsum("brk,bkc->brc", self.sheet.light(sheet), packed[places]), lower
        lit = [np.einsum("brk,bk->br", self.sheet.light(sheet, light / light[0]), light[places]) for light in packed.T]
        return np.stack(lit, axis=-1), lower

    def _turned(self, sheet: SheetView, tilt: Array) -> SheetView:
        """The view from a slightly other direction."""
        if not np.any(tilt):
            return sheet
        turn = np.exp(-2j * np.pi * self._tilted_mm * (self._cycles @ tilt))
        return replace(sheet, means=replace(sheet.means, view_phasor=sheet.means.view_phasor * turn))


class Linearisation:
    """Predictions about a trial, with one-sided differences; everything that views share is prepared once.

    What the unknowns change in the glass's echoes is far below what the differences need.
    """

    def __init__(self, probe: Probe, lights: Sequence[KnownLight], unknowns: Unknowns) -> None:
        self._at = unknowns
        self._model = SheetModel(probe, lights, unknowns)
        self._base = SheetModel(probe, lights, unknowns, echoes=False)
        layers = [replace(unknowns, layers=unknowns.layers + change) for change in np.diag(LAYER_STEPS)]
        blocks = [replace(unknowns, blocks=unknowns.blocks + change) for change in np.diag(BLOCK_STEPS)]
        self._layers = [
            SheetModel(
                probe, lights, trial, echoes=False, sheet=self._base.sheet if name in _NOT_OF_THE_SHEET else None
            )
            for name, trial in zip(NAMES, layers, strict=True)
        ]
        self._blocks = [SheetModel(probe, lights, trial, echoes=False) for trial in blocks]

    def predict(self, view: LitView, number: int) -> ViewPrediction:
        """Prediction of the view of that number."""
        return self._model.predict(view, self._at.views[number], self._at.exposures[view.sheet.light])

    def differences(self, view: LitView, number: int) -> tuple[Array, Array]:
        """How the rows change.

        Returns:
            (blocks, 7, 3, p): with the layers' parameters, then the view's unknowns;
            (blocks, 7, 3, 4): with the block's own corrections.
        """
        own, exposure = self._at.views[number], self._at.exposures[view.sheet.light]
        base = self._base.predict(view, own, exposure).rows

        def slopes(models: list[SheetModel], steps: Array) -> list[Array]:
            return [
                (model.predict(view, own, exposure).rows - base) / step
                for model, step in zip(models, steps, strict=True)
            ]

        shared = slopes(self._layers, LAYER_STEPS)
        for change, step in zip(np.diag(VIEW_STEPS), VIEW_STEPS, strict=True):
            shared.append((self._base.predict(view, own + change, exposure).rows - base) / step)
        return np.stack(shared, axis=-1), np.stack(slopes(self._blocks, BLOCK_STEPS), axis=-1)
