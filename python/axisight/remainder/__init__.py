"""A remainder that is modelled: smooth functions for the torque that no law of the library explains."""

from axisight.remainder.fitting import fit_remainder
from axisight.remainder.judgement import ModelledRemainder
from axisight.remainder.model import Remainder
from axisight.remainder.records import Motion, Record
from axisight.remainder.running import RunningRemainder, last_way
from axisight.remainder.table_file import load_remainder, save_remainder
from axisight.remainder.terms import Term

__all__ = [
    "ModelledRemainder",
    "Motion",
    "Record",
    "Remainder",
    "RunningRemainder",
    "Term",
    "fit_remainder",
    "last_way",
    "load_remainder",
    "save_remainder",
]
