"""Effects that the simulator states and the machine has: scatter of machines, or a cause."""

import pytest

from axisight import Diagnosis, Effect, Settings, diagnose
from axisight.effects.stated import VISCOUS_FRICTION
from axisight.gap.facts.settings import DEFAULT_TOLERANCES
from gap_data import HELD, PLAN, bare_axis, logs_of, scattered

STATED = Effect("coulomb_friction", 1, {"coulomb_nm": 0.8, "smoothing_rad_s": 0.1})


def found(factor: float, more: list[Effect], settings: Settings | None = None) -> Diagnosis:
    """Diagnose a machine whose friction is so many times what the simulator states, with ``more``."""
    machine = scattered(bare_axis(), 4)
    own = STATED.with_values({"coulomb_nm": factor * 0.8})
    return diagnose(
        robot=bare_axis().with_effects([STATED]),
        estimation=logs_of(machine, [own, *more], PLAN),
        validation=logs_of(machine, [own, *more], HELD),
        settings=settings,
    )


def told(out: Diagnosis) -> list[str]:
    return [f.message for f in out.findings if f.name == "effect_within_scatter"]


def test_friction_a_little_off_is_no_cause():
    """Nor is a torque constant, which explains as much with fewer numbers."""
    out = found(1.04, [])
    assert out.verdict == "none"
    (message,) = told(out)
    # What was found is what is true, to a tenth of it: the logs show 0.03 Nm of 0.8.
    off = float(message.split("coulomb_nm +")[1].split(" %")[0])
    assert off == pytest.approx(4.0, abs=0.4)


def test_friction_off_by_more_is_a_cause():
    out = found(1.3, [])
    assert (out.verdict, [c.label for c in out.causes]) == ("explained", [STATED.label])
    assert told(out) == []


def test_a_cause_beside_it_is_named_alone():
    weak = Effect("torque_offset", 1, {"offset_nm": 0.3})
    out = found(1.04, [weak])
    assert (out.verdict, [c.label for c in out.causes]) == ("explained", [weak.label])


def test_the_tolerance_is_that_of_viscous_friction():
    known = {**DEFAULT_TOLERANCES, VISCOUS_FRICTION: 0.003}
    out = found(1.04, [], Settings(tolerances=known))
    assert [c.label for c in out.causes] == [STATED.label]
    assert told(out) == []
