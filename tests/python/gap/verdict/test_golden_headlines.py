"""Golden texts: situations of a diagnosis, as constructed facts, and what the headline says of each."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from axisight.effects import Effect
from axisight.gap.facts.result import AxisVerdict, Cause, Gap, Interval, Remainder, Where
from axisight.gap.facts.withdrawal import Withdrawal
from axisight.gap.verdict.headline import Facts, headline

JOINTS = ("pan", "shoulder", "elbow", "wrist_1", "wrist_2", "wrist_3")
MUCH, NOTHING = Interval(0.9, 0.8, 1.0), Interval(0.0, 0.0, 0.0)


def gap(*axes: tuple[float, float, float, float], whole=(0.131, 0.131, 0.077, 0.078)) -> Gap:
    """Rows of before, re-fitted, after and floor; axes that are not given are at a floor of 5 %."""
    rows = np.array([*axes, *[(0.05, 0.05, 0.05, 0.05)] * (6 - len(axes))])
    return Gap(*whole, *rows.T)


def four_axes() -> Gap:
    """The gap of an arm of four axes."""
    six = gap()
    rows = ("before_per_axis", "refitted_per_axis", "after_per_axis", "floor_per_axis")
    return replace(six, **{row: getattr(six, row)[:4] for row in rows})


def cause(
    effect: str, axis: int | None, share: Interval = MUCH, axes=None, **values: float
) -> Cause:
    found = {k: Interval(v, 0.9 * v, 1.1 * v) for k, v in values.items()}
    units = {k: "Nm" if k.endswith("_nm") else "1" for k in values}
    return Cause(effect, axis, 0.95, found, units, share, axes=axes)


def axes(**verdicts: str) -> tuple[AxisVerdict, ...]:
    """Verdicts by axis, ``a2="unknown"``; *none* of the others."""
    words = [verdicts.get(f"a{i}", "none") for i in range(1, 7)]
    return tuple(AxisVerdict(i, w, 0.0, 0.0, ()) for i, w in enumerate(words, start=1))


def place(axis: int, regime: str | None = None) -> Where:
    return Where(axis, 0.9, (0.5, 6.0), regime, "")


COULOMB = cause("coulomb_friction", 2)
ONE = Facts("explained", gap(), axes(a2="explained"), (COULOMB,), joints=JOINTS)
QUIET = (0.05, 0.05, 0.05, 0.05)
FOUR = gap(QUIET, QUIET, QUIET, (0.78, 0.77, 0.77, 0.014), whole=(0.32, 0.32, 0.32, 0.05))
UNKNOWN = Facts(
    "unknown", FOUR, axes(a4="unknown"), where=(place(4, "speed: slow"),), joints=JOINTS
)
NONE = Facts("none", gap(whole=(0.0391, 0.0386, 0.0386, 0.0391)), axes(), joints=JOINTS)
PAIR = Facts(
    "undecidable", gap(whole=(0.913, 0.9, 0.039, 0.035)), axes(a1="undecidable"),
    (cause("coulomb_friction", 1), cause("link_mass", 1)), (("link_mass@1", "payload"),),
    joints=JOINTS,
)  # fmt: skip

SITUATIONS: dict[str, tuple[Facts, str]] = {
    "one cause": (
        ONE,
        "The simulator lacks Coulomb friction on axis 2 (shoulder). Adding it cuts the gap on validation logs from "
        "13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "an arm without names of its own": (
        replace(ONE, joints=("axis1", "axis2")),
        "The simulator lacks Coulomb friction on axis 2. Adding it cuts the gap on validation logs from 13.1 % to "
        "7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "two causes on one axis": (
        replace(ONE, causes=(COULOMB, cause("backlash", 2))),
        "The simulator lacks Coulomb friction and backlash on axis 2 (shoulder). Adding them cuts the gap on "
        "validation logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "two causes on two axes": (
        replace(ONE, causes=(COULOMB, cause("input_delay", 3))),
        "The simulator lacks Coulomb friction on axis 2 (shoulder) and an input delay on axis 3 (elbow). Adding "
        "them cuts the gap on validation logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "twelve causes": (
        replace(
            ONE,
            causes=tuple(
                cause(e, a) for a in range(1, 7) for e in ("viscous_friction", "coulomb_friction")
            ),
        ),
        "The simulator lacks viscous and Coulomb friction on all six axes. Adding them cuts the gap on validation "
        "logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "many causes, each elsewhere": (
        replace(
            ONE,
            causes=(COULOMB, cause("backlash", 1), cause("input_delay", 3), cause("torque_ripple", 4),
                    cause("torque_offset", 5)),
        ),
        "The simulator lacks Coulomb friction on axis 2 (shoulder), backlash on axis 1 (pan), an input delay on "
        "axis 3 (elbow) and 2 more effects. Adding them cuts the gap on validation logs from 13.1 % to 7.7 % of "
        "the torque (noise alone: 7.8 %).",
    ),
    "many causes, the last that is told on the third axis": (
        replace(
            ONE,
            causes=(COULOMB, cause("backlash", 1), cause("torque_ripple", 3), cause("input_delay", 4),
                    cause("torque_offset", 5)),
        ),
        "The simulator lacks Coulomb friction on axis 2 (shoulder), backlash on axis 1 (pan), torque ripple on "
        "axis 3 (elbow) and 2 more effects. Adding them cuts the gap on validation logs from 13.1 % to 7.7 % of "
        "the torque (noise alone: 7.8 %).",
    ),
    "an effect between two axes": (
        replace(ONE, causes=(cause("axis_coupling", 5, axes=(5, 6)),)),
        "The simulator lacks axis coupling on axes 5 (wrist_2) and 6 (wrist_3). Adding it cuts the gap on "
        "validation logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "an effect between two axes, twice": (
        replace(
            ONE,
            gap=four_axes(),
            causes=(cause("axis_coupling", 1, axes=(1, 2)), cause("axis_coupling", 2, axes=(2, 3))),
        ),
        "The simulator lacks axis coupling on axes 1 (pan) and 2 (shoulder) and on axes 2 and 3 (elbow). Adding them "
        "cuts the gap on validation logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "an effect between two axes of the simulator with another value": (
        replace(
            ONE,
            causes=(cause("axis_coupling", 5, axes=(5, 6)),),
            own=(Effect("axis_coupling", None, {"share": 0.1}, (5, 6)),),
        ),
        "The axis coupling of axes 5 (wrist_2) and 6 (wrist_3) is wrong in the simulator. "
        "Correcting it cuts the gap on validation logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "a cause of the whole arm, some gap left": (
        replace(
            ONE,
            causes=(cause("payload", None),),
            remainder=Remainder(
                0.03, np.array([0, 0, 0.043, 0, 0, 0]), (place(3, "speed: slow"),), "speed"
            ),
        ),
        "The simulator lacks a payload. Adding it cuts the gap on validation logs from 13.1 % to 7.7 % of the "
        "torque (noise alone: 7.8 %). Axis 3 (elbow) keeps 4.3 % of its torque above noise, mostly at 0.5-6 Hz "
        "(speed: slow).",
    ),
    "a wrong value": (
        replace(ONE, causes=(cause("motor_inertia", 3, relative_change=0.45),)),
        "The motor inertia of axis 3 (elbow) is wrong in the simulator (machine: +45 %). Correcting it cuts the gap"
        " on validation logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "an effect of the simulator with another value": (
        replace(
            ONE,
            causes=(cause("viscous_friction", 2, viscous_nm_s_rad=0.61),),
            own=(Effect("viscous_friction", 2, {"viscous_nm_s_rad": 0.5}),),
        ),
        "The viscous friction of axis 2 (shoulder) is wrong in the simulator (machine: 0.61, simulator: 0.5). "
        "Correcting it cuts the gap on validation logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "an effect that lacks and a wrong value": (
        replace(ONE, causes=(COULOMB, cause("joint_stiffness", 3, relative_change=-0.2))),
        "The simulator lacks Coulomb friction on axis 2 (shoulder). The joint stiffness of axis 3 (elbow) is wrong "
        "in the simulator (machine: -20 %). Changing them cuts the gap on validation logs from 13.1 % to 7.7 % of "
        "the torque (noise alone: 7.8 %).",
    ),
    "equivalents that give the same logs": (
        replace(
            ONE,
            causes=(cause("torque_offset", 2),),
            twins=(("torque_offset@2", "torque_sensor_offset@2"),),
        ),
        "The simulator lacks a torque offset on axis 2 (shoulder). Adding it cuts the gap on validation logs from "
        "13.1 % to 7.7 % of the torque (noise alone: 7.8 %). A torque sensor offset on axis 2 would give the same "
        "logs as a torque offset on axis 2.",
    ),
    "undecidable beside a sure cause": (
        PAIR,
        "The simulator lacks Coulomb friction on axis 1 (pan). Open: another link mass on axis 1 or a payload. "
        "These logs cannot tell them apart. With this cause and the first of them the gap on validation logs goes "
        "from 91.3 % to 3.9 % of the torque (noise alone: 3.5 %).",
    ),
    "undecidable beside two sure causes": (
        replace(PAIR, causes=(*PAIR.causes, COULOMB)),
        "The simulator lacks Coulomb friction on axes 1 (pan) and 2 (shoulder). Open: another link mass on axis 1 or "
        "a payload. These logs cannot tell them apart. With these and the first of them the gap on validation logs "
        "goes from 91.3 % to 3.9 % of the torque (noise alone: 3.5 %).",
    ),
    "undecidable, the simulation as given broke off": (
        replace(PAIR, gap=gap(whole=(np.nan, np.nan, 0.039, 0.035))),
        "The simulator lacks Coulomb friction on axis 1 (pan). Open: another link mass on axis 1 or a payload. "
        "These logs cannot tell them apart. The simulation as given broke off. With this cause and the first of them "
        "the gap on validation logs is 3.9 % of the torque (noise alone: 3.5 %).",
    ),
    "explained, the simulation as given broke off": (
        replace(ONE, gap=gap(whole=(np.nan, np.nan, 0.077, 0.078))),
        "The simulator lacks Coulomb friction on axis 2 (shoulder). The simulation as given broke off. Adding it "
        "leaves a gap on validation logs of 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "undecidable, three groups": (
        replace(
            PAIR,
            causes=(cause("link_mass", 1), COULOMB, cause("backlash", 3)),
            open=(
                ("link_mass@1", "payload", "link_inertia@1", "link_com@1", "link_com@2"),
                ("coulomb_friction@2", "torque_offset@2"),
                ("backlash@3", "lost_motion@3"),
            ),
        ),
        "Open: another link mass on axis 1 (pan), a payload, another link inertia on axis 1 or 2 others; Coulomb "
        "friction on axis 2 (shoulder) or a torque offset on axis 2; backlash on axis 3 (elbow) or lost motion on "
        "axis 3. These logs cannot tell them apart. With the first of each the gap on validation logs goes from "
        "91.3 % to 3.9 % of the torque (noise alone: 3.5 %).",
    ),
    "unknown on one axis of six": (
        UNKNOWN,
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow).",
    ),
    "unknown on one axis, what was tried elsewhere does not carry over": (
        replace(
            UNKNOWN,
            withdrawn=Withdrawal("axis", 0.0483, 0.0484, 0.04, 5, "run_9", ("coulomb_friction@5",)),
        ),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). Coulomb friction on axis 5 (wrist_2) does not carry over to the validation logs: "
        "with it the gap on axis 5 of run_9 goes from 4.83 % to 4.84 % of the torque.",
    ),
    "unknown on one axis, a sure cause on another": (
        replace(
            UNKNOWN,
            gap=gap(QUIET, (0.4, 0.3, 0.06, 0.05), QUIET, (0.78, 0.77, 0.77, 0.014)),
            axes=axes(a2="explained", a4="unknown"),
            causes=(COULOMB,),
        ),
        "The simulator lacks Coulomb friction on axis 2 (shoulder). Adding it takes the gap of axis 2 from 40 % to "
        "6 % (noise alone: 5 %). Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque "
        "(noise alone: 1.4 %), mostly at 0.5-6 Hz (speed: slow).",
    ),
    "unknown on three axes": (
        replace(
            UNKNOWN,
            gap=gap((0.3, 0.3, 0.3, 0.05), QUIET, (0.2, 0.2, 0.2, 0.05), (0.78, 0.77, 0.77, 0.014)),
            axes=axes(a1="unknown", a3="unknown", a4="unknown"),
        ),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). Axes 1 (pan) and 3 (elbow) have one too.",
    ),
    "unknown on one axis, an open cause on another": (
        replace(
            UNKNOWN,
            gap=gap(QUIET, (0.4, 0.3, 0.06, 0.05), QUIET, (0.78, 0.77, 0.77, 0.014)),
            axes=axes(a2="explained", a4="unknown"),
            causes=(replace(COULOMB, rivals=("torque_offset@2",)),),
        ),
        "Open: Coulomb friction on axis 2 (shoulder) or a torque offset on axis 2. These logs cannot tell them apart. "
        "With the first of them the gap of axis 2 goes from 40 % to 6 % (noise alone: 5 %). Axis 4 (wrist_1) has a "
        "gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly at 0.5-6 Hz "
        "(speed: slow).",
    ),
    "unknown on three axes, the place named first is at the floor": (
        replace(
            UNKNOWN,
            gap=gap((0.3, 0.3, 0.3, 0.05), QUIET, (0.2, 0.2, 0.2, 0.05), QUIET),
            axes=axes(a1="unknown", a3="unknown", a4="unknown"),
        ),
        "Axis 1 (pan) has a gap that no known effect explains: 30 % of the torque (noise alone: 5 %). Axis 3 (elbow) "
        "has one too. Axis 4 (wrist_1) has one on the estimation logs alone.",
    ),
    "unknown on two axes at the floor": (
        replace(UNKNOWN, gap=gap(), where=(), axes=axes(a3="unknown", a4="unknown")),
        "Axis 3 (elbow) has an error on the estimation logs that no known effect explains. On validation logs it "
        "does not stand out: 5 % of the torque (noise alone: 5 %). Axis 4 (wrist_1) has one too.",
    ),
    "unknown by the estimation logs alone, at the floor of the validation logs": (
        replace(UNKNOWN, gap=gap(), where=()),
        "Axis 4 (wrist_1) has an error on the estimation logs that no known effect explains. On validation logs it "
        "does not stand out: 5 % of the torque (noise alone: 5 %).",
    ),
    "causes of the estimation logs that the validation logs do not have": (
        replace(
            UNKNOWN,
            gap=gap(),
            where=(),
            withdrawn=Withdrawal(
                "axis", 0.42, 25.1, 0.41, 6, "run_9", ("coulomb_friction@6", "viscous_friction@6")
            ),
        ),
        "Axis 4 (wrist_1) has a gap on the estimation logs, but not on the validation logs: 5 % of the torque "
        "(noise alone: 5 %). Coulomb and viscous friction on axis 6 (wrist_3) do not carry over to the validation "
        "logs: with them the gap on axis 6 of run_9 goes from 42 % to more than 1,000 % of the torque.",
    ),
    "a log with a name like that of an axis": (
        replace(
            UNKNOWN,
            withdrawn=Withdrawal(
                "axis", 0.0483, 0.0484, 0.04, 5, "axis 3 and 5", ("coulomb_friction@5",)
            ),
        ),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). Coulomb friction on axis 5 (wrist_2) does not carry over to the validation logs: "
        "with it the gap on axis 5 of axis 3 and 5 goes from 4.83 % to 4.84 % of the torque.",
    ),
    "a part alone is explained": (
        replace(UNKNOWN, withdrawn=Withdrawal("part", 0.5, 0.35, 0.05, causes=("backlash@4",))),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). Backlash on axis 4 explains only a part: with it the gap on validation logs goes "
        "from 50 % to 35 % of the torque.",
    ),
    "a cause only with a bent simulator": (
        replace(
            UNKNOWN,
            withdrawn=Withdrawal("bent", 0.5, 0.06, 0.05, causes=("backlash@4",), share=0.3),
        ),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). Backlash on axis 4 would explain it only with 30 % of the simulator's own "
        "parameters at the edge of their tolerance.",
    ),
    "the re-fit alone does better": (
        replace(UNKNOWN, withdrawn=Withdrawal("refit", 0.05, 0.06, 0.05, causes=("backlash@4",))),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). Backlash on axis 4 does not carry over to the validation logs: the gap is 6 % "
        "of the torque with it, and 5 % with the re-fit alone.",
    ),
    "none that does not carry over": (
        replace(UNKNOWN, withdrawn=Withdrawal("none", 0.77, 0.77, 0.014, 4, "run_9")),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). The estimation logs lack no effect, but that does not carry over to the "
        "validation logs: 77 % of the torque is left on axis 4 of run_9 (noise alone: 1.4 %).",
    ),
    "none that does not carry over, at the floor over all logs": (
        replace(
            UNKNOWN, gap=gap(), withdrawn=Withdrawal("none", 0.77, 0.77, 0.014, 4, "run_9")
        ),
        "The estimation logs lack no effect, but that does not carry over to the validation logs: 77 % of the torque "
        "is left on axis 4 (wrist_1) of run_9 (noise alone: 1.4 %).",
    ),
    "noise larger than the gap": (
        replace(
            UNKNOWN,
            gap=gap(whole=(0.5, 0.5, 0.5, 0.9)),
            withdrawn=Withdrawal("noise", 0.5, 0.5, 0.9),
        ),
        "No verdict: the noise estimated from the logs, 90 % of the torque, is larger than the gap of 50 %. Look "
        "for glitches and for frozen or missing samples with `axisight check`.",
    ),
    "noise as large as the torque": (
        replace(
            UNKNOWN,
            gap=gap(whole=(1.24, 1.24, 0.98, 1.16)),
            withdrawn=Withdrawal("loud", 1.24, 1.24, 1.16),
        ),
        "No verdict: noise alone is 116 % of the torque. No effect would show above it.",
    ),
    "none": (
        NONE,
        "No unmodelled effect found. The re-fitted simulator leaves 3.86 % of the torque on validation logs "
        "(noise alone: 3.91 %).",
    ),
    "none with a re-fit": (
        replace(
            NONE,
            gap=gap(QUIET, (0.0525, 0.0125, 0.0125, 0.0129), (0.216, 0.0532, 0.0532, 0.0577)),
            refit={"elbow.mass": Interval(0.03, 0.01, 0.05), "pan.mass": Interval(0.1, -0.1, 0.3)},
        ),
        "No unmodelled effect found. The gap of 21.6 % of the torque on axis 3 (elbow), like that of axis 2 "
        "(shoulder), lies within the tolerances of the simulator's own parameters. Re-fitted (elbow.mass +3 %), "
        "they leave 5.32 % there (noise alone: 5.77 %).",
    ),
    "none, noise as large as the torque": (
        replace(NONE, gap=gap(QUIET, QUIET, QUIET, QUIET, QUIET, (0.99, 0.99, 0.99, 0.98))),
        "No unmodelled effect found. The re-fitted simulator leaves 13.1 % of the torque on validation logs (noise "
        "alone: 7.8 %). Noise hides much on axis 6 (wrist_3): it is 98 % of the torque there.",
    ),
    "position targets": (
        replace(ONE, gap=replace(gap(), compared="positions")),
        "The simulator lacks Coulomb friction on axis 2 (shoulder). Adding it cuts the gap of positions on "
        "validation logs from 13.1 % to 7.7 % of the commanded torque (noise alone: 7.8 %).",
    ),
    "a cause of the controller alone": (
        replace(ONE, causes=(cause("controller_gain", 2, NOTHING),), mode="inverse_dynamics"),
        "The controller gain of axis 2 (shoulder) is wrong in the simulator. A torque predicted from the measured "
        "motion does not feel this. The gap is 13.1 % of the torque (noise alone: 7.8 %).",
    ),
    "a cause beside one of the controller": (
        replace(
            ONE,
            causes=(COULOMB, cause("velocity_filter", 3, NOTHING)),
            mode="inverse_dynamics",
        ),
        "The simulator lacks Coulomb friction on axis 2 (shoulder) and a velocity filter on axis 3 (elbow). Adding "
        "Coulomb friction on axis 2 cuts the gap on validation logs from 13.1 % to 7.7 % of the torque (noise "
        "alone: 7.8 %).",
    ),
    "a cause of the controller in closed loop": (
        replace(ONE, causes=(cause("controller_gain", 2, NOTHING),)),
        "The controller gain of axis 2 (shoulder) is wrong in the simulator. Correcting it cuts the gap on validation "
        "logs from 13.1 % to 7.7 % of the torque (noise alone: 7.8 %).",
    ),
    "a cause that does not lower the gap": (
        replace(
            ONE,
            gap=gap(whole=(0.131, 0.131, 0.14, 0.078)),
            causes=(cause("coulomb_friction", 2, NOTHING),),
            mode="inverse_dynamics",
        ),
        "The simulator lacks Coulomb friction on axis 2 (shoulder). Adding it takes the gap on validation logs from "
        "13.1 % to 14 % of the torque (noise alone: 7.8 %).",
    ),
    "a cause that does not lower the gap beside steps of an encoder": (
        replace(
            ONE,
            causes=(cause("coulomb_friction", 2, NOTHING), cause("position_quantization", 2)),
        ),
        "The simulator lacks Coulomb friction and position quantization on axis 2 (shoulder). Adding Coulomb "
        "friction on axis 2 cuts the gap on validation logs from 13.1 % to 7.7 % of the torque (noise and steps "
        "alone: 7.8 %).",
    ),
    "a cause of the controller beside steps of an encoder": (
        replace(
            ONE,
            causes=(cause("position_quantization", 2), cause("velocity_filter", 3, NOTHING)),
            mode="inverse_dynamics",
        ),
        "The simulator lacks position quantization on axis 2 (shoulder) and a velocity filter on axis 3 (elbow). The "
        "steps of the encoders set the floor: the gap is 13.1 % of the torque (noise and steps: 7.8 %).",
    ),
    "steps of an encoder": (
        replace(ONE, causes=(cause("position_quantization", 2),)),
        "The simulator lacks position quantization on axis 2 (shoulder). The steps of the encoders set the floor: "
        "the gap is 13.1 % of the torque (noise and steps: 7.8 %).",
    ),
    "steps of an encoder beside a cause": (
        replace(ONE, causes=(COULOMB, cause("position_quantization", 2))),
        "The simulator lacks Coulomb friction and position quantization on axis 2 (shoulder). Adding Coulomb "
        "friction on axis 2 cuts the gap on validation logs from 13.1 % to 7.7 % of the torque (noise and steps "
        "alone: 7.8 %).",
    ),
    "a simulation that broke off": (
        replace(
            UNKNOWN,
            gap=gap(QUIET, QUIET, QUIET, (np.nan, np.nan, np.nan, 0.014)),
            where=(),
        ),
        "Axis 4 (wrist_1) has a gap that no known effect explains: the simulation broke off there.",
    ),
    "a simulation that broke off, a gap on two more axes": (
        replace(
            UNKNOWN,
            gap=gap((0.3, 0.3, 0.3, 0.05), QUIET, (0.2, 0.2, 0.2, 0.05), (np.nan, np.nan, np.nan, 0.014)),
            axes=axes(a1="unknown", a3="unknown", a4="unknown"),
            where=(),
        ),
        "Axis 4 (wrist_1) has a gap that no known effect explains: the simulation broke off there. Axes 1 (pan) and 3 "
        "(elbow) have one too.",
    ),
    "causes with which the simulation breaks off": (
        replace(
            UNKNOWN,
            withdrawn=Withdrawal("axis", 0.05, np.nan, 0.04, 5, "run_9", ("backlash@5",)),
        ),
        "Axis 4 (wrist_1) has a gap that no known effect explains: 77 % of the torque (noise alone: 1.4 %), mostly "
        "at 0.5-6 Hz (speed: slow). Backlash on axis 5 (wrist_2) does not carry over to the validation logs: with it "
        "the simulation breaks off on axis 5 of run_9.",
    ),
    "a simulation that broke off, the whole arm": (
        replace(UNKNOWN, gap=gap(whole=(np.nan, np.nan, np.nan, 0.05)), axes=axes(), where=()),
        "No known effect explains the gap: the simulation as given broke off.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("situation", SITUATIONS)
def test_the_headline_of_a_situation(situation):
    facts, text = SITUATIONS[situation]
    assert headline(facts) == text


@pytest.mark.parametrize("situation", SITUATIONS)
def test_sentences_are_short_and_few(situation):
    text = headline(SITUATIONS[situation][0])
    sentences = re.split(r"(?<=[.:;]) (?=[A-Z])", text)
    assert len(sentences) <= 5
    assert all(len(s.split()) < 40 for s in sentences), text
    assert "_" not in re.sub(r"wrist_\d|run_\d", "", text)
