"""Eliminating each view's own unknowns, against one least squares of everything."""

import numpy as np
import pytest

from arlight.calibration.layers.eliminated_equations import EliminatedEquations

SHARED, BLOCKS, ROWS = 5, 6, 3
OWN = (2, 3, 2)
"""How many unknowns each view has of its own."""


class Problem:
    """Random views, weights and priors, and their solution with all unknowns in one system."""

    def __init__(self, seed):
        generator = np.random.default_rng(seed)
        self.prior = generator.uniform(0.5, 2.0, SHARED), generator.normal(size=SHARED)
        self.views = []
        for own in OWN:
            factors = generator.normal(size=(BLOCKS, ROWS, 5))
            self.views.append((
                generator.normal(size=(BLOCKS, ROWS)),
                generator.normal(size=(BLOCKS, ROWS, SHARED)),
                generator.normal(size=(BLOCKS, ROWS, own)),
                factors @ factors.swapaxes(1, 2),
                generator.uniform(0.5, 2.0, own),
                generator.normal(size=own),
            ))  # fmt: skip

    def eliminated(self):
        equations = EliminatedEquations(*self.prior)
        for view in self.views:
            equations.add(*view)
        return equations

    def joint(self):
        """Step of all unknowns and their covariance."""
        size = SHARED + sum(OWN)
        spread, away = (np.concatenate([self.prior[i], *(view[4 + i] for view in self.views)]) for i in (0, 1))
        normal, right = np.diag(1 / spread**2), -away / spread**2
        first = SHARED
        for residual, shared, own, precision, _, _ in self.views:
            wide = np.zeros((BLOCKS, ROWS, size))
            wide[..., :SHARED], wide[..., first : first + own.shape[2]] = shared, own
            first += own.shape[2]
            for block in range(BLOCKS):
                normal += wide[block].T @ precision[block] @ wide[block]
                right += wide[block].T @ precision[block] @ residual[block]
        return np.linalg.solve(normal, right), np.linalg.inv(normal)


@pytest.mark.parametrize("seed", range(3))
def test_steps_and_covariance_are_those_of_one_least_squares(seed):
    problem = Problem(seed)
    equations = problem.eliminated()
    step, covariance = equations.solve()
    everything, joint = problem.joint()
    np.testing.assert_allclose(step, everything[:SHARED], atol=1e-10)
    np.testing.assert_allclose(covariance, joint[:SHARED, :SHARED], atol=1e-10)
    np.testing.assert_allclose(np.concatenate(equations.own_steps(step)), everything[SHARED:], atol=1e-10)


def test_without_views_the_prior_is_all_there_is():
    spread, away = np.array([0.1, 2.0]), np.array([0.3, -1.0])
    step, covariance = EliminatedEquations(spread, away).solve()
    np.testing.assert_allclose(step, -away)
    np.testing.assert_allclose(covariance, np.diag(spread**2))


def test_a_view_without_weight_tells_nothing_and_goes_back_to_its_prior():
    problem = Problem(4)
    residual, shared, own, precision, spread, away = problem.views[0]
    equations = EliminatedEquations(*problem.prior)
    equations.add(residual, shared, own, 0.0 * precision, spread, away)
    step, covariance = equations.solve()
    np.testing.assert_allclose(step, -problem.prior[1])
    np.testing.assert_allclose(np.diagonal(covariance), problem.prior[0] ** 2)
    np.testing.assert_allclose(equations.own_steps(step)[0], -away)


def test_every_view_makes_the_shared_unknowns_more_certain():
    problem = Problem(5)
    equations = EliminatedEquations(*problem.prior)
    before = equations.solve()[1]
    for view in problem.views:
        equations.add(*view)
        after = equations.solve()[1]
        assert np.linalg.eigvalsh(before - after).min() > -1e-12
        before = after
