"""A(view): what each block's mean and stripe harmonics are for unit coefficients, from one point of view.

A pixel whose film point has the phase phi sees paper of phase phi - b, b = 2 pi n.Delta(v). With film harmonics f_a and
radiosity harmonics B_l its radiance is T(v)/pi * sum f_a B_l exp(i (a + l) phi) exp(-i l b): harmonic m collects all
a + l = m (paper, eqs 12-19, with real layers). Rows are real: mean, cosine 1, sine 1, ... of the film's phase.
"""

import ctypes

import numpy as np
from numpy.typing import NDArray

from arlight.estimation.layer_series import HARMONICS as STACK_HARMONICS
from arlight.estimation.layer_series import real_parts
from arlight.estimation.radiance_prior import predicted_sky, received_operator, sky_directions
from arlight.estimation.resampling import measured_frequencies
from arlight.estimation.slab_echo import Echo, uniform_light
from arlight.estimation.stack import PaperLight, paper_light
from arlight.native import Workspace, address, library
from arlight.probe.assembly import Assembly
from arlight.probe.design import Block, Probe
from arlight.tracking.block_layout import field_blocks
from arlight.tracking.block_means import HARMONICS, ROWS, BlockMeans

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_LANES = 8
"""Planes are filled up to a multiple of this: the compiled code handles four or eight blocks together."""
_PARTS = 2 * STACK_HARMONICS + 1
_SILENT = 1e-9
"""Light that goes back and forth, relative to the most, below which a harmonic of it counts as nothing."""
_native = library(__file__, "sheet_estimate")
_native.respond.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)


