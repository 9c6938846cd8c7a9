"""Black-box models: ARX, output error, state space, rational fits of frequency responses."""

from axisight.blackbox._data import fit_percent
from axisight.blackbox._model import StateSpaceModel
from axisight.blackbox.arx import ARXModel, arx
from axisight.blackbox.orders import arx_orders
from axisight.blackbox.output_error import OutputErrorModel, output_error
from axisight.blackbox.rational import RationalModel, fit_rational, rational_orders
from axisight.blackbox.realization import Realization, realize
from axisight.blackbox.residuals import ResidualTests, residual_tests
from axisight.blackbox.subspace import SubspaceModel, state_space, state_space_orders

__all__ = [
    "ARXModel",
    "OutputErrorModel",
    "RationalModel",
    "Realization",
    "ResidualTests",
    "StateSpaceModel",
    "SubspaceModel",
    "arx",
    "arx_orders",
    "fit_percent",
    "fit_rational",
    "output_error",
    "rational_orders",
    "realize",
    "residual_tests",
    "state_space",
    "state_space_orders",
]
