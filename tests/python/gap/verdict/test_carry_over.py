"""Validation logs have the last word."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from axisight import Log, Settings
from axisight.effects import Effect
from axisight.gap.facts.result import AxisVerdict, Candidate, Interval
from axisight.gap.measure.gap_figures import Stages, gap_figures, stage
from axisight.gap.measure.gear_deflections import GearErrors
from axisight.gap.verdict.carry_over import carried_over
from axisight.gap.verdict.conclusion import Conclusion, NamedCause

N, T = 4000, 1e-3
NAMES = ["held"]


def log() -> Log:
    time = np.arange(N) * T
    wave = np.sin(2 * np.pi * time)[:, None]
    return Log(
        name="held",
        source=Path("held.parquet"),
        sample_time_s=T,
        time_s=time,
        velocity_ref_rad_s=None,
        torque_nm=wave,
        position_rad=wave,
    )


def named(effect: str = "coulomb_friction") -> Conclusion:
    value = {"coulomb_nm": Interval(1.0, 0.9, 1.1)}
    cause = NamedCause(effect, 1, 0.99, value, {"coulomb_nm": "Nm"}, "friction", 0.99)
    return Conclusion(
        verdict="explained",
        causes=(cause,),
        alternatives=(),
        equivalent=(),
        next_experiment=None,
        ranking=(),
        p_none=0.0,
        p_unknown=0.01,
        axes=(AxisVerdict(1, "explained", 5.0, 0.99, (0,)),),
        checks=(),
        effects=(Effect("coulomb_friction", 1, {"coulomb_nm": 1.0}),),
    )


def stages(before: float, after: float, noise: float = 0.05) -> Stages:
    rng = np.random.default_rng(1)
    shape = rng.normal(size=(N, 1))
    given, left, floor = (stage([log()], [x * shape], 1.0) for x in (before, after, noise))
    return Stages(given, given, left, floor)


def judged(conclusion: Conclusion, seen: Stages, **more) -> Conclusion:
    return carried_over(conclusion, seen, gap_figures(seen), NAMES, Settings(), **more)


def test_causes_that_explain_the_validation_logs_stand():
    assert judged(named(), stages(0.5, 0.06)) == named()


@pytest.mark.parametrize(
    ("after", "why"),
    [(0.6, "refit"), (0.45, "fall"), (0.35, "part")],
)
def test_causes_that_leave_the_gap_are_withdrawn(after: float, why: str):
    found = judged(named(), stages(0.5, after))
    assert (found.verdict, found.causes) == ("unknown", ())
    assert found.withdrawn is not None
    assert (found.withdrawn.why, found.withdrawn.causes) == (why, ("coulomb_friction@1",))
    assert found.withdrawn.after == pytest.approx(after * np.sqrt(2.0), rel=0.05)
    assert all(a.verdict == "unknown" and a.causes == () for a in found.axes)


def test_causes_of_a_gear_that_both_encoders_show_need_not_shrink_the_gap():
    mended = GearErrors(axis=1, before=9.0, after=0.8)
    gear, seen = named("joint_stiffness"), stages(0.08, 0.079)
    gear = replace(gear, effects=())
    assert judged(gear, seen).verdict == "unknown"
    assert judged(gear, seen, gears=mended) == gear
    # Not with other causes, far above the floor, or where the gear stays as wrong as it was.
    assert judged(named(), seen, gears=mended).verdict == "unknown"
    assert judged(gear, stages(0.5, 0.45), gears=mended).verdict == "unknown"
    assert judged(gear, seen, gears=GearErrors(1, 9.0, 8.0)).verdict == "unknown"
    assert judged(gear, seen, gears=GearErrors(2, 9.0, 0.8)).verdict == "unknown"


def test_none_is_unknown_where_both_encoders_contradict_a_gear():
    none = replace(named(), verdict="none", causes=(), effects=())
    floor = stages(0.05, 0.05)
    assert judged(none, floor, gears=GearErrors(1, 2.0, 2.0)) == none
    found = judged(none, floor, gears=GearErrors(1, 9.0, 9.0))
    assert found.verdict == "unknown"
    assert found.withdrawn is not None
    assert (found.withdrawn.why, found.withdrawn.axis, found.withdrawn.share) == ("gear", 1, 9.0)


def test_a_withdrawn_cause_is_the_likeliest_alternative():
    first, second = (
        Candidate(effect, 1, probability, 0.9, 5.0, "converged")
        for effect, probability in (("coulomb_friction", 0.88), ("asymmetric_friction", 0.11))
    )
    conclusion = replace(named(), ranking=(first, second), alternatives=(second,))
    assert judged(conclusion, stages(0.5, 0.06)).alternatives == (second,)
    assert judged(conclusion, stages(0.5, 0.06), bent=0.3).alternatives == (first, second)


def test_causes_of_no_size_that_hold_nowhere_are_none():
    """A tenth above the noise where they were found, and no more than noise where they were not."""
    small = replace(named(), axes=(AxisVerdict(1, "explained", 0.1, 0.9, (0,)),))
    found = judged(small, stages(0.051, 0.0509), removed=0.1)
    assert (found.verdict, found.causes, found.withdrawn) == ("none", (), None)
    assert all(a.verdict == "none" and a.causes == () for a in found.axes)
    assert "Not a cause: coulomb_friction@1." in found.checks[-1]
    # What removes most of what there is stands, what is large where it was found, and what nothing tells.
    assert judged(small, stages(0.051, 0.0509), removed=0.6) == small
    assert judged(named(), stages(0.051, 0.0509), removed=0.1) == named()
    assert judged(small, stages(0.051, 0.0509)) == small
    # What leaves a log above the floor is judged as ever.
    assert judged(small, stages(0.5, 0.45), removed=0.1).verdict == "unknown"


def test_causes_that_leave_more_than_the_refit_alone_are_withdrawn():
    # Re-fitted the simulator stands at the floor; the causes hide behind the gap before.
    floor = stages(0.05, 0.05)
    alone = replace(stages(0.9, 0.06), refitted=floor.refitted)
    found = judged(named(), alone)
    assert found.verdict == "unknown"
    assert found.withdrawn is not None and found.withdrawn.why == "refit"
    assert found.withdrawn.before == pytest.approx(0.05 * np.sqrt(2.0), rel=0.05)
    # As much as the re-fit, to a twentieth of the noise: they may be what the re-fit stands for.
    assert judged(named(), replace(stages(0.9, 0.0505), refitted=floor.refitted)) == named()


def test_a_small_gap_that_goes_to_the_floor_is_carried_over():
    # A fifth above the noise; what is left of it is within the scatter of the floor.
    assert judged(named(), stages(before=0.06, after=0.0511)).verdict == "explained"
    assert judged(named(), stages(before=0.06, after=0.055)).verdict == "unknown"


def test_a_simulator_bent_out_of_shape_explains_nothing():
    good = stages(0.5, 0.06)
    assert judged(named(), good, bent=0.2).verdict == "explained"
    found = judged(named(), good, bent=0.5)
    assert found.verdict == "unknown"
    assert found.withdrawn is not None
    assert (found.withdrawn.why, found.withdrawn.share) == ("bent", 0.5)


def test_none_needs_logs_at_the_floor():
    none = replace(named(), verdict="none", causes=(), effects=())
    assert judged(none, stages(0.05, 0.05)) == none
    found = judged(none, stages(0.3, 0.3))
    assert found.verdict == "unknown" and found.withdrawn is not None
    assert (found.withdrawn.why, found.withdrawn.axis, found.withdrawn.log) == ("none", 1, "held")


def test_noise_larger_than_the_gap_is_a_fault_of_the_data():
    found = judged(named(), stages(0.5, 0.06, noise=0.9))
    assert found.verdict == "unknown"
    assert found.withdrawn is not None and found.withdrawn.why == "noise"
    assert "axisight check" in (found.next_experiment or "")


@pytest.mark.parametrize("noise", [0.4, 0.7])
@pytest.mark.parametrize("differentiated", [True, False])
def test_noise_as_large_as_the_torque_allows_no_verdict(noise, differentiated):
    """From two thirds of the torque on not even a gap of all of it would stand half above the noise."""
    seen = stages(1.2, noise, noise=noise)
    found = judged(named(), seen, differentiated=differentiated)
    loud = differentiated and gap_figures(seen).floor > 2 / 3
    assert (found.withdrawn is not None and found.withdrawn.why == "loud") == loud
    assert loud == (differentiated and noise == 0.7)
    if loud:
        assert found.verdict == "unknown"
        assert found.next_experiment.startswith("Lower the cutoff")


@pytest.mark.parametrize(
    ("refuted", "loud"), [([1.0, 1.0, 0.05], False), ([0.05, 1.0, 1.0], True), ([1.0] * 3, False)]
)
def test_noise_that_one_axis_refutes_is_not_that_of_the_others(refuted, loud):
    """Twenty times 0.2 % beside 5 % is little; twenty times 6 % is more than the torque of one axis."""
    seen = stages(0.5, 0.06)
    # The last axis is not judged.
    floor = np.array([0.06, 0.05, 0.002, np.nan])
    gap = replace(gap_figures(seen), floor=np.sqrt(np.nanmean(floor**2)), floor_per_axis=floor)
    noise = np.array([*refuted, 1.0])
    found = carried_over(named(), seen, gap, NAMES, Settings(), differentiated=True, refuted=noise)
    assert (found.withdrawn is not None and found.withdrawn.why == "loud") == loud


def test_a_gap_that_nobody_sees_is_below_whatever_noise():
    """A simulation diagnosed by itself: sharp motions pass for noise, and nothing is missing."""
    nothing = replace(named(), verdict="none", causes=(), effects=())
    assert judged(nothing, stages(0.01, 0.01, noise=0.03)).verdict == "none"


def test_what_is_left_open_stands_above_no_floor():
    nothing = replace(named(), verdict="none", causes=(), effects=())
    seen = stages(0.2, 0.2, noise=0.05)
    assert judged(nothing, seen).verdict == "unknown"
    opened = stage([log()], [0.3 * np.ones((N, 1))], 1.0)
    assert judged(nothing, replace(seen, open=opened)).verdict == "none"


def test_what_the_steps_of_an_encoder_leave_is_noise():
    """A motor that swings between two steps makes up to half more of the noise that they are taken for."""
    swinging = stages(0.08, 0.06)
    stepped = np.array([True])
    assert judged(named(), swinging).verdict == "unknown"
    assert judged(named(), swinging, stepped=stepped) == named()
    assert judged(named(), stages(0.08, 0.07), stepped=stepped).verdict == "unknown"
    assert judged(named(), swinging, stepped=~stepped).verdict == "unknown"
