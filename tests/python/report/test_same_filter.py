"""Measured and simulated torque pass the same filter wherever they are drawn, and what is drawn is the gap."""

import re
from pathlib import Path

import numpy as np
import pytest
from test_computed_torque import arm
from test_explore_modes import SAMPLE, logs_of

from axisight import Settings, diagnose, plot_overlay
from axisight.gap.prepare.torque_clock import torque_clock, where_they_act
from axisight.logs import lowpass
from axisight.report import render_report


@pytest.fixture(scope="module", params=["inverse_dynamics", "positions"])
def found(request, tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("arm")
    robot = arm(folder, sample=SAMPLE)
    logs = logs_of(robot, targets=request.param == "positions")
    settings = Settings(max_causes=1)
    diagnosis = diagnose(
        robot=robot, estimation=logs[:2], validation=logs[2:], settings=settings, signals=True
    )
    if request.param == "positions":
        return diagnosis, logs[2]
    # The engine holds commands: torques are compared, and drawn, where they act.
    clock = torque_clock(robot, logs)
    assert clock is not None and any(clock.says() == check for check in diagnosis.checks)
    return diagnosis, where_they_act(logs, clock)[2]


def test_rms_that_is_drawn_is_the_gap_of_the_table(found):
    """Drawn curves have every sample of these logs: blocks of a gap that differ by one sample are the only rounding."""
    diagnosis, log = found
    block = int(Settings().block_s / log.sample_time_s)
    tables = (diagnosis.gap.before_per_axis, diagnosis.gap.after_per_axis)
    for overlay in diagnosis.overlays:
        assert len(overlay.time_s) == log.n_samples
        for error, table, told in zip(
            overlay.errors_nm, tables, (overlay.gap_before, overlay.gap_after), strict=True
        ):
            rms = np.sqrt(np.mean(np.nan_to_num(overlay.counted * error) ** 2))
            wanted = table[overlay.axis - 1]
            assert rms / overlay.torque_std_nm == pytest.approx(wanted, rel=1 / block)
            assert told == pytest.approx(wanted, rel=1e-12)


def test_curves_are_those_of_the_export_and_of_one_filter(found):
    diagnosis, log = found
    signals = diagnosis.signals[-1]
    for overlay in diagnosis.overlays:
        column = signals.sel(axis=overlay.axis)
        for name, curve in (
            ("measured_torque_nm", overlay.measured_nm),
            ("simulated_before_torque_nm", overlay.before_nm),
            ("simulated_after_torque_nm", overlay.after_nm),
        ):
            np.testing.assert_allclose(curve, column[name].values, rtol=1e-9, atol=1e-12)
        if diagnosis.mode == "inverse_dynamics":
            filtered = lowpass(log.torque_nm, log.sample_time_s, overlay.lowpass_hz)
            np.testing.assert_array_equal(overlay.measured_nm, filtered[:, overlay.axis - 1])


def test_the_filter_is_stated_where_curves_are_drawn(found):
    diagnosis, _ = found
    (cutoff,) = {o.lowpass_hz for o in diagnosis.overlays}
    stated = re.compile(r"low-pass of ([\d.]+) Hz")
    figure = plot_overlay(diagnosis, axis=1)
    page = " ".join(render_report(diagnosis).split())
    for text in (figure.get_suptitle(), page):
        assert float(stated.search(text)[1]) == pytest.approx(cutoff, rel=0.05)
    # The figure's rms is that of the table.
    said = figure.axes[1].get_legend().get_texts()[0].get_text()
    gap = float(re.search(r"gap (\S+) %", said)[1])
    assert gap == pytest.approx(100 * diagnosis.gap.before_per_axis[0], rel=0.05)
