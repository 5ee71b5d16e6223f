"""Flows: one file each; what a flow of your own needs is in ``contract``."""

from fieldrl.pde.flow.contract import Flow, Separable
from fieldrl.pde.flow.double_gyre import DoubleGyre
from fieldrl.pde.flow.gridded import GriddedFlow
from fieldrl.pde.flow.rotated import Rotated
from fieldrl.pde.flow.rotation import SolidRotation
from fieldrl.pde.flow.scaled import Scaled
from fieldrl.pde.flow.shear import Shear
from fieldrl.pde.flow.sum import Sum
from fieldrl.pde.flow.taylor_green import TaylorGreen
from fieldrl.pde.flow.uniform import UniformFlow
from fieldrl.pde.flow.vortices import Vortices

__all__ = [
    "DoubleGyre",
    "Flow",
    "GriddedFlow",
    "Rotated",
    "Scaled",
    "Separable",
    "Shear",
    "SolidRotation",
    "Sum",
    "TaylorGreen",
    "UniformFlow",
    "Vortices",
]
