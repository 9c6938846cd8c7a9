"""Figures: what they show, and what they refuse."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import axisight
from axisight.errors import InputError
from diagnosis_data import VERDICTS, explained, of, one_prismatic

PLOTS = (axisight.plot_gap_map, axisight.plot_ranking, axisight.plot_overlay)


@pytest.mark.parametrize("verdict", VERDICTS)
@pytest.mark.parametrize("plot", PLOTS, ids=lambda p: p.__name__)
def test_every_verdict_can_be_drawn(plot, verdict, tmp_path):
    figure = plot(of(verdict))
    assert isinstance(figure, Figure)
    figure.savefig(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 5_000


def test_one_prismatic_axis_can_be_drawn(tmp_path):
    for plot in PLOTS:
        plot(one_prismatic()).savefig(tmp_path / "figure.png")


def test_labels_carry_units():
    top, bottom = axisight.plot_overlay(explained()).axes[:2]
    assert top.get_ylabel() == "motor torque [Nm]"
    assert bottom.get_xlabel() == "time [s]"
    assert axisight.plot_ranking(explained()).axes[0].get_xlabel() == "probability [%]"


def test_overlay_shows_the_arrays_it_was_given():
    diagnosis = explained()
    shown = axisight.plot_overlay(diagnosis, axis=2).axes[0].lines
    item = next(o for o in diagnosis.overlays if o.axis == 2)
    np.testing.assert_array_equal(shown[0].get_ydata(), item.measured_nm)
    np.testing.assert_array_equal(shown[2].get_ydata(), item.after_nm)


def test_every_number_of_a_cause_stands_over_itself_with_its_interval(tmp_path):
    diagnosis = explained()
    figure = axisight.plot_parameters(diagnosis)
    figure.savefig(tmp_path / "figure.png")
    axes = figure.axes[0]
    cause = diagnosis.causes[0]
    name, found = next((k, x) for k, x in cause.parameters.items() if x.low < x.high)
    assert axes.get_yticklabels()[0].get_text().startswith("Coulomb friction, axis 2: ")
    assert f"{found.value:.4g} [{found.low:.4g}, {found.high:.4g}] Nm" in axes.texts[0].get_text()
    drawn = axes.lines[1].get_xdata()
    np.testing.assert_allclose(drawn, [found.low / found.value, found.high / found.value])
    assert name.endswith("_nm")


def test_an_interval_that_holds_zero_has_no_end(tmp_path):
    diagnosis = explained()
    cause = diagnosis.causes[0]
    open_ = replace(cause, parameters={"sine_1_nm": axisight.gap.Interval(0.1, -0.4, 0.6)})
    axes = axisight.plot_parameters(replace(diagnosis, causes=(open_,))).axes[0]
    assert list(axes.lines[1].get_xdata()) == [0.0, 2.0]
    assert [line.get_marker() for line in axes.lines[3:]] == ["<", ">"]


def test_without_causes_there_are_no_parameters():
    with pytest.raises(InputError, match="expected causes with intervals, got none"):
        axisight.plot_parameters(of("none"))


def test_unknown_log_or_axis_is_refused():
    with pytest.raises(InputError, match="log: expected one of"):
        axisight.plot_overlay(explained(), log="no such log")
    with pytest.raises(
        InputError, match=r"axis: expected 1 to 3 or a joint name \(axis1, axis2, axis3\), got 9"
    ):
        axisight.plot_overlay(explained(), axis=9)


def test_simulation_and_log_have_a_row_per_axis():
    robot = axisight.load_robot("irb6600_like")
    run = axisight.simulate(robot, np.zeros((200, 3)))
    assert len(axisight.plot_simulation(run).axes) == 6
    with pytest.raises(InputError, match="position_rad"):
        axisight.plot_simulation(run.drop_vars("position_rad"))
    log = axisight.Log(
        name="run",
        source=Path("run.parquet"),
        sample_time_s=robot.sample_time_s,
        time_s=run.time.values,
        velocity_ref_rad_s=None,
        torque_nm=run.torque_cmd_nm.values,
        position_rad=run.position_rad.values,
    )
    figure = axisight.plot_log(log)
    assert [a.get_ylabel() for a in figure.axes[:2]] == ["torque 1 [Nm]", "position 1 [rad]"]
