"""How far an estimate may be trusted, and what the samples do not tell. Pure functions."""

from fieldrl.uncertainty.assessment import Assessment, assess, deviance_of
from fieldrl.uncertainty.draws import draws
from fieldrl.uncertainty.fields import field_std
from fieldrl.uncertainty.noise import Noise, noise_of
from fieldrl.uncertainty.verdict import verdict

__all__ = ["Assessment", "Noise", "assess", "deviance_of", "draws", "field_std", "noise_of", "verdict"]
