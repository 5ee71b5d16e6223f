"""A vehicle in a field: environment, reward, learning, record. No input or output."""

from fieldrl.mission.learning import run_replicate
from fieldrl.mission.mission import Mission
from fieldrl.mission.record import combine
from fieldrl.mission.summary import summarise

__all__ = ["Mission", "combine", "run_replicate", "summarise"]
