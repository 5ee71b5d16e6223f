"""The contest: every agent against every other; ``make contest`` holds it.

- ``cases``: agents, places and scales
- ``figures``: the contest as pictures
- ``learning_curve``: return and error by episode, paid by information and by Eq. 19
- ``missions``: training and test missions of a case, in parts that are kept
- ``page``: the page outputs/contest/index.html
- ``readme``: tables and pictures for the docs
- ``statistics``: shares with their intervals, medians, comparisons
"""
