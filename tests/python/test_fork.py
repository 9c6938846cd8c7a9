"""A process forked after the core had threads: its own do the work, with the same bits."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="systems that fork")

# The child is forked twice: its pool is of no use to the child that it has itself.
PROGRAM = """
import hashlib, os, sys
import numpy as np
from axisight import fitting, load_robot
from gap_data import logs_of

robot = load_robot("irb6600_like")
logs = logs_of(robot, ())

def digest():
    {work}

def child(depth):
    here = digest()
    assert here == first, (here, first)
    if depth:
        pid = os.fork()
        if pid == 0:
            child(depth - 1)
        assert os.waitpid(pid, 0)[1] == 0
    os._exit(0)

first = digest()
pid = os.fork()
if pid == 0:
    child(1)
assert os.waitpid(pid, 0)[1] == 0
assert digest() == first
print("done")
"""
