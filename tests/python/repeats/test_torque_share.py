"""The torque of a change that no other parameter could give."""

import numpy as np
import pytest

from axisight.repeats.columns import Columns
from axisight.repeats.parameter_changes import torque_per_unit


def test_it_is_what_is_left_of_a_column_beside_the_others():
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(1, 200, 1, 3))
    matrix[..., 1] = matrix[..., 0] + 0.1 * matrix[..., 2] + 0.01 * matrix[..., 1]
    names = ("a", "b", "c")
    columns = Columns(names, names, (1, 1, 1), matrix, np.zeros((1, 200, 1)), np.zeros(3))
    found = torque_per_unit(columns, np.ones((200, 1)), np.array([2.0]))
    x = matrix[0, :, 0]
    for i in range(3):
        others = np.delete(x, i, axis=1)
        left = x[:, i] - others @ np.linalg.lstsq(others, x[:, i], rcond=None)[0]
        assert found[i] == pytest.approx(np.sqrt(np.mean(left**2)) / 2.0, rel=1e-9)
