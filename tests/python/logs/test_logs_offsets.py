"""Zeros and ranges of position columns: an encoder's own zero, the middle of its range, normalised positions."""

import math

import numpy as np
import pytest

from axisight.errors import LogError
from axisight.logs import parse_column_map, read_log
from axisight.logs.sources import load_arrays
from columns_data import DEG, GEAR, motion, robot, write_lerobot

SIGNAL = 'name = "x", unit = '


def position(tmp_path, signal, **scalars):
    """Positions [rad] that a map with one signal reads from 0 to 4095 and back."""
    x = np.concatenate([np.arange(4096.0), np.arange(4095.0, -1.0, -1.0)])
    np.savez(tmp_path / "a.npz", x=x, **scalars)
    text = f"sample_rate_hz = 1000.0\n[[axis]]\nposition = {{ {SIGNAL}{signal} }}\n"
    text += 'torque = { name = "x", unit = "Nm" }\n'
    return x, read_log(tmp_path / "a.npz", parse_column_map(text)).position_rad[:, 0]


def test_an_offset_is_the_reading_at_zero_in_the_unit_of_the_column(tmp_path):
    """The encoder reads 2048 at zero: 3072 counts are a quarter of a turn."""
    x, q = position(tmp_path, '"counts", counts_per_rev = 4096, offset = 2048')
    np.testing.assert_allclose(q, (x - 2048) * 2 * np.pi / 4096, rtol=1e-13, atol=1e-15)
    assert q[3072] == pytest.approx(math.pi / 2)


def test_scale_and_sign_act_on_what_is_left(tmp_path):
    x, q = position(tmp_path, '"deg", offset = 2048, scale = 0.1, sign = -1')
    np.testing.assert_allclose(q, -0.1 * np.deg2rad(x - 2048), rtol=1e-13, atol=1e-15)


def test_an_offset_may_stand_in_the_file(tmp_path):
    x, q = position(tmp_path, '"deg", offset = "zero"', zero=1000.0)
    np.testing.assert_allclose(q, np.deg2rad(x - 1000.0), rtol=1e-13, atol=1e-15)
    with pytest.raises(LogError, match="expected a scalar named 'nil' in the file, got none"):
        position(tmp_path, '"deg", offset = "nil"')


def test_two_readings_with_their_positions_give_scale_and_zero(tmp_path):
    """The middle of the range is zero where the positions are symmetric."""
    x, q = position(tmp_path, '"deg", raw_range = [1024, 3072], unit_range = [-90, 90]')
    np.testing.assert_allclose(q, (x - 2048) * math.pi / 2048, rtol=1e-12, atol=1e-12)
    _, turned = position(tmp_path, '"deg", raw_range = [1024, 3072], unit_range = [90, -90]')
    np.testing.assert_allclose(turned, -q, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("signal", "words"),
    [
        ("raw_range = [0, 1]", "expected unit_range beside raw_range, got none"),
        ("unit_range = [0, 1]", "expected raw_range beside unit_range, got none"),
        ("raw_range = [2, 2], unit_range = [0, 1]", r"raw_range: expected two .*, got \[2, 2\]"),
        ("raw_range = [1, 2], unit_range = [1, 1]", r"unit_range: expected two .*, got \[1, 1\]"),
        ("raw_range = [1, 2], unit_range = [1, 3], scale = 2.0", "got scale beside them"),
        ("raw_range = [1, 2], unit_range = [1, 3], offset = 2.0", "got offset beside them"),
        ("raw_range = [1, 2], unit_range = [1, 3], sign = -1", "got sign beside them"),
        ("raw_range = [1], unit_range = [1, 3]", "raw_range"),
        ("raw_range = [1, inf], unit_range = [1, 3]", "raw_range 2: expected"),
        ("offset = nan", "offset: expected a finite number, got nan"),
    ],
)
def test_ranges_and_offsets_that_mean_nothing(tmp_path, signal, words):
    with pytest.raises(LogError, match=words):
        position(tmp_path, f'"deg", {signal}')


def test_only_positions_have_a_zero():
    axis = 'position = { name = "x", unit = "rad" }\n'
    head = "sample_rate_hz = 1000.0\n[[axis]]\n"
    for signal in ('torque = { name = "x", unit = "Nm"', 'velocity = { name = "x", unit = "rad/s"'):
        with pytest.raises(LogError, match="offset: expected a known key"):
            parse_column_map(f"{head}{axis}{signal}, offset = 1.0 }}\n")


def test_a_lerobot_of_degrees_has_a_map(tmp_path):
    folder = write_lerobot(tmp_path / "a", n_axes=6, scale=DEG)
    log = read_log(folder, "lerobot-degrees", robot=robot(6))
    np.testing.assert_allclose(log.position_rad, motion(6, 600)["position"] / GEAR, atol=1e-4)
    assert any("observation.state is taken for degrees" in note for note in log.notes)


def test_a_lerobot_of_shares_of_the_range_is_read_by_its_ranges(tmp_path):
    """SO-100 with positions from -100 to 100 between the ends of each joint's travel."""
    ends = np.array([1.9, 2.1])  # rad each way
    folder = write_lerobot(tmp_path / "a", n_axes=2, scale=100 / ends)
    axis = """
    [[axis]]
    position = {{ name = "observation.state[{k}]", unit = "deg", raw_range = [-100, 100], unit_range = [-{e}, {e}] }}
    position_ref = {{ name = "action[{k}]", unit = "deg", raw_range = [-100, 100], unit_range = [-{e}, {e}] }}
    """
    text = 'side = "joint"\ntime = { name = "timestamp" }\n'
    text += "".join(axis.format(k=k, e=float(np.rad2deg(ends[k]))) for k in range(2))
    log = read_log(folder, parse_column_map(text), robot=robot(2))
    np.testing.assert_allclose(log.position_rad, motion(2, 600)["position"] / GEAR, atol=1e-4)
    # Actions of these data are the positions plus 0.01 in the unit of the file.
    off = load_arrays(folder)["action[0]"] - load_arrays(folder)["observation.state[0]"]
    got = (log.position_ref_rad - log.position_rad)[:, 0] * GEAR
    np.testing.assert_allclose(got, off * ends[0] / 100, atol=1e-5)
