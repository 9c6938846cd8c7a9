"""The withheld-effect benchmark: machines of other engines, diagnoses that cannot see the truth, a score.

`axisight.blind.make` needs MuJoCo and Pinocchio (extra ``blind``), the others nothing.
"""

from axisight.blind.calibration import calibration_error
from axisight.blind.score import Judged, Share, figures, judged_cases
from axisight.blind.summary import summary
from axisight.blind.table import markdown

__all__ = [
    "Judged",
    "Share",
    "calibration_error",
    "figures",
    "judged_cases",
    "markdown",
    "summary",
]
