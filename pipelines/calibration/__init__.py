"""Whether the intervals are true that fieldrl tells: missions whose truth is drawn from the bounds.

- ``blocks``: missions that are judged, in blocks that are kept
- ``cases``: one mission judged: what its intervals, regions and tests say, beside what is true
- ``drawing``: the calibration as a picture
- ``evidence``: what rows of judged missions say: coverage, ranks, efficiency, false alarms, power
- ``missions``: simulated missions: truth, path, samples, noise
- ``needed``: samples until every interval is narrow enough
- ``selection``: what choosing the best of many episodes does to its interval
- ``tables``: the tables of a calibration: title, columns and rows of text
- ``wrong``: true fields that the fitted model is wrong about, to see whether it is told
"""
