"""The experiment that separates two causes: within what was seen, decisive, and honest where none is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight import Diagnosis, Effect, Log, Settings, diagnose
from axisight.cli import app
from axisight.excitation import read_references
from axisight.gap.facts.experiment import Experiment
from axisight.gap.fit.data_blocks import layout_of
from axisight.gap.fit.fitted_model import Hypothesis
from axisight.gap.separate.design import designed
from axisight.gap.separate.loop_route import LoopRoute
from axisight.gap.separate.question import Seen
from axisight.gap.separate.rivals import Rivals
from axisight.gap.separate.waves import SECONDS, motions, seen_range, standard
from axisight.gap.views.closed_loop import ClosedLoopView
from axisight.logs import lowpass
from gap_data import bare_axis, bare_case, log_of, scattered


def one_way(seed: int, n: int, sample_time_s: float) -> np.ndarray:
    """A motor that turns one way, not quite evenly: friction and an offset look alike."""
    time = np.arange(n) * sample_time_s
    lines = np.arange(1.0, 12.0, 0.5)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    wave = np.cos(2 * np.pi * np.outer(time, lines) + phases).sum(axis=1)
    return (np.minimum(time / 0.1, 1.0) * (10.0 + 2.0 * wave / np.abs(wave).max()))[:, None]


FRICTION = Effect("coulomb_friction", 1, {"coulomb_nm": 0.02, "smoothing_rad_s": 0.1})
OFFSET = Effect("torque_offset", 1, {"offset_nm": -0.02})
MACHINE = scattered(bare_axis(), 4)


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    n = round(3 / MACHINE.sample_time_s)
    references = [one_way(s, n, MACHINE.sample_time_s) for s in (1, 2, 3)]
    return [log_of(MACHINE, [FRICTION], r, k) for k, r in enumerate(references)]


@pytest.fixture(scope="module")
def open_case(logs: list[Log]) -> Diagnosis:
    return diagnose(robot=bare_axis(), estimation=logs[:2], validation=logs[2:], separate=True)


@pytest.fixture(scope="module")
def view(logs: list[Log]) -> ClosedLoopView:
    return ClosedLoopView(bare_axis(), logs[:2], Settings())


def rivals(view: ClosedLoopView, one: Effect, other: Effect) -> Rivals:
    free = [Hypothesis(e, (next(iter(e.parameters or {})),)) for e in (one, other)]
    models = (view.fitter.fit(free[:1]), view.fitter.fit(free[1:]))
    bare = view.fitter.fit([])
    samples = layout_of(bare).samples()
    to_explain = np.maximum(layout_of(bare).by_axis(bare.loss) / samples - view.floor.expected, 0.0)
    return Rivals(
        (one.label, other.label), models, samples, to_explain, view.settings.smallest_gain
    )


def separating_of(view: ClosedLoopView, both: Rivals) -> Experiment:
    return designed(LoopRoute(view), both)


def test_what_is_open_is_decided_by_the_experiment(open_case: Diagnosis, logs: list[Log]):
    """Recovery from known truth: undecidable before, the truth and nothing else after."""
    assert open_case.verdict == "undecidable"
    assert set(open_case.equivalent[0]) >= {"coulomb_friction@1", "torque_offset@1"}
    made = open_case.experiment
    assert made is not None
    assert made.decides
    assert made.rivals == ("coulomb_friction@1", "torque_offset@1")
    assert open_case.next_experiment == str(made)
    group = next(g for g in open_case.equivalent if open_case.causes[0].label in g)
    assert open_case.causes[0].rivals == group[1:]
    reference = made.references.period[0]
    new = [log_of(MACHINE, [FRICTION], reference, 7 + k) for k in range(made.repeats)]
    after = diagnose(robot=bare_axis(), estimation=[*logs[:2], *new], validation=logs[2:])
    assert (after.verdict, [c.effect for c in after.causes]) == ("explained", ["coulomb_friction"])
    # What friction of both ways may be besides, which nobody asked about, shares what is left.
    assert all(a.label != "torque_offset@1" for a in after.alternatives)
    assert after.causes[0].probability > 0.8


def test_friction_and_an_offset_differ_where_a_motor_turns_round(view: ClosedLoopView):
    """Closed form: one way they are the same torque; of a square of both ways each misses the other's
    by all of it for half of the time at the least."""
    made = separating_of(view, rivals(view, FRICTION, OFFSET))
    # The motor turns both ways for as long.
    way = np.sign(made.references.period[0, :, 0])
    assert abs(way.mean()) < 0.2
    assert made.decides
    assert made.repeats == 2


def test_a_cause_is_not_told_from_itself(view: ClosedLoopView):
    made = separating_of(view, rivals(view, FRICTION, FRICTION))
    assert made.log_ratio < 1e-3
    assert not made.decides


def test_runs_that_hardly_show_the_cause_count_for_less(view: ClosedLoopView):
    """As many runs as samples of the logs, half of all: 0.4 above the noise there are 0.2 in the whole, 4 times
    what a cause needs; 0.05 are a quarter of twice that."""
    both = rivals(view, FRICTION, OFFSET)
    n = float(both.samples[0])

    def worth(there: float) -> float:
        # The other leaves half of it: the log-ratio is the same whatever the size.
        return both.worth([Seen(np.array([0.5 * there]), np.array([there]), n)] * 2)

    shares = (0.4, 0.05)
    full, little = (worth(s) for s in shares)
    bare = replace(both, least=0.0)
    with np.errstate(divide="ignore"):
        whole = [bare.worth([Seen(np.array([0.5 * s]), np.array([s]), n)] * 2) for s in shares]
    assert full == pytest.approx(whole[0])
    assert little == pytest.approx(0.25 * whole[1])


def test_what_no_motion_tells_is_said(view: ClosedLoopView):
    """On one stiff axis all torque is inertia: a motor that gives less is one that weighs more."""
    weak = Effect("torque_constant", 1, {"relative_error": -0.05})
    heavy = Effect("motor_inertia", 1, {"relative_change": 0.05})
    logs = [log_of(MACHINE, [heavy], log.velocity_ref_rad_s, k) for k, log in enumerate(view.logs)]
    seen = ClosedLoopView(bare_axis(), logs, Settings())
    made = separating_of(seen, rivals(seen, heavy, weak))
    assert not made.decides
    assert str(made).startswith("No motion within")


def test_motions_stay_within_what_was_seen(logs: list[Log]):
    seen = seen_range(logs)
    step = MACHINE.sample_time_s
    tried = [*standard(seen, step, 0), *motions(seen, (1,), step, 100.0, 0)]
    assert len({m.words for m in tried}) > 15
    for motion in tried:
        speed, turned = motion.reference[:, 0], np.cumsum(motion.reference[:, 0]) * step
        assert np.abs(speed).max() <= seen.speed[0] * (1 + 1e-9)
        # The drift of rounding, and the motor behind its reference, aside.
        assert turned.max() <= seen.forth[0] * (1 + 1e-6) + 1e-9, motion.words
        assert turned.min() >= seen.back[0] * (1 + 1e-6) - 1e-9, motion.words
        assert abs(len(speed) * step - SECONDS) < 8 * step


def test_slow_sampling_has_its_motions(logs: list[Log]):
    """At 40 Hz a multisine of 40 Hz is no signal."""
    seen = seen_range(logs)
    for motion in [*standard(seen, 0.025, 0), *motions(seen, (1,), 0.025, 16.0, 0)]:
        assert np.isfinite(motion.reference).all()
        assert len(motion.reference) == SECONDS / 0.025


def test_a_motion_begins_and_ends_at_rest_where_it_began(logs: list[Log]):
    seen = seen_range(logs)
    for motion in motions(seen, (1,), MACHINE.sample_time_s, 100.0, 0):
        speed = motion.reference[:, 0]
        assert abs(speed[0]) <= 1e-12
        assert abs(speed.sum()) <= 1e-9 * np.abs(speed).sum()


def test_multisines_ride_on_a_wave_that_keeps_the_motor_turning(logs: list[Log]):
    # At rest a diagnosis hardly counts what it sees: dry friction may hold any torque there.
    step_s = MACHINE.sample_time_s
    found = {m.words: m.reference[:, 0] for m in motions(seen_range(logs), (1,), step_s, 400.0, 0)}
    for words in ("A multisine", "A wide multisine", "A multisine of high frequencies"):
        wave = found[words]
        turns = np.abs(lowpass(wave[:, None], step_s, 5.0)) > 0.2 * np.abs(wave).max()
        assert np.mean(turns) > 0.9


def test_the_design_is_a_function_of_the_seed(view: ClosedLoopView):
    both = rivals(view, FRICTION, OFFSET)
    one, other = separating_of(view, both), separating_of(view, both)
    np.testing.assert_array_equal(one.references.period, other.references.period)
    assert (one.log_ratio, one.plan.times_shorter) == (other.log_ratio, other.plan.times_shorter)


def test_the_command_writes_references_that_can_be_run(tmp_path: Path, logs: list[Log]):
    case = bare_case(tmp_path / "case", logs)
    out = tmp_path / "next"
    done = CliRunner().invoke(app, ["diagnose", str(case), "--next-experiment", str(out)])
    assert done.exit_code == 0, done.output
    found = read_references(out / "references.parquet")
    assert found.period.shape == (1, round(SECONDS / found.sample_time_s), 1)
    # The screen says what to do; the file also lists the limits and where they come from.
    says, _, limits = (out / "experiment.txt").read_text("utf-8").partition("\n")
    assert " ".join(says.split()) in " ".join(done.output.split())
    assert "speed" in limits and "(logs)" in limits


def test_a_clear_case_asks_for_no_experiment(tmp_path: Path, logs: list[Log]):
    clear = [log_of(MACHINE, [], log.velocity_ref_rad_s, k) for k, log in enumerate(logs)]
    found = diagnose(robot=bare_axis(), estimation=clear[:2], validation=clear[2:], separate=True)
    assert (found.verdict, found.experiment, found.next_experiment) == ("none", None, None)
