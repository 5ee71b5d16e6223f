"""An independent solver on the real problem: py-pde, second-order central differences."""

import numpy as np
import pytest

from fieldrl.pde.advection_diffusion import AdvectionDiffusion

pytest.importorskip("pde")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_py_pde_converges_to_our_solution_at_its_second_order():
    from pipelines.benchmarks import oracle

    model = AdvectionDiffusion(final_time=3.0)
    theta, errors = np.array(model.parameters.true), []
    for cells in ((100, 50), (200, 100)):
        theirs, _, _ = oracle.solve(model, theta, cells, backend="scipy")
        ours = model.field(theta, model.final_time, model.domain.grid(*cells))
        errors.append(np.sqrt(np.mean((theirs - ours) ** 2)))
    assert errors[1] < 0.07
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_both_ways_of_writing_it_for_py_pde_are_the_same_equation():
    from pipelines.benchmarks import oracle

    model, cells = AdvectionDiffusion(final_time=0.5), (40, 20)
    theta = np.array(model.parameters.true)
    by_hand, written = (
        oracle.solve(model, theta, cells, backend="scipy", equation=equation)[0]
        for equation in (oracle.GyreEquation, oracle.written)
    )
    np.testing.assert_allclose(written, by_hand, rtol=0, atol=1e-10)
