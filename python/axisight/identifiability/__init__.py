"""Information of an experiment on parameters, before any fit.

The Fisher information of a planned experiment is M = J^T W J, with J the Jacobian of the measurements
and W the inverse covariance of their noise. Each parameter has a scale on which a change matters,
usually its nominal value. For directions without information, sentences name the combination that
the data determine and the parameters that they do not determine alone.

All functions work on arrays. `of_regressor`, `of_fit` and `of_simulation` make them from other results
of Axisight, and `of_matrix` from any information matrix.
"""

from axisight.identifiability.assessment import Combination, Identifiability, identifiability
from axisight.identifiability.comparison import compare_experiments, recommend_experiments
from axisight.identifiability.effort import OptimalEffort, optimal_effort
from axisight.identifiability.information import Information, information, of_matrix
from axisight.identifiability.sources import (
    of_covariance,
    of_fit,
    of_log_information,
    of_regressor,
    of_simulation,
)

__all__ = [
    "Combination",
    "Identifiability",
    "Information",
    "OptimalEffort",
    "compare_experiments",
    "identifiability",
    "information",
    "of_covariance",
    "of_fit",
    "of_log_information",
    "of_matrix",
    "of_regressor",
    "of_simulation",
    "optimal_effort",
    "recommend_experiments",
]
