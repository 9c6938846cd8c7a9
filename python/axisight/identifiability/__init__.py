"""What an experiment tells of parameters, before anything is fitted.

The Fisher information of a planned experiment is M = J^T W J, with J the Jacobian of what will be
measured and W the inverse covariance of its noise. A parameter is judged on the scale on which a
change of it matters, as a rule its nominal value. Directions in which M has nothing to say are
put in words: which combination is seen, and which parameters are not, each for itself.

Everything works on arrays; `of_regressor`, `of_fit` and `of_simulation` make them from what
other parts of Axisight give, `of_matrix` from any information matrix.
"""

from axisight.identifiability.assessment import Combination, Identifiability, identifiability
from axisight.identifiability.comparison import compare_experiments, recommend_experiments
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
    "compare_experiments",
    "identifiability",
    "information",
    "of_covariance",
    "of_fit",
    "of_log_information",
    "of_matrix",
    "of_regressor",
    "of_simulation",
    "recommend_experiments",
]
