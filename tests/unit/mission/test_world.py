"""Missions with a model that is not ours: parameters and predictions, and whatever else it likes."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.agent.drift import Drift
from fieldrl.agent.greedy_information import GreedyInformation
from fieldrl.core.checks import InvalidValue
from fieldrl.core.domain import Domain
from fieldrl.core.parameters import Parameters
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.problem import Differentiable
from fieldrl.figures.run import draw_run, drawings
from fieldrl.mission import combine, run_replicate, summarise
from fieldrl.observation.informed import Informed
from fieldrl.pde.advection import Advection
from fieldrl.pde.flow import UniformFlow
from fieldrl.scenario.drawn import Drawn


class Decay:
    """A patch that decays where it is."""

    parameters = Parameters(
        ("amplitude", "rate"), ("field unit", "1/time"), (50.0, 0.0), (150.0, 0.5), (120.0, 0.2)
    )

    def predict(self, theta, positions, times):
        shape = np.exp(-np.sum((positions - 30.0) ** 2, axis=1) / 30.0**2)
        return theta[:, :1] * np.exp(-theta[:, 1:] * times) * shape


class Fieldless(Decay):
    """The same, where nobody may ask for the field."""

    field = None


class Eddy:
    """A flow of one's own."""

    names, units = ("turn",), ("rad/time",)

    def velocity(self, theta, x, y, t):
        return -0.1 * (y - 50.0), 0.1 * (x - 50.0)


class InAnEddy(Decay):
    """The same in a current that carries the vehicle, in a domain of its own."""

    flow, domain = Eddy(), Domain(upper=(100.0, 80.0))


class Sloped(Decay):
    """The same with derivatives."""

    def jacobian(self, theta, positions, times):
        value = self.predict(theta, positions, times)
        return np.stack([value / theta[:, :1], -times * value], axis=-1)


def recorded(built):
    return combine([run_replicate(built, 0, 0)], built)


def test_parameters_and_predictions_are_enough_for_a_mission(mission, tmp_path):
    built = mission(water=Decay(), episodes=2, evaluation_episodes=1)
    record = recorded(built)
    result = summarise(record)
    assert set(result["parameters"]) == {"amplitude", "rate"}
    assert result["field_rmse"] is not None  # the field is that of its predictions
    expected = Decay().predict(
        np.array([[120.0, 0.2]]), built.water.truth().grid.points, np.full(10_000, 4.0)
    )
    np.testing.assert_allclose(record["field_true"].values.ravel(), expected[0])
    assert {path.stem for path in draw_run(record, tmp_path)} >= {
        "path",
        "learning_curve",
        "field_error",
        "course",
    }


def test_of_a_model_without_a_field_pictures_are_left_out_and_it_is_said(mission, tmp_path):
    record = recorded(mission(water=Fieldless(), episodes=2, evaluation_episodes=0))
    assert np.isnan(record["field_true"]).all()
    assert summarise(record)["field_rmse"] is None
    with pytest.warns(UserWarning, match="the model has no field") as said:
        drawn = draw_run(record, tmp_path)
    assert len(said) == 1
    assert {path.stem for path in drawn} == set(drawings(record))
    assert set(drawings(record)) == {"path", "learning_curve", "residuals", "convergence", "regions"}


def test_the_estimator_for_dear_models_serves_too(mission):
    record = recorded(mission(water=Decay(), estimator=Composite(), episodes=1, evaluation_episodes=0))
    assert np.isfinite(record["theta"]).all()


def test_the_vehicle_drifts_with_a_flow_of_one_s_own(mission):
    record = recorded(mission(water=InAnEddy(), agent=Drift(), episodes=1, evaluation_episodes=0))
    x, y = record["position"].values[0, 0].T - 50.0
    start = np.array(record["start"]) - 50.0
    angle = np.unwrap(np.arctan2(y, x)) - np.arctan2(start[1], start[0])
    np.testing.assert_allclose(np.hypot(x, y), np.hypot(*start), rtol=1e-6)
    np.testing.assert_allclose(angle, 0.1 * record["time"].values[0, 0], rtol=1e-6)
    assert record.attrs["domain_upper"] == [100.0, 80.0]


def test_still_water_holds_a_drifting_vehicle_where_it_is(mission):
    record = recorded(mission(water=Decay(), agent=Drift(), episodes=1, evaluation_episodes=0))
    np.testing.assert_array_equal(record["position"].values[0, 0], np.tile(record["start"], (4, 1)))


def test_derivatives_of_a_plain_model_are_used(mission):
    built = mission(water=Sloped(), agent=GreedyInformation(), episodes=1, evaluation_episodes=0)
    assert isinstance(built.water, Differentiable)
    assert not isinstance(mission(water=Decay()).water, Differentiable)
    assert np.isfinite(recorded(built)["theta"]).all()


def test_a_model_that_says_everything_stays_itself(mission):
    water = Advection()
    assert mission(water=water).water is water


def test_what_is_no_model_is_refused_by_what_it_lacks(mission):
    with pytest.raises(InvalidValue, match="it lacks parameters, predict"):
        mission(water=UniformFlow())


@pytest.mark.parametrize(
    ("part", "key"), [({"scenario": Drawn()}, "scenario"), ({"observation": Informed()}, "observation")]
)
def test_what_a_plain_model_cannot_serve_is_refused_by_name(mission, part, key):
    with pytest.raises(InvalidValue, match="pde=advection") as error:
        mission(water=Decay(), **part)
    assert error.value.key == key


def test_a_flow_that_nobody_can_ask_is_refused(mission):
    class Odd(Decay):
        class flow:
            velocity = 3

    with pytest.raises(InvalidValue, match=r"water\.flow.*\(theta, x, y, t\)"):
        mission(water=Odd())
