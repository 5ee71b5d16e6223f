"""Every figure and table of the paper, and the page that puts what was measured beside what was printed.

python -m pipelines.paper                  the paper's scale, 64 and 20 replicates
python -m pipelines.paper scale=small      seconds, for CI

What is finished is not computed again; see ``pipelines.experiments`` for the options.

Takes an hour and a half.
"""

from __future__ import annotations

from pipelines import experiments
from pipelines.paper.listing import make

if __name__ == "__main__":
    experiments.command(make)
