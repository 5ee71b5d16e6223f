"""The paper: its figures, tables and claims, beside what is measured; ``make paper`` makes all of it.

A pipeline of the paper has ``plan``, the runs that it wants, and ``make``, which draws from their records
alone; ``listing`` has all of them.

- ``advection``: the first experiment beside the paper, and what changes with estimator, reward and agent
- ``animation``: an episode under the double gyre as an animation
- ``claim``: a claim of the paper, and what speaks for or against it
- ``claims``: every claim of the paper's results section, beside what was measured, with a verdict by rule
- ``claims_advection``: claims about the first experiment: total error, estimate, learning curves
- ``claims_behaviour``: claims about what the trained vehicle does
- ``claims_diffusion``: the claim that diffusion is needed for numerical reasons
- ``claims_gyres``: claims about the second experiment: learned parameters, best episode, errors
- ``companions``: runs beside the learner's: agents that learn nothing, and no diffusion
- ``convergence``: convergence of the Bayesian optimisation, and what sharing solves saves
- ``evidence``: what replicates say of a median: sign tests, intervals, detectable effects
- ``figure_2``: Figure 2: how tile coding represents a state of two variables, drawn from our own tile coder
- ``figure_3``: Figure 3: total error and return while step size, trace decay and epsilon are varied
- ``figure_3_drawing``: the search behind figure 3 as a picture
- ``figure_3_search``: which settings that the paper leaves unsaid reproduce figure 3: a search
- ``figure_3_settings``: figure 3's trends at settings that the paper leaves unsaid, beside chance
- ``figure_3_space``: the settings that are searched, and between which values
- ``figure_3_trends``: the trends of figure 3, and a score of them
- ``figure_4``: Figure 4: paths over the feature's level sets, and the estimated feature
- ``figure_5``: Figure 5: the feature spreads under the double gyre, with streamlines, at several times
- ``figure_6``: Figure 6: paths under the double gyre in several episodes
- ``gyres``: what the figures of the second experiment share
- ``information``: what samples are worth, whatever was measured: Fisher information of a path
- ``inverse_crime``: what is owed to a true field that comes from the very model that is fitted
- ``landscape``: the misfit over (mu, omega): local minima, and the points that were solved
- ``learned``: Table 2 with its spread: mu and omega of every replicate
- ``learning``: what learning changes: the paper's learner beside a random agent
- ``listing``: every pipeline of the paper, and all of them made together with the page
- ``page``: the page outputs/paper/index.html, one file that needs no other
- ``position_errors``: what errors of the measured positions, Eq. (14) with Sigma > 0, do to the estimates
- ``readme``: bring the claims and the picture in README.md and docs/paper.md up to date with outputs/paper
- ``rules``: the rules by which a claim is judged: from numbers alone, the same rules for all claims
- ``table_1``: Table 1: the actions of the vehicle, and how far each takes it within one step in still water
- ``table_2``: Table 2: the learned parameters of the double gyre, with their spread, and what they cost
- ``variations``: the runs of figures 3 and 4: step size, trace decay and epsilon, one varied at a time
"""
