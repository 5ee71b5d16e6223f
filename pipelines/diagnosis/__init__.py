"""Why SARSA(lambda) does not learn from the paper's reward: controls, noise, what can be won.

- ``cases``: what is learned: controls whose answer is known, and the paper's reward
- ``chain``: a control that is no water: ten states in a row, paid at the end with noise
- ``coverage``: how much of the water, and of the agent's table, is seen in a run
- ``distance``: a reward for being near the feature, which knows the truth: for controls only
- ``drawing``: the diagnosis as pictures
- ``layouts``: returns of fixed paths, kept
- ``learners``: learning runs of the cases, kept; their value functions
- ``measured``: everything that the tables show, computed or found
- ``returns``: what fixed paths return: variance by path and by noise, the best of many paths
- ``tables``: the tables of the diagnosis: title, columns and rows of text
"""
