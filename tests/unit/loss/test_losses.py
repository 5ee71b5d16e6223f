"""Losses: their roots, slopes and inverses belong together, and an outlier counts less."""

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.loss.huber import Huber
from fieldrl.loss.squared import Squared
from fieldrl.loss.student_t import StudentT

Z = np.concatenate([-np.geomspace(50, 1e-8, 40), [0.0], np.geomspace(1e-8, 50, 40)])
EVERY = pytest.mark.parametrize(
    "loss", [Squared(), Huber(), StudentT()], ids=lambda loss: type(loss).__name__
)


@EVERY
def test_the_inverse_gives_back_the_residual(loss):
    assert loss.inverse(loss.root(Z)) == pytest.approx(Z, rel=1e-9)


@EVERY
def test_the_slope_is_that_of_the_root(loss):
    step = 1e-6 * np.maximum(np.abs(Z), 1e-3)
    differences = (loss.root(Z + step) - loss.root(Z - step)) / (2 * step)
    assert loss.slope(Z) == pytest.approx(differences, rel=1e-5)


def test_an_outlier_counts_less_in_a_robust_loss():
    squared, huber, student = (
        float(loss.root(np.array(10.0)) ** 2) for loss in (Squared(), Huber(), StudentT())
    )
    assert student < huber < squared / 3


@pytest.mark.parametrize(
    ("make", "key"), [(lambda: Huber(0.0), "threshold"), (lambda: StudentT(-1.0), "freedom")]
)
def test_what_is_no_loss_is_refused(make, key):
    with pytest.raises(InvalidValue, match=key):
        make()
