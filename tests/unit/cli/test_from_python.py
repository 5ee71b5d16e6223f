"""``fieldrl.estimate``: from samples to parameters in a line of Python."""

import subprocess
import sys

import numpy as np
import pytest

import fieldrl
from fieldrl.core.checks import InvalidValue
from fieldrl.core.parameters import Parameters
from fieldrl.core.streams import stream


class Plume:
    """A model of somebody's own, in plain Python: a Gaussian plume that drifts east and decays."""

    parameters = Parameters(("speed", "decay"), ("length/time", "1/time"), (0.0, 0.0), (4.0, 1.0))

    def predict(self, theta, positions, times):
        speed, decay = np.asarray(theta).T[:, :, None]
        x, y = positions.T
        return 10 * np.exp(-decay * times - ((x - speed * times) ** 2 + y**2) / 50)


@pytest.fixture(scope="module")
def table():
    """Columns of 25 samples with noise of 0.05, of speed 2 and decay 0.3."""
    rng = stream(0, "samples of a test")
    times = rng.uniform(0, 5, 25)
    x, y = 2 * times + rng.normal(0, 4, 25), rng.normal(0, 4, 25)
    value = Plume().predict(np.array([[2.0, 0.3]]), np.column_stack([x, y]), times)[0]
    return {"time": times, "x": x, "y": y, "value": value + rng.normal(0, 0.05, 25)}


def test_a_plain_model_and_a_table_give_estimate_errors_and_intervals(table):
    found = fieldrl.estimate(table, Plume())
    for name, true in (("speed", 2.0), ("decay", 0.3)):
        low, high = found.intervals[name]
        assert low < found.parameters[name] < high
        assert abs(found.parameters[name] - true) < 2 * (high - low)
    assert 0.03 < found.noise < 0.08
    assert found.errors.e_f < found.errors.e_cv
    assert f"speed = {found.parameters['speed']:.4f}" in str(found)
    assert found.identified == {"speed": True, "decay": True}
    assert 0 < found.std["decay"] < 0.1
    assert found.left_out == {}


def test_rows_that_are_left_out_are_told(table):
    broken = {**table, "value": np.where(np.arange(25) == 3, np.nan, table["value"])}
    found = fieldrl.estimate(broken, Plume())
    assert found.left_out == {"a number is missing": 1}
    assert "1 left out: a number is missing" in str(found)


@pytest.mark.parametrize(
    ("model", "said"), [("foo", "one of the experiments advection"), (object(), "needs parameters")]
)
def test_what_is_no_model_is_refused(table, model, said):
    with pytest.raises(InvalidValue, match=said):
        fieldrl.estimate(table, model)


def test_importing_fieldrl_imports_nothing_heavy():
    code = (
        "import sys, fieldrl; "
        "assert not {'numba', 'scipy', 'pandas', 'xarray', 'hydra', 'mlflow'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
