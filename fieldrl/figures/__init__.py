"""Pictures of records: pure functions, they never simulate."""

from fieldrl.figures.convergence import convergence_figure
from fieldrl.figures.fields import field_error_figure
from fieldrl.figures.learning import learning_curve_figure
from fieldrl.figures.paths import path_figure
from fieldrl.figures.run import draw_run

__all__ = ["convergence_figure", "draw_run", "field_error_figure", "learning_curve_figure", "path_figure"]
