"""Every argument of the records package, fed with what it was not made for."""

from pathlib import Path

import numpy as np
import pytest

from axisight import records as rec
from axisight.logs import Log
from records_data import SAMPLE_TIME_S, experiment, multisine
from strange_values import feed

N, LINES = 50, np.arange(2, 10)
RUN = experiment(n=N, n_periods=6, lines=LINES, noise=1e-3)
PERIODS = RUN.input.reshape(6, N, 1)
U = np.repeat(multisine(N, LINES)[None, None, :, None], 3, axis=1)
RECORDS = rec.PeriodicRecords(SAMPLE_TIME_S, U, 2 * U, LINES, reference=U)
LOG = Log(
    name="run",
    source=Path("run.parquet"),
    sample_time_s=SAMPLE_TIME_S,
    time_s=np.arange(RUN.n_samples) * SAMPLE_TIME_S,
    velocity_ref_rad_s=RUN.reference,
    torque_nm=RUN.input,
    position_rad=RUN.output,
)
# A given period has no repetition, a finding without a figure no value.
UNKNOWN = frozenset({"repetition", "value"})

CASES = {
    "ArbitraryRecords": (
        rec.ArbitraryRecords,
        {
            "sample_time_s": 1e-3,
            "input": np.ones((1, 7, 1)),
            "output": np.ones((1, 7, 2)),
            "input_unit": "Nm",
            "output_unit": "rad",
        },
    ),
    "PeriodicRecords": (
        rec.PeriodicRecords,
        {
            "sample_time_s": 1e-3,
            "input": U,
            "output": U,
            "lines": LINES,
            "reference": U,
            "input_unit": "Nm",
            "output_unit": "rad",
            "detection_lines": [1],
        },
    ),
    "Experiment": (
        rec.Experiment,
        {
            "sample_time_s": 1e-3,
            "input": np.ones(7),
            "output": np.ones((7, 2)),
            "reference": np.ones(7),
            "name": "x",
        },
    ),
    "experiment_of_log": (
        rec.experiment_of_log,
        {"log": LOG, "output": "position"},
    ),
    "clipped_samples": (rec.clipped_samples, {"signal": np.ones(7), "meant": np.ones(7)}),
    "drift_per_period": (rec.drift_per_period, {"signal": PERIODS}),
    "remove_drift": (rec.remove_drift, {"signal": PERIODS}),
    "estimate_delay": (
        rec.estimate_delay,
        {
            "signal": U[0, 0, :, 0],
            "excitation": U[0, 1, :, 0],
            "lines": LINES,
            "free_sign": True,
        },
    ),
    "reference_delays": (
        rec.reference_delays,
        {"records": RECORDS, "excitation": U[0, 0, :, 0]},
    ),
    "synchronise": (rec.synchronise, {"records": RECORDS, "excitation": U[0, 0, :, 0]}),
    "excited_lines": (rec.excited_lines, {"signal": U, "floor_db": -40.0}),
    "repeating_lines": (
        rec.repeating_lines,
        {"periods": PERIODS[:, :, 0], "significance": 1e-4},
    ),
    "find_period": (rec.find_period, {"signal": RUN.input}),
    "mode_time_constant_s": (
        rec.mode_time_constant_s,
        {"frequency_hz": 10.0, "damping_ratio": 0.1},
    ),
    "waiting_time_s": (
        rec.waiting_time_s,
        {"time_constant_s": 1.0, "record_s": 10.0, "signal_to_noise": 100.0},
    ),
    "steady_state": (
        rec.steady_state,
        {"signals": PERIODS, "last_line": 12, "significance": 0.01},
    ),
    "prepare_records": (
        rec.prepare_records,
        {
            "experiments": [RUN],
            "period_s": N * SAMPLE_TIME_S,
            "lines": LINES,
            "detection_lines": [1],
            "skip_s": 0.0,
            "waiting_time_s": 0.0,
            "drop_periods": None,
            "significance": 0.01,
            "drift": True,
            "synchronise": True,
            "excitation": U[0, 0, :, 0],
            "input_unit": "Nm",
            "output_unit": "rad",
        },
    ),
}
RESULTS = {"Delay", "ExcitedLines", "FindingKind", "Period", "Prepared", "RecordFinding"}
RESULTS |= {"SteadyState"}


@pytest.mark.parametrize("name", CASES)
def test_only_errors_of_ours_come_out(name):
    function, good = CASES[name]
    assert not (wrong := feed(function, good, UNKNOWN)), "\n".join(wrong)


def test_every_public_name_is_fed():
    assert set(rec.__all__) == set(CASES) | RESULTS


def test_a_line_both_excited_and_free_is_refused():
    with pytest.raises(ValueError, match=r"detection_lines: .*without excitation, got 3"):
        rec.PeriodicRecords(1e-3, U, U, [3, 5], detection_lines=[2, 3])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"skip_s": float("nan")}, "skip_s"),
        ({"waiting_time_s": float("inf")}, "waiting_time_s"),
        ({"lines": []}, "lines: expected at least one excited line"),
        ({"drop_periods": 1.5}, "drop_periods: expected a whole number"),
        ({"detection_lines": [1.5]}, "detection_lines: expected a list of whole numbers"),
    ],
)
def test_what_used_to_pass(options, message):
    with pytest.raises(ValueError, match=message):
        rec.prepare_records([RUN], **options)