class _Response(Workspace):
    """As in response.h."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("blocks", "stride", "columns", "unknown", "kinds", "parts")),
        *((name, ctypes.c_int64) for name in ("folded", "whole")),
        ("index", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("film", "radiosity", "gathered", "echo", "kind", "overtone")),
        *((name, ctypes.c_void_p) for name in ("passed_twice", "usual", "beyond", "shape", "phasor", "cosine")),
        *((name, ctypes.c_void_p) for name in ("echoed", "rows", "mirror")),
    )


class BlockResponse:
    """The response of a sheet's blocks; everything that does not depend on the view is computed once."""

    places: NDArray[np.int64]
    """(blocks, c) which real-packed coefficients the columns of a block's rows belong to."""
    sequence: NDArray[np.int64]
    """(blocks,) the blocks in the order of the compiled tables: those without pattern, then by frequency."""
    phasor: Array
    """(2, stride) real and imaginary part of the views' phasors in that order, to be filled before `fill`."""
    cosine: Array
    """(stride,) cosines of the views, as well."""
    rows: Array
    """(c, 7, stride) what `fill` finds: rows for unit coefficients before blur."""
    mirror: Array
    """(7, stride) and the lower face's mirror reflection, where the upper face mirrors 1."""

    def __init__(
        self, probe: Probe, assembly: Assembly | None = None, *, bounces: bool = True, echoes: bool = True
    ) -> None:
        """Solve the stack of every block.

        Args:
            probe: the sheet.
            assembly: how it was printed and put together; exactly as designed by default.
            bounces: follow the light reflected between paper and glass.
            echoes: follow the light that goes back and forth inside the glass.
        """
        blocks = field_blocks(probe)
        light = paper_light(probe, blocks, assembly, bounces=bounces, echoes=echoes)
        slab = self._slab = (assembly or Assembly()).slab(probe)
        self._measured = measured_frequencies(probe, assembly or Assembly())
        self._beyond: dict[int, Array] = {}
        self.places, known = _places(probe, blocks, light.radiosity.shape[2])
        self.sequence = np.argsort(self.places[:, 1], kind="stable")
        self._count, unknown = len(blocks), 2 * len(probe.frequencies) - 1
        usual = np.eye(1, unknown)[0] if light.echo is None else uniform_light(slab, self._measured)
        filled = -(-unknown // _LANES) * _LANES
        stride = -(-len(blocks) // _LANES) * _LANES
        self.phasor, self.cosine = np.zeros((2, stride)), np.ones(stride)
        self.rows, self.mirror = np.zeros((self.places.shape[1], ROWS, stride)), np.zeros((ROWS, stride))
        self.native = _Response(
            blocks=stride, stride=stride, columns=self.places.shape[1], unknown=filled, whole=unknown,
            index=slab.refractive_index,
        )  # fmt: skip
        """What the compiled code is given."""
        self.native.hold({
            "usual": np.ascontiguousarray(usual, float), "shape": np.zeros(filled), "phasor": self.phasor,
            "cosine": self.cosine, "rows": self.rows, "mirror": self.mirror, "overtone": self._overtone(stride),
        })  # fmt: skip
        self._hold(light, known, stride)

    def _hold(self, light: PaperLight, known: NDArray[np.bool_], stride: int) -> None:
        """Keep what the view does not change as the compiled code wants it: one plane a number, real parts alone."""
        film = real_parts(light.film)
        # share of the light that the film's second crossing leaves on its way out
        passed_twice = film[:, 0] ** 2 + 2.0 * np.sum(film[:, 1:] ** 2, axis=1)
        radiosity = np.moveaxis(real_parts(np.moveaxis(light.radiosity, 2, 1)) * known[:, :, None], 0, 2)
        tables = {"film": film.T, "radiosity": radiosity, "passed_twice": passed_twice}
        kind = np.zeros(stride, np.int32)
        if light.echo is not None:
            kind[: self._count] = light.echo.kind[self.sequence]
            tables["gathered"] = self._hold_echo(light.echo, _real_matrix(light.gathered))
        self.native.hold({"kind": kind, **{name: self._planes(table, stride) for name, table in tables.items()}})

    def _hold_echo(self, echo: Echo, gathered: Array) -> Array:
        """Keep the echo's irradiance; returns what gathers it (9, parts, blocks), as far as it is not 0."""
        irradiance = np.swapaxes(real_parts(np.swapaxes(echo.irradiance, 1, 2)), 1, 2)
        heard = np.abs(irradiance).max(axis=(0, 2))
        parts = int(np.flatnonzero(heard > _SILENT * heard.max(initial=0.0)).max(initial=-1)) + 1
        table = np.zeros((len(irradiance), parts, self.native.unknown))
        table[:, :, : irradiance.shape[2]] = irradiance[:, :parts]
        self.native.kinds, self.native.parts = table.shape[:2]
        self.native.hold({"echo": table, "echoed": np.zeros(table.shape[:2])})
        return np.moveaxis(gathered[:, :, :parts], 0, 2)

    def _planes(self, table: Array, stride: int) -> Array:
        """A table (..., blocks) in the compiled order, with room for whole lanes."""
        planes = np.zeros((*table.shape[:-1], stride))
        planes[..., : self._count] = table[..., self.sequence]
        return planes

    def _overtone(self, stride: int) -> NDArray[np.int32]:
        """(stride,) place of Re L_2n; 0 where it is not listened to."""
        overtone = np.zeros(stride, np.int32)
        if self.places.shape[1] > 3:
            overtone[: self._count] = self.places[self.sequence, 3]
        return overtone

    def light(self, means: BlockMeans, shape: Array | None = None) -> Array:
        """Rows (blocks, 7, c) for unit coefficients before blur.

        Columns are L_0, Re L_n and Im L_n of each block's own frequency n, then Re L_2n and Im L_2n where the film has
        a second harmonic; `places` has where they belong.

        Args:
            means: says from where the blocks are seen.
            shape: (2k - 1,) real-packed coefficients relative to L_0, as far as known, for what the light near the
                horizon does inside the glass; a uniform sky's by default.
        """
        self._look(means)
        self.fill(self._count, shape, folded=False)
        return np.moveaxis(self._natural(self.rows), 2, 0).swapaxes(1, 2).copy()

    def lower_mirror(self, means: BlockMeans) -> Array:
        """Rows (blocks, 7) of the mirror reflection in the glass's lower face, where the upper face's is 1."""
        self._look(means)
        _native.mirror_rows(ctypes.byref(self.native))
        return self._natural(self.mirror).T.copy()

    def fill(self, count: int, shape: Array | None = None, *, folded: bool = True) -> None:
        """Compute `rows` and `mirror` for the first `count` blocks of the sequence, seen as `phasor` and `cosine` say.

        Args:
            shape: as for `light`, or of the first coefficients alone.
            folded: count light of twice a block's frequency with that of L_0, by the shape; of `rows` only the first
                three columns are filled then.
        """
        known = 0 if shape is None else len(shape)
        self.expect(known)
        self.native.blocks, self.native.folded = count, folded
        values = None if shape is None else np.ascontiguousarray(shape, float)
        at = None if values is None else address(values, np.float64)
        _native.respond(ctypes.byref(self.native), at, known)

    def expect(self, known: int) -> None:
        """Prepare for a light's shape of which so many coefficients are known.

        Those that were not measured are those of the sky that the measured ones predict.
        """
        if not 0 < known < self.native.whole:
            return
        if known not in self._beyond:
            operator = received_operator(self._slab, self._measured, *sky_directions())
            beyond = operator[known:] @ predicted_sky(self._slab, self._measured[: (known + 1) // 2])
            self._beyond[known] = np.ascontiguousarray(beyond, float)
        self.native.beyond = self._beyond[known].ctypes.data

    def _look(self, means: BlockMeans) -> None:
        phasor = np.asarray(means.view_phasor)[self.sequence]
        self.phasor[:, : self._count] = phasor.real, phasor.imag
        self.cosine[: self._count] = np.asarray(means.view_cosine)[self.sequence]

    def _natural(self, planes: Array) -> Array:
        """(..., blocks) in the sheet's own order."""
        result = np.empty((*planes.shape[:-1], self._count))
        result[..., self.sequence] = planes[..., : self._count]
        return result


def _real_matrix(matrix: ComplexArray) -> Array:
    """(blocks, 2 H + 1, 2 H + 1) matrices of series -H..H as they act on real parts."""
    # column by column: the series whose real parts are a unit vector
    unit = np.zeros((_PARTS, _PARTS), complex)
    unit[STACK_HARMONICS, 0] = 1.0
    for m in range(1, STACK_HARMONICS + 1):
        for sign in (1, -1):
            unit[STACK_HARMONICS + sign * m, 2 * m - 1 : 2 * m + 1] = 1.0, 1j * sign
    return np.swapaxes(real_parts(np.swapaxes(matrix @ unit, 1, 2)), 1, 2)


def _places(probe: Probe, blocks: tuple[Block, ...], columns: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Real-packed places (blocks, c) of the columns, and which of them the sheet's order has."""
    place = {(int(u), int(v)): k for k, (u, v) in enumerate(probe.frequencies)}
    places = np.zeros((len(blocks), columns), np.int64)
    known = np.zeros((len(blocks), columns), bool)
    known[:, 0] = True
    for i, block in enumerate(blocks):
        u, v = block.frequency or (0, 0)
        for j in range(1, (columns + 1) // 2):
            k = place.get((j * u, j * v), 0)
            if k:
                places[i, 2 * j - 1 : 2 * j + 1] = 2 * k - 1, 2 * k
                known[i, 2 * j - 1 : 2 * j + 1] = True
    return places, known


def optical_transfer(cycles_per_px: Array, blur_variance_px2: float) -> Array:
    """What pixel and blur leave of each row (blocks, 7): 1 for the mean, the transfer at m n for harmonic m.

    Args:
        cycles_per_px: (blocks, 2) frequency of the stripes in the image [1/px].
        blur_variance_px2: variance of a Gaussian blur beside the pixel's square [px^2].
    """
    harmonic = np.concatenate([[0], np.repeat(np.arange(1, HARMONICS + 1), 2)])
    frequency = harmonic[:, None] * cycles_per_px[:, None, :]
    square = np.prod(np.sinc(frequency), axis=-1)
    return square * np.exp(-2.0 * np.pi**2 * blur_variance_px2 * np.sum(frequency**2, axis=-1))
