"""A process forked after the core had threads: its own do the work, with the same bits."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="systems that fork")

# The child has a child too: the threads of the first are of no use to the second.
PROGRAM = """
import os
import signal
import numpy as np
from axisight import Effect, load_robot
from axisight.fitting import fit, robot_parameter
from axisight.rigid_body import torque_regressor
from gap_data import PLAN, bare_axis, logs_of

axis, arm = bare_axis(), load_robot("irb6600_like")
logs = logs_of(axis, [Effect("coulomb_friction", 1, {"coulomb_nm": 0.4})], PLAN, seconds=2.0)
motion = np.sin(np.arange(21000.0)).reshape(3, 1000, 7)

def work():
    regressor = torque_regressor(arm, *motion).values
    fitted = fit(axis, logs, [robot_parameter(axis, "axis1.stiffness")])
    return regressor.tobytes(), float(fitted.loss).hex()

def in_a_child(depth):
    pid = os.fork()
    if pid == 0:
        # What waits for ever is ended.
        signal.alarm(40)
        same = work() == first
        if depth:
            in_a_child(depth - 1)
        os._exit(0 if same else 3)
    assert os.waitpid(pid, 0)[1] == 0

first = work()
in_a_child(1)
assert work() == first
print("the same bits")
"""


def test_a_forked_process_works():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*sys.path, str(Path(__file__).parent)])},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stdout == "the same bits\n", done.stderr
