"""From recorded signals to PeriodicRecords: what comes out, what is said, what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import axisight
from axisight.errors import InputError
from axisight.records import (
    Experiment,
    FindingKind,
    clipped_samples,
    experiment_of_log,
    prepare_records,
)
from records_data import SAMPLE_TIME_S, experiment, late, mode, multisine

LINES = np.arange(2, 100)


def kinds(prepared):
    return {f.kind for f in prepared.findings}


def test_a_clean_record_comes_out_whole():
    run = experiment(n_periods=16, noise=1e-3)
    got = prepare_records([run], drift=False)
    assert got.period.n_samples == 1000
    np.testing.assert_array_equal(got.records.lines, LINES)
    assert kinds(got) == {FindingKind.PERIOD, FindingKind.LINES, FindingKind.TRANSIENT}
    assert not got.serious
    kept = 16 - got.dropped_periods
    assert 1 <= got.dropped_periods <= 6
    expected = run.output.reshape(16, 1000, 1)[got.dropped_periods :]
    np.testing.assert_array_equal(got.records.output[0], expected)
    assert got.records.reference.shape == (1, kept, 1000, 1)


def test_the_response_is_that_of_the_system():
    """After what (5.6) waits for, the ratio of DFTs is the system to what it was told to reach."""
    wait = axisight.records.waiting_time_s(
        axisight.records.mode_time_constant_s(20.0, 0.02), 1.0, 1e6
    )
    run = experiment()
    got = prepare_records([run], lines=LINES, period_s=1.0, waiting_time_s=wait, drop_periods=None)
    assert got.dropped_periods >= np.ceil(wait)
    u, y = (np.fft.rfft(s[0].mean(0)[:, 0]) for s in (got.records.input, got.records.output))
    system = mode()
    z = np.exp(2j * np.pi * LINES / 1000)[:, None, None]
    exact = (system.C @ np.linalg.solve(z * np.eye(2) - system.A, system.B[None]))[:, 0, 0]
    np.testing.assert_allclose(y[LINES] / u[LINES], exact, rtol=1e-5)


def test_given_period_and_lines_are_taken_without_words():
    got = prepare_records([experiment(noise=0.01)], period_s=1.0, lines=LINES, drop_periods=4)
    assert not got.findings
    assert (got.records.n_periods, got.dropped_periods) == (4, 4)


def test_without_a_reference_the_input_tells():
    run = replace(experiment(noise=0.01), reference=None)
    got = prepare_records([run])
    np.testing.assert_array_equal(got.records.lines, LINES)
    assert "found from the input" in got.findings[0].message
    assert got.records.reference is None


@pytest.mark.parametrize("period_s", [0.9995, 1.0004])
def test_a_given_period_that_is_not_whole_is_refused(period_s):
    with pytest.raises(InputError, match=r"expected a whole number of samples.*resample"):
        prepare_records([experiment()], period_s=period_s)


def test_a_wrong_whole_period_is_refused():
    with pytest.raises(InputError, match=r"repeat with the period|whole number"):
        prepare_records([experiment(noise=0.01)], period_s=0.999, lines=LINES, drop_periods=1)


def test_a_clock_that_runs_off_is_leakage():
    """The reference comes 0.0003 samples later each period: too little to refuse, said."""
    x = multisine(1000, LINES)
    rows = np.concatenate([late(x, 0.003 * p, LINES) for p in range(8)])
    got = prepare_records(
        [Experiment(SAMPLE_TIME_S, rows, rows, rows)], period_s=1.0, lines=LINES, drop_periods=0
    )
    (found,) = got.serious
    assert found.kind is FindingKind.LEAKAGE
    assert found.value == pytest.approx(0.003 * 8 * 2 * np.pi * 99 / 1000, rel=1e-3)
    assert "1000.00300" in found.message
    rows = np.concatenate([late(x, 0.3 * p, LINES) for p in range(8)])
    with pytest.raises(InputError, match=r"got 1000\.3"):
        prepare_records(
            [Experiment(SAMPLE_TIME_S, rows, rows, rows)], period_s=1.0, lines=LINES, drop_periods=0
        )


def test_a_lost_sample_is_leakage_with_its_period():
    run = experiment()
    reference = run.reference.copy()
    reference[6 * 1000 + 17] = 0.0
    got = prepare_records(
        [replace(run, reference=reference)], period_s=1.0, lines=LINES, drop_periods=4
    )
    (found,) = got.serious
    assert found.kind is FindingKind.LEAKAGE
    assert "period 3 of those kept" in found.message


def test_unequal_numbers_of_periods_keep_the_last():
    runs = [experiment(n_periods=8, noise=1e-3), experiment(n_periods=6, noise=1e-3, seed=1)]
    got = prepare_records(runs, drop_periods=2, drift=False)
    assert FindingKind.UNEQUAL in kinds(got)
    assert got.records.n_periods == 4
    np.testing.assert_array_equal(got.records.output[0, -1, :, 0], runs[0].output[7000:, 0])


def test_unequal_periods_are_refused():
    runs = [experiment(n=1000), experiment(n=800)]
    with pytest.raises(InputError, match=r"same for all experiments, got \[1000, 800\]"):
        prepare_records(runs)


def test_experiments_out_of_step_are_aligned():
    x = multisine(1000, LINES)
    runs = []
    for delay in (0.0, 321.25, -40.5):
        r = np.tile(late(x, delay, LINES), 5)
        runs.append(Experiment(SAMPLE_TIME_S, 2 * r, np.roll(r, 4), r))
    got = prepare_records(runs, synchronise=True, excitation=x, drop_periods=0, drift=False)
    np.testing.assert_allclose([d.samples for d in got.delays], [0, 321.25, -40.5], atol=1e-9)
    np.testing.assert_allclose(got.records.reference[..., 0], np.tile(x, (3, 4, 1)), atol=1e-10)
    np.testing.assert_allclose(
        got.records.output[..., 0], np.tile(np.roll(x, 4), (3, 4, 1)), atol=1e-10
    )
    assert [f.experiment for f in got.findings if f.kind is FindingKind.DELAY] == [2, 3]


def test_a_disturbed_period_is_named_and_kept():
    run = experiment(n_periods=20, noise=1e-3)
    output = run.output.copy()
    output[7300:7320] += 0.5
    got = prepare_records([replace(run, output=output)], drift=False)
    (found,) = [f for f in got.findings if f.kind is FindingKind.DISTURBED]
    assert "periods 8 differ" in found.message
    assert got.dropped_periods < 7


def test_drift_is_removed_and_said():
    run = experiment(noise=1e-3)
    drifting = replace(run, output=run.output + np.linspace(0, 8, 8000, endpoint=False)[:, None])
    got = prepare_records([drifting])
    (found,) = [f for f in got.findings if f.kind is FindingKind.DRIFT]
    assert found.value == pytest.approx(1.0, abs=1e-3)
    assert prepare_records([drifting], drift=False).dropped_periods >= 4


def test_few_periods_cannot_be_judged():
    for n_periods, serious in ((1, True), (2, False)):
        got = prepare_records(
            [experiment(n_periods=n_periods)], period_s=1.0, lines=LINES, drift=False
        )
        (found,) = got.findings
        assert (found.kind, found.serious) == (FindingKind.UNJUDGED, serious)


def test_a_cut_torque_is_said():
    run = experiment(noise=1e-3)
    cut = np.clip(run.input, -8.0, 8.0)
    got = prepare_records([replace(run, input=cut)])
    found = [f for f in got.findings if f.kind is FindingKind.CLIPPED]
    assert [f.signal for f in found] == ["input 1"]
    assert found[0].serious
    runs3 = np.abs(cut[:, 0]) == 8.0
    assert found[0].value == pytest.approx(runs3.mean(), rel=0.6)


@pytest.mark.parametrize("level", [0.0, 0.3])
def test_an_output_that_never_changes_is_said(level):
    """Its responses would be zero, as if the robot did not move; one that rests in a single run may be true."""
    run = experiment(noise=1e-3)
    dead = replace(run, output=np.column_stack([run.output, np.full(len(run.output), level)]))
    other = replace(run, output=np.column_stack([run.output, run.output]))
    got = prepare_records([dead, dead])
    (found,) = [f for f in got.findings if f.kind is FindingKind.DEAD]
    assert (found.signal, found.experiment, found.serious) == ("output 2", None, True)
    assert "expected it to change, got" in found.message
    got = prepare_records([other, dead])
    (found,) = [f for f in got.findings if f.kind is FindingKind.DEAD]
    assert (found.signal, found.experiment, found.serious) == ("output 2", 2, False)
    assert FindingKind.DEAD not in kinds(prepare_records([other, other]))


def test_flat_tops_that_are_meant_are_no_clipping():
    t = np.arange(4000)
    slow = np.sin(2 * np.pi * t / 1000)
    assert clipped_samples(np.round(slow * 2000) / 2000) == 0  # quantized: many equal at the top
    assert clipped_samples(np.sign(slow + 1e-9)) == 0  # binary
    trapezoid = np.clip(3 * slow, -1, 1)
    assert clipped_samples(trapezoid) > 1000
    assert clipped_samples(trapezoid, 5 * trapezoid) == 0  # asked for
    assert clipped_samples(np.clip(np.round(3 * slow * 2000) / 2000, -1, 1)) > 1000
    assert clipped_samples(np.random.default_rng(0).standard_normal(4000)) == 0


def test_a_log_is_an_experiment():
    run = experiment(n_periods=6, noise=1e-3)
    log = axisight.Log(
        name="run",
        source=Path("run.parquet"),
        sample_time_s=SAMPLE_TIME_S,
        time_s=np.arange(6000) * SAMPLE_TIME_S,
        velocity_ref_rad_s=run.reference,
        torque_nm=run.input,
        position_rad=run.output,
        period_s=1.0,
    )
    got = prepare_records([log], drop_periods=3, drift=False)
    np.testing.assert_array_equal(got.records.output[0], run.output.reshape(6, 1000, 1)[3:])
    with pytest.raises(InputError, match="has no joint_position"):
        experiment_of_log(log, output="joint_position")
    with pytest.raises(InputError, match="output: expected one of position"):
        experiment_of_log(log, output="torque")
    with pytest.raises(InputError, match="period_s: expected one"):
        prepare_records([log, replace(log, period_s=2.0)])


def broken(**changes):
    return [experiment(n_periods=4), replace(experiment(n_periods=4), **changes)]


@pytest.mark.parametrize(
    ("runs", "options", "message"),
    [
        ([], {}, "experiments: expected at least one"),
        (broken(sample_time_s=2e-3), {}, "sample_time_s: expected 0.001 as experiment 1"),
        (broken(reference=None), {}, "reference: expected 1 channels as experiment 1, got 0"),
        ([experiment(n_periods=4)], {"skip_s": -1.0}, "skip_s: expected a number not below zero"),
        ([experiment(n_periods=4)], {"period_s": 5.0}, "at most the shortest"),
        ([experiment(n_periods=4)], {"period_s": float("nan")}, "period_s: expected a positive"),
        (
            [experiment(n_periods=4)],
            {"drop_periods": -1},
            "drop_periods: expected a whole number from 0",
        ),
        ([experiment(n_periods=4)], {"drop_periods": 4}, "expected to keep a period"),
        ([experiment(n_periods=4)], {"waiting_time_s": 9.0}, "expected to keep a period"),
        ([experiment(n_periods=4)], {"lines": [1, 500]}, "Nyquist"),
        ([experiment(n_periods=4)], {"synchronise": True, "excitation": np.zeros(3)}, "excitation"),
    ],
)
def test_misuse_is_named(runs, options, message):
    with pytest.raises(InputError, match=message):
        prepare_records(runs, **options)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sample_time_s": 0.0}, "sample_time_s"),
        (
            {"output": np.full(4000, np.nan)},
            r"output: .*nan in sample 1, channel 1 \(4000 in all\)",
        ),
        ({"input": np.zeros((4000, 0))}, "input: expected axes"),
        ({"reference": np.zeros(3999)}, "reference: expected 4000 samples"),
    ],
)
def test_a_broken_experiment_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        replace(experiment(n_periods=4), **changes)
