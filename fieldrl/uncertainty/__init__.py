"""How far an estimate may be trusted, and what the samples do not tell. Pure functions."""

from fieldrl.uncertainty.assessment import Assessment, assess, deviance_of
from fieldrl.uncertainty.noise import Noise, noise_of
from fieldrl.uncertainty.verdict import verdict

__all__ = ["Assessment", "Noise", "assess", "deviance_of", "noise_of", "verdict"]
