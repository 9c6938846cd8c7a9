"""The withheld-effect benchmark: machines of another engine, diagnoses that cannot see the truth, a score.

`axisight.blind.make` needs MuJoCo (extra ``blind``), the others nothing.
"""

from axisight.blind.score import Judged, Share, calibration_error, figures, judged_cases, markdown

__all__ = [
    "Judged",
    "Share",
    "calibration_error",
    "figures",
    "judged_cases",
    "markdown",
]
