"""Benchmarks: how good and how fast solver, fits and runs are, beside others' and beside theory.

- ``botorch_fit``: BoTorch's composite expected improvement on a fit problem: a benchmark extra
- ``converged_folds``: converged fits of every fold, to judge estimators by
- ``cross_validation``: e_cv of the second experiment against converged refits of every fold
- ``environment_speed``: steps a second: one environment, Gymnasium's loop over many, and many at once
- ``estimates``: how well memory and time of a run are estimated
- ``fit_speed``: how fast the first experiment is: the fits against SciPy, and where a run's time goes
- ``fits``: how many solves a fit takes: every estimator for dear models on the same random fit problems
- ``flows``: what a flow costs: one solve on the experiment's grid, built-in and of one's own
- ``global_minimum``: whether fits are global minima: LeastSquares against SciPy from 32 starts
- ``interval_cost``: what intervals, regions and the field's standard deviation cost a run
- ``location_finding``: a public yardstick: two sources in the plane, beside the published numbers of others
- ``oracle``: the double gyre in py-pde, to compare the solver with
- ``performance_profile``: the share of problems that a method has solved, against the solves it took
- ``placing``: where the next sensor goes: the strategies of ``location_finding``
- ``recovery``: whether unknowns are found again: every kind, random truths, in both experiments
- ``reduced_model``: the reduced-order model of the double gyre beside full solves: error, speed, estimates
- ``run_cost``: what checkpoints and tracking cost a run
- ``solver``: how good and how fast the solver is, beside py-pde
- ``sources``: two sources in the plane: the model of ``location_finding``, and bounds of information
- ``sweep_cost``: what a sweep costs beside its runs
- ``unknowns``: how estimators for dear models cope with one to six unknowns
"""
