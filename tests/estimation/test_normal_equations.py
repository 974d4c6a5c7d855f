"""The gathered equations against the same least squares with one wide, explicit matrix."""

import numpy as np
import pytest

from arlight.estimation.normal_equations import BlockSystem

COEFFICIENTS, FIELD, ROWS = 9, 4, 7
COLUMN = np.array([1, 2, 3, 4, 1, 0, 2, 0, 4, 4, 3])
PATTERNED = COLUMN > 0
PLACES = np.stack([0 * COLUMN, np.where(PATTERNED, 2 * COLUMN - 1, 0), 2 * COLUMN], axis=1)


class Problem:
    """Random rows, weights and prior."""

    def __init__(self, seed):
        generator = np.random.default_rng(seed)
        blocks = len(COLUMN)
        self.basis = generator.normal(size=(blocks, FIELD))
        self.expected = generator.normal(size=COEFFICIENTS + FIELD)
        self.deviation = generator.uniform(0.3, 3.0, COEFFICIENTS + FIELD)
        self.design = generator.normal(size=(blocks, ROWS, 3))
        # what has no stripes does not see Re and Im
        self.design[~PATTERNED, :, 1:] = 0.0
        self.mirror = generator.normal(size=(blocks, ROWS))
        self.values = generator.normal(size=(blocks, ROWS))
        # full matrices: a lamp makes a block's rows err together
        factors = generator.normal(size=(blocks, ROWS, ROWS + 2))
        self.precision = factors @ factors.swapaxes(1, 2)

    def system(self):
        return BlockSystem(PLACES, self.basis, self.expected, self.deviation)

    def solve(self):
        return self.system().solve(self.design, self.mirror, self.values, self.precision)

    def wide(self):
        """(blocks * rows, unknown) explicit matrix."""
        matrix = np.zeros((len(COLUMN), ROWS, COEFFICIENTS + FIELD))
        for block, column in enumerate(COLUMN):
            matrix[block, :, 0] = self.design[block, :, 0]
            if PATTERNED[block]:
                matrix[block, :, 2 * column - 1 : 2 * column + 1] = self.design[block, :, 1:]
            matrix[block, :, COEFFICIENTS:] = np.outer(self.mirror[block], self.basis[block])
        return matrix


@pytest.mark.parametrize("seed", range(5))
def test_solution_is_that_of_the_explicit_least_squares(seed):
    problem = Problem(seed)
    solution, normal = problem.solve()
    # whitened rows, then the prior's rows below
    whitening = np.linalg.cholesky(problem.precision).swapaxes(1, 2)
    rows = (whitening @ problem.wide()).reshape(-1, COEFFICIENTS + FIELD)
    right = (whitening @ problem.values[..., None]).ravel()
    prior = np.diag(1.0 / problem.deviation)
    stacked = np.vstack([rows, prior])
    expected, *_ = np.linalg.lstsq(stacked, np.concatenate([right, problem.expected / problem.deviation]))
    np.testing.assert_allclose(solution, expected, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(normal, stacked.T @ stacked, rtol=1e-10, atol=1e-10)


def test_predictions_are_the_explicit_matrixs():
    problem = Problem(11)
    system = problem.system()
    solution = np.random.default_rng(12).normal(size=COEFFICIENTS + FIELD)
    light_only = solution.copy()
    light_only[COEFFICIENTS:] = 0.0
    np.testing.assert_allclose(system.lit(solution, problem.design), problem.wide() @ light_only, atol=1e-12)
    np.testing.assert_allclose(system.field(solution), problem.basis @ solution[COEFFICIENTS:], atol=1e-12)
    assert system.field_size == FIELD


def test_without_any_weight_the_prior_is_all_there_is():
    problem = Problem(13)
    problem.precision[:] = 0.0
    solution, normal = problem.solve()
    np.testing.assert_allclose(solution, problem.expected, rtol=1e-10)
    np.testing.assert_allclose(normal, np.diag(problem.deviation**-2.0), rtol=1e-12)
