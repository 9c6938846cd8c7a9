"""Black-box models: ARX to Box-Jenkins, state space, closed-loop methods, rational fits of responses."""

from axisight.blackbox._data import fit_percent
from axisight.blackbox._model import StateSpaceModel
from axisight.blackbox.arx import ARXModel, arx
from axisight.blackbox.closed_loop.controller import indirect_response
from axisight.blackbox.closed_loop.expected_errors import (
    LimitingModel,
    asymptotic_variance,
    etfe_bias_bound,
    etfe_variance,
    expected_errors,
    input_spectra,
    limiting_model,
    noise_model_bias,
    wrong_controller_bias,
)
from axisight.blackbox.closed_loop.methods import (
    ClosedLoopEstimate,
    ClosedLoopEstimates,
    identify_closed_loop,
)
from axisight.blackbox.orders import arx_orders
from axisight.blackbox.output_error import OutputErrorModel, output_error
from axisight.blackbox.prediction_error.model import PolynomialModel
from axisight.blackbox.prediction_error.polynomial import armax, box_jenkins, polynomial_model
from axisight.blackbox.prediction_error.state_space import InnovationsModel, state_space_pem
from axisight.blackbox.rational import RationalModel, fit_rational, rational_orders
from axisight.blackbox.realization import Realization, realize
from axisight.blackbox.residuals import ResidualTests, residual_tests
from axisight.blackbox.subspace import SubspaceModel, state_space, state_space_orders

__all__ = [
    "ARXModel",
    "ClosedLoopEstimate",
    "ClosedLoopEstimates",
    "InnovationsModel",
    "LimitingModel",
    "OutputErrorModel",
    "PolynomialModel",
    "RationalModel",
    "Realization",
    "ResidualTests",
    "StateSpaceModel",
    "SubspaceModel",
    "armax",
    "arx",
    "arx_orders",
    "asymptotic_variance",
    "box_jenkins",
    "etfe_bias_bound",
    "etfe_variance",
    "expected_errors",
    "fit_percent",
    "fit_rational",
    "identify_closed_loop",
    "indirect_response",
    "input_spectra",
    "limiting_model",
    "noise_model_bias",
    "output_error",
    "polynomial_model",
    "rational_orders",
    "realize",
    "residual_tests",
    "state_space",
    "state_space_orders",
    "state_space_pem",
    "wrong_controller_bias",
]
