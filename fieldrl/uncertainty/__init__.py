"""How far an estimate may be trusted, and what the samples do not tell. Pure functions."""

from fieldrl.uncertainty.assessment import Assessment, assess
from fieldrl.uncertainty.draws import draws
from fieldrl.uncertainty.fields import field_std
from fieldrl.uncertainty.noise import Noise, noise_of
from fieldrl.uncertainty.regions import Regions, regions
from fieldrl.uncertainty.verdict import verdict

__all__ = [
    "Assessment",
    "Noise",
    "Regions",
    "assess",
    "draws",
    "field_std",
    "noise_of",
    "regions",
    "verdict",
]
