"""The withheld-effect benchmark: it simulates machines in other engines and scores blind diagnoses.

Only `axisight.blind.make` needs MuJoCo and Pinocchio (extra ``blind``).
"""

from axisight.blind.calibration import calibration_error
from axisight.blind.comparison import comparison, comparison_table
from axisight.blind.score import Judged, Share, figures, judged_cases
from axisight.blind.summary import summary
from axisight.blind.table import markdown

__all__ = [
    "Judged",
    "Share",
    "calibration_error",
    "comparison",
    "comparison_table",
    "figures",
    "judged_cases",
    "markdown",
    "summary",
]
