"""Figures of designs, and limits of robots whose controller is not known."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import excitation as ex
from axisight import load_robot
from axisight.cli import app
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.excitation.plots import plot_optimal_spectrum, plot_references, plot_signal

ROBOT = load_robot("irb6600_like")
STEP = ROBOT.sample_time_s


def test_lines_are_told_apart() -> None:
    signal = ex.multisine(0.5, STEP, band_hz=(2.0, 40.0), grid="odd_random", seed=1)
    with_snow = ex.optimize_crest_factor(signal, starts=1, snow_lines=[41], refinement="none")
    figure = plot_signal(with_snow.signal)
    time, histogram, spectrum = figure.axes
    drawn = {line.get_label(): line for line in spectrum.get_lines()}
    np.testing.assert_allclose(drawn["excited"].get_xdata(), signal.frequency_hz)
    np.testing.assert_allclose(drawn["excited"].get_ydata(), signal.amplitude, rtol=1e-9)
    free = drawn["left free for detection"]
    np.testing.assert_allclose(free.get_xdata(), signal.detection_lines / 0.5)
    np.testing.assert_allclose(free.get_ydata(), 0, atol=1e-9)
    assert drawn["snow"].get_xdata() == [82.0]
    assert f"{with_snow.signal.crest_factor:.3f}" in histogram.get_title()
    assert len(time.get_lines()[0].get_xdata()) == signal.n_samples


@pytest.mark.parametrize(
    "signal",
    [ex.prbs(STEP, bits=6), ex.chirp(0.5, STEP, band_hz=(2.0, 40.0)), ex.triangle(0.5, STEP)],
)
def test_every_kind_is_drawn(signal: ex.PeriodicSignal) -> None:
    assert f"{signal.crest_factor:.3f}" in plot_signal(signal).axes[1].get_title()


def test_references_are_a_matrix_of_inputs_and_experiments() -> None:
    made = ex.references(ex.multisine(0.1, STEP, lines=[1, 2]), 2, directions="hadamard")
    panels = plot_references(made).axes
    for i in range(2):
        for e in range(2):
            line = panels[2 * i + e].get_lines()[0]
            np.testing.assert_array_equal(line.get_ydata(), made.period[e, :, i])
    with pytest.raises(InputError, match="references: expected References, got str"):
        plot_references("x")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="signal: expected Multisine or PeriodicSignal"):
        plot_signal(made)  # type: ignore[arg-type]


def test_command_draws(tmp_path: Path) -> None:
    command = ["excite", "--robot", "irb6600_like", "--period-s", "0.5", "--band-hz", "2,40"]
    command += ["--peak-rad-s", "8", "--phases", "random", "--out", str(tmp_path / "x.csv")]
    result = CliRunner().invoke(app, [*command, "--plot", str(tmp_path / "p.png")])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "p.png").stat().st_size > 0
    assert (tmp_path / "p-references.png").stat().st_size > 0
    bad = CliRunner().invoke(app, [*command, "--plot", str(tmp_path / "p.xyz")])
    assert bad.exit_code == 2


def uncontrolled() -> str:
    """The preset without its controller."""
    lines = ROBOT.toml.splitlines()
    first = lines.index("[controller]")
    last = next(i for i in range(first + 1, len(lines)) if lines[i].startswith("["))
    return "\n".join([*lines[:first], '[controller]\nkind = "none"', *lines[last:]])


@pytest.fixture
def free(tmp_path: Path):
    (tmp_path / "robot.toml").write_text(uncontrolled())
    return load_robot(tmp_path / "robot.toml")


@pytest.mark.parametrize("period_s", [1.0, 8.0])  # inertia rules, then friction counts
def test_torque_without_a_controller_is_that_of_the_rigid_robot(free, period_s) -> None:
    """One axis moves by a slow sine about rest: J(q) + J_m, gravity and friction by hand."""
    signal = ex.multisine(period_s, STEP, lines=[1], phases=[np.pi / 2]).scaled(peak=4.0)
    made = ex.references(signal, 3)
    report = ex.check_limits(made, free, ex.Limits(torque_nm=1e4), periods=1)
    assert report.ok and report.method == "inverse_dynamics" and report.compared == ("torque",)
    assert "no controller is known" in str(report)
    rate = 4.0 * 2 * np.pi / period_s
    largest = report.largest.sel(experiment=1)
    assert largest.sel(quantity="velocity", axis=1) == pytest.approx(4.0, rel=1e-3)
    assert largest.sel(quantity="acceleration", axis=1) == pytest.approx(rate, rel=1e-3)
    # Axis 1 is vertical: no gravity; its own motion only, A w and A 90 degrees apart.
    rest = free.equilibrium()["joint_angle_rad"].values
    joint = free.axis_joints[0]
    ratio = free.gear_ratio[0]
    known = free.parameters()
    name = free.joint_names[joint]
    inertia = known[f"{name}.motor_inertia"]
    inertia += ratio**2 * free.inertia_matrix(rest)[joint, joint]
    expected = np.hypot(inertia * rate, known[f"{name}.viscous_friction"] * 4.0)
    assert largest.sel(quantity="torque", axis=1) == pytest.approx(expected, rel=2e-3)
    # The others hold their load.
    held = np.abs(free.equilibrium()["motor_torque_nm"].values[1:])
    at_rest = largest.sel(quantity="torque").values[1:]
    np.testing.assert_allclose(at_rest, held, rtol=0.1)


def test_the_closed_loop_asks_for_about_the_same(free) -> None:
    """Far below the resonances feedback and elasticity change little."""
    signal = ex.multisine(4.0, STEP, lines=[1], phases=[0.0]).scaled(peak=4.0)
    made = ex.references(signal, 3)
    rigid, loop = (
        ex.check_limits(made, robot, ex.Limits(), periods=2, model="linear").largest
        for robot in (free, ROBOT)
    )
    at = {"quantity": "torque", "experiment": 2, "axis": 2}
    assert rigid.sel(at) == pytest.approx(float(loop.sel(at)), rel=0.3)


def test_limits_that_are_passed_and_effects_that_cannot_be(free) -> None:
    made = ex.references(ex.multisine(0.5, STEP, band_hz=(2.0, 40.0)).scaled(peak=8.0), 3)
    report = ex.check_limits(made, free, ex.Limits(torque_nm=1.0), periods=1)
    assert not report.ok and "torque" in str(report)
    effect = Effect("coulomb_friction", 1, {})
    with pytest.raises(InputError, match="effects: expected none"):
        ex.check_limits(made, free, ex.Limits(), effects=[effect])


def test_a_report_says_what_was_compared() -> None:
    made = ex.references(ex.multisine(0.5, STEP, lines=[1]).scaled(peak=1.0), 3)
    none = ex.check_limits(made, ROBOT, ex.Limits(), periods=1, model="linear")
    assert none.ok and str(none) == "no limits given: nothing was compared"
    some = ex.check_limits(made, ROBOT, ex.Limits(torque_nm=1e4), periods=1, model="linear")
    assert str(some) == "within the limits given: torque"


def test_snow_and_response_say_why_not() -> None:
    signal = ex.multisine(0.5, STEP, lines=[1, 3])
    with pytest.raises(InputError, match="the response is known at the excited lines only"):
        ex.optimize_crest_factor(signal, snow_lines=[5], response=[1.0, 2.0])


def test_optimal_spectrum_is_drawn_against_the_flat_one() -> None:
    robot = load_robot("two_mass_axis")
    flat = ex.multisine(2.0, robot.sample_time_s, band_hz=(1.0, 30.0)).scaled(rms=1.0)
    found = ex.optimal_spectrum(robot, flat, "axis1.stiffness")
    above, below = plot_optimal_spectrum(found).axes
    before, after = (line.get_ydata() for line in above.lines)
    assert np.sum(before) == pytest.approx(1.0)
    assert np.sum(after) == pytest.approx(1.0)
    assert np.max(after) > 3 * np.max(before)
    assert np.max(below.lines[0].get_ydata()) < 1.01
    with pytest.raises(InputError, match="found"):
        plot_optimal_spectrum(flat)  # type: ignore[arg-type]
