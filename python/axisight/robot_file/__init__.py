"""Write identified values with their uncertainty into robot files, and read them again.

This is not part of `axisight.robot`, because it uses the fits, and the fits use robots.
"""

from axisight.robot_file.document import (
    hash_file,
    load_identified,
    write_identified,
)
from axisight.robot_file.earlier import refuse_effects_beside
from axisight.robot_file.identified import Identified, Provenance, identified, identified_by_fit
from axisight.robot_file.sidecar import sidecar_path

__all__ = [
    "Identified",
    "Provenance",
    "hash_file",
    "identified",
    "identified_by_fit",
    "load_identified",
    "refuse_effects_beside",
    "sidecar_path",
    "write_identified",
]
