"""Unit conversion: properties of every unit, against SI definitions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from axisight.errors import LogError
from axisight.logs import AxisColumns, ColumnMap, PositionColumn, TorqueColumn, VelocityColumn
from axisight.logs.gather import gather
from axisight.logs.units import si_factor, si_offset

finite = st.floats(-1e6, 1e6, allow_subnormal=False)
positive = st.floats(1e-3, 1e6)


@given(finite)
def test_angles_agree_with_the_standard_library(value):
    assert value * si_factor("deg") == pytest.approx(math.radians(value), rel=1e-15)
    assert value * si_factor("deg/s") == pytest.approx(math.radians(value), rel=1e-15)


@given(finite)
def test_turns_degrees_rpm_and_millimetres_are_consistent(value):
    close = {"rel": 1e-14, "abs": 1e-300}
    assert value * si_factor("rev") == pytest.approx(360 * value * si_factor("deg"), **close)
    assert value * si_factor("rpm") == pytest.approx(value * si_factor("rev/s") / 60, **close)
    assert value * si_factor("rpm") == pytest.approx(6 * value * si_factor("deg/s"), **close)
    assert 1000 * value * si_factor("mm") == pytest.approx(value * si_factor("m"), **close)


@given(st.floats(1.0, 1e7))
def test_counts_per_rev_counts_are_one_turn(counts):
    assert counts * si_factor("counts", counts) == pytest.approx(2 * math.pi, rel=1e-15)


def test_kelvin_unknown_units_and_counts_without_resolution():
    assert si_offset("K") == -273.15
    assert si_offset("degC") == 0.0
    with pytest.raises(LogError, match="got 'furlong'"):
        si_factor("furlong")
    with pytest.raises(LogError, match="counts_per_rev"):
        si_factor("counts")


@pytest.fixture(scope="module")
def ramp(tmp_path_factory):
    path = tmp_path_factory.mktemp("units") / "a.npz"
    np.savez(path, x=np.linspace(-1, 1, 50))
    return path


@given(scale=positive, sign=st.sampled_from([1, -1]), cpr=positive)
def test_scale_and_sign_act_on_every_kind_of_signal(ramp, scale, sign, cpr):
    axis = AxisColumns(
        position=PositionColumn(
            name="x", unit="counts", counts_per_rev=cpr, sign=sign, scale=scale
        ),
        torque=TorqueColumn(name="x", unit="A", scale=scale, sign=sign),
        velocity=VelocityColumn(name="x", unit="rpm", scale=scale, sign=sign),
    )
    signals = gather(ramp, ColumnMap(sample_rate_hz=100.0, axis=(axis,))).signals
    x = sign * scale * np.linspace(-1, 1, 50)
    np.testing.assert_allclose(signals["position", 0], x / cpr * 2 * np.pi, rtol=1e-13)
    np.testing.assert_allclose(signals["torque", 0], x, rtol=1e-13)
    np.testing.assert_allclose(signals["velocity", 0], x * np.pi / 30, rtol=1e-13)
