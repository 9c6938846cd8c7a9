"""Limits checked in simulation; files; the command."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
from typer.testing import CliRunner

from axisight import load_robot, simulate
from axisight.cli import app
from axisight.errors import InputError
from axisight.excitation import (
    Limits,
    References,
    check_limits,
    excite,
    multisine,
    read_design,
    read_references,
    references,
    write_references,
)

ROBOT = load_robot("irb6600_like")
DESIGN = """
robot = "irb6600_like"
directions = "t2"
[signal]
period_s = 0.5
band_hz = [2.0, 40.0]
peak_rad_s = 8.0
starts = 2
[square]
amplitude_rad_s = 9.6
period_s = 0.5
[limits]
velocity_rad_s = 100.0
acceleration_rad_s2 = 5000.0
torque_nm = [90.0, 100.0, 90.0]
periods = 1
"""


def made(peak: float = 8.0) -> References:
    signal = multisine(0.5, ROBOT.sample_time_s, band_hz=(2.0, 40.0)).scaled(peak=peak)
    return references(signal, 3)


def test_nothing_exceeded() -> None:
    report = check_limits(made(), ROBOT, Limits(1e3, 1e6, 1e4), periods=1, model="linear")
    assert report.ok and str(report) == "within all limits"
    assert report.largest.sel(quantity="reference_velocity", experiment=1, axis=1) == pytest.approx(
        8.0, rel=2e-3
    )
    # One axis at a time: the reference of the others is zero.
    assert report.largest.sel(quantity="reference_velocity", experiment=1, axis=2) == 0


def test_what_exceeds_where_and_when() -> None:
    given = made()
    run = simulate(ROBOT, given.period[1])
    torque = np.abs(run["torque_cmd_nm"].values[:, 1])
    limit = 0.9 * torque.max()
    report = check_limits(given, ROBOT, Limits(torque_nm=[1e4, limit, 10.0]), periods=1)
    found = next(e for e in report.excesses if (e.experiment, e.axis) == (2, 2))
    assert not report.ok and found.quantity == "torque" and found.axis == 2
    # Batches run in lock-step with shared steps: equal to the tolerance of the integrator.
    assert found.largest == pytest.approx(torque.max(), rel=1e-4)
    assert found.at_s == pytest.approx(torque.argmax() * ROBOT.sample_time_s, abs=1e-3)
    assert found.first_s == pytest.approx(np.argmax(torque > limit) * ROBOT.sample_time_s, abs=1e-3)
    ratio = [e.largest / e.limit for e in report.excesses]
    assert len(ratio) > 1 and ratio == sorted(ratio, reverse=True)
    assert f"axis 2: torque {found.largest:.4g} Nm" in str(report)


def test_velocity_and_acceleration_of_a_slow_sine() -> None:
    # At 2 Hz, far inside the bandwidth of the loop, the motor follows: A and 2 pi f A.
    signal = multisine(0.5, ROBOT.sample_time_s, lines=[1], phases=[0.0]).scaled(peak=5.0)
    report = check_limits(references(signal, 3), ROBOT, Limits(), periods=3, model="linear")
    largest = report.largest.sel(experiment=1, axis=1)
    assert largest.sel(quantity="velocity") == pytest.approx(5.0, rel=0.3)
    assert largest.sel(quantity="acceleration") == pytest.approx(5.0 * 4 * np.pi, rel=0.6)
    assert report.ok


def test_limits_are_checked() -> None:
    for limits, message in [
        (Limits(velocity_rad_s=-1.0), "limits.velocity_rad_s: expected positive"),
        (Limits(torque_nm=[1.0, 2.0]), "limits.torque_nm: expected 3"),
    ]:
        with pytest.raises(InputError, match=message):
            check_limits(made(), ROBOT, limits)
    other = references(multisine(1.0, 1e-3, band_hz=(1.0, 9.0)), 3)
    with pytest.raises(InputError, match="sample time of the robot"):
        check_limits(other, ROBOT, Limits())
    two = references(multisine(1.0, 5e-4, band_hz=(1.0, 9.0)), 2)
    with pytest.raises(InputError, match="expected 3 velocities"):
        check_limits(two, ROBOT, Limits())


@pytest.mark.parametrize("kind", ["csv", "mat", "parquet"])
def test_files_read_back_the_same(tmp_path: Path, kind: str) -> None:
    given = made()
    files = write_references(given, tmp_path / f"x.{kind}")
    assert len(files) == (2 if kind == "csv" else 1)
    back = read_references(tmp_path / f"x.{kind}")
    np.testing.assert_array_equal(back.period, given.period)
    np.testing.assert_array_equal(back.lines, given.lines)
    assert back.sample_time_s == given.sample_time_s and back.unit == "rad/s"
    assert back.design == given.design
    # The design alone makes the signal again.
    signal = back.design["broadband"]
    again = multisine(
        0.5,
        given.sample_time_s,
        lines=signal["lines"],
        amplitude=signal["amplitude"],
        phases=signal["phase_rad"],
    )
    np.testing.assert_array_equal(again.period, given.period[0, :, 0])


def test_files_are_plain_for_others(tmp_path: Path) -> None:
    given = made()
    write_references(given, tmp_path / "x.csv")
    table = pd.read_csv(tmp_path / "x.csv")
    assert list(table) == ["experiment", "time_s", *(f"velocity_ref_{a}" for a in (1, 2, 3))]
    write_references(given, tmp_path / "x.mat")
    content = scipy.io.loadmat(tmp_path / "x.mat")
    np.testing.assert_array_equal(content["period"], given.period)
    write_references(given, tmp_path / "x.parquet")
    assert list(pd.read_parquet(tmp_path / "x.parquet")) == list(table)


def test_damaged_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="ending in"):
        write_references(made(), tmp_path / "x.xlsx")
    write_references(made(), tmp_path / "x.csv")
    (tmp_path / "x.design.json").unlink()
    with pytest.raises(InputError, match="with their design"):
        read_references(tmp_path / "x.csv")
    for kind in ("mat", "parquet", "csv"):
        (tmp_path / f"y.{kind}").write_bytes(b"nonsense")
        with pytest.raises(InputError, match="with their design"):
            read_references(tmp_path / f"y.{kind}")


def test_command_writes_a_design_that_holds(tmp_path: Path) -> None:
    (tmp_path / "design.toml").write_text(DESIGN)
    out = tmp_path / "x.parquet"
    result = CliRunner().invoke(app, ["excite", str(tmp_path / "design.toml"), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "within all limits" in result.output
    back = read_references(out)
    assert back.n_experiments == 3
    # The file holds what it takes to make it again.
    again = excite(read_design(back.design["excite"])).references
    np.testing.assert_array_equal(again.period, back.period)


def test_command_refuses_what_breaks_limits(tmp_path: Path) -> None:
    (tmp_path / "design.toml").write_text(DESIGN)
    out = tmp_path / "x.csv"
    command = ["excite", str(tmp_path / "design.toml"), "--out", str(out), "--torque-limit", "1"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 1 and not out.exists()
    assert "torque" in result.output and "nothing was written" in result.output
    result = CliRunner().invoke(app, [*command, "--force"])
    assert result.exit_code == 0 and out.exists()


def test_command_with_options_only(tmp_path: Path) -> None:
    out = tmp_path / "x.csv"
    command = ["excite", "--robot", "irb6600_like", "--period-s", "0.5", "--band-hz", "2,40"]
    command += ["--peak-rad-s", "8", "--phases", "random", "--directions", "dft"]
    result = CliRunner().invoke(app, [*command, "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert json.loads((tmp_path / "x.design.json").read_text())["design"]["directions"] == "dft"


@pytest.mark.parametrize(
    "kind", ["chirp", "stepped_sine", "triangle", "prbs", "discrete_interval_binary"]
)
def test_every_kind_can_be_designed(kind: str) -> None:
    signal = {"kind": kind, "period_s": 0.5, "band_hz": [2.0, 10.0], "peak_rad_s": 8.0, "bits": 5}
    made = excite(read_design({"robot": "irb6600_like", "signal": signal}))
    assert made.signal.peak == pytest.approx(8.0, rel=2e-3)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        ({}, "signal.peak_rad_s"),
        ({"peak_rad_s": 1.0, "colour": 3}, "signal.colour"),
        ({"peak_rad_s": 1.0, "grid": "even"}, "signal.grid"),
        ({"peak_rad_s": 1.0, "band_hz": [1.0, 2.0]}, "signal.period_s: expected a value"),
        ({"peak_rad_s": 1.0, "period_s": 1.0, "kind": "chirp"}, "signal.band_hz: expected a value"),
    ],
)
def test_wrong_designs(signal: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        excite(read_design({"robot": "irb6600_like", "signal": signal}))


@pytest.mark.parametrize("option", ["--band-hz", "--square", "--velocity-limit", "--torque-limit"])
def test_the_command_names_the_option_that_is_no_list_of_numbers(tmp_path, option):
    out = tmp_path / "e.csv"
    result = CliRunner().invoke(app, ["excite", "--out", str(out), option, "2;4"])
    assert result.exit_code == 2 and not out.exists()
    text = " ".join(result.output.split())
    assert f"{option}: expected numbers separated by commas, got '2;4'" in text
