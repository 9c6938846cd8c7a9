"""Do causes written by `dcmotor`, `pid` and their like close the gap in MuJoCo as the verdict promises?

Machines are MJCFs that have cogging, LuGre friction, a balance spring, drag, an inductance, or a `pid` or `dcmotor`
with a controller of its own; the nominal models lack one thing of it. Logs of the machine and the nominal model are
diagnosed, the causes are written back, and MuJoCo runs the nominal and the new model along the held-out log.
Prints the gap before and after, as the verdict states it and as MuJoCo has it: with torque [% of its deviation], with
targets alone the error of position [% of the nominal model's].

    python benches/write_back_dcmotor.py [CASE ...]
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import write_back_targets
from printed import table

import write_back
from axisight import diagnose, load_robot
from axisight.write_back import Written, write_model
from servo_arm import RATE_HZ, ServoArm

LAST = '<motor name="m3" joint="elbow" gear="80"/>'
PASSIVE = 'motorconst="0 0" resistance="1" input="none"'
ACCURACY = 0.05
"""Largest difference between the gap of the written model in MuJoCo and the promised one [1]."""


def beside(joint: str, gear: float, torque: str) -> str:
    """Return the motors of the nominal arm from the third on, with a passive one beside them."""
    return f'{LAST}<dcmotor joint="{joint}" gear="{gear}" {PASSIVE} {torque}/>'


Machine = write_back.Machine
WITH_TORQUE: Mapping[str, Machine] = {
    "cogging": Machine("torque_ripple@1", LAST, beside("turn", 100, 'cogging="0.12 6 0.4"')),
    # By inverse dynamics bristles always slip, so the diagnosis names dry friction.
    "bristles": Machine(
        "presliding_friction@2", LAST, beside("shoulder", 120, 'lugre="0.5 0.001 0.2 0.2 3"')
    ),
    "falling friction": Machine(
        "stribeck_friction@3", LAST, beside("elbow", 80, 'lugre="14 0.02 0.06 0.14 6"')
    ),
    "balance spring": Machine(
        "gravity_compensation@2", LAST, beside("shoulder", 1, 'cogging="40 1 0.5"')
    ),
    "drag": Machine("quadratic_drag@1", 'damping="4"', 'damping="4 14"'),
    "constant torque": Machine(
        "torque_offset@3",
        LAST,
        '<general name="m3" joint="elbow" gear="80" biastype="affine" biasprm="0.06 0 0"/>',
    ),
}


@dataclass(frozen=True)
class OwnController(ServoArm):
    """An arm whose actuators are <pid> or <dcmotor> with targets of position; ``beside``: further actuators."""

    tag: str = "pid"
    beside: str = ""

    def mjcf(self) -> str:
        """Return the MuJoCo model (MJCF)."""
        text = re.sub(
            r'<position joint="(j\d)" kp="(\S+)" kv="(\S+)"(?: forcerange="\S+ (\S+)")?/>',
            self._actuator,
            super().mjcf(),
        )
        return text.replace("</actuator>", f"{self.beside}</actuator>")

    def _actuator(self, found: re.Match[str]) -> str:
        joint, kp, kv, limit = found.groups()
        own = f'joint="{joint}" kp="{kp}" kv="{kv}"'
        if self.tag == "pid":
            force = f' forcerange="-{limit} {limit}"' if limit else ""
            return f'<pid {own} input="pos"{force}/>'
        force = f' saturation="{limit} 0 0"' if limit else ""
        electric = f'motorconst="0.1 0.1" resistance="1" input="pos" controller="{kp} 0 {kv}"'
        return f'<dcmotor joint="{joint}" {electric}{force}/>'


PID, DCMOTOR = OwnController(), OwnController(tag="dcmotor")
OTHER = {"kp": (2700.0, 1260.0, 950.0), "kd": (96.0, 176.0, 15.0)}
COGGING = f'<dcmotor joint="j2" gear="1" {PASSIVE} cogging="6 9 0.3"/>'
# The machine, and whether gains have a wide tolerance.
WITH_TARGETS: Mapping[str, tuple[OwnController, bool]] = {
    "gains of pid": (replace(PID, **OTHER), True),
    "late targets of pid": (replace(PID, late_s=0.008), False),
    "weak motor of dcmotor": (DCMOTOR.weaker(2, 0.85), False),
    "limit of dcmotor": (DCMOTOR.with_changed("limit", 2, 45.0), False),
    "dry friction of pid": (PID.with_changed("dry_friction", 2, 2.5), False),
    "cogging beside pid": (replace(PID, beside=COGGING), False),
}
CASES = (*WITH_TORQUE, *WITH_TARGETS)


@dataclass(frozen=True)
class Outcome:
    """A written model, and its gap before and after [1]: of the verdict and in MuJoCo."""

    made: Written
    headline: str
    promised: tuple[float, float]
    run: tuple[float, float]

    @property
    def holds(self) -> bool:
        """Whether all causes are in the model and its gap is the promised one, or below."""
        return not self.made.left_out and self.run[1] - self.promised[1] < ACCURACY


def outcome(name: str, folder: Path) -> Outcome:
    """Diagnose a machine by its nominal model, write back what was found, and measure in MuJoCo."""
    if name in WITH_TORQUE:
        out = write_back.outcome(WITH_TORQUE[name], folder, inverse=False)
        gap = out.found.gap
        return Outcome(out.made, out.found.headline, (gap.before, gap.after), out.run)
    arm, wide = WITH_TARGETS[name]
    nominal = folder / "arm.xml"
    nominal.write_text(OwnController(tag=arm.tag).mjcf(), "utf-8")
    robot = load_robot(nominal, sample_time_s=1 / RATE_HZ)
    logs = [arm.log(run) for run in (1, 2, 3)]
    found = diagnose(
        robot=robot,
        estimation=logs[:2],
        validation=logs[2:],
        settings=write_back_targets.settings_of(wide=wide),
    )
    made = write_model(nominal, robot, found.causes, folder / "new.xml", refit=found.refit)
    motion = found.gap.motion
    assert motion is not None  # positions are compared
    errors = [write_back_targets.error_of(path, logs[2]) for path in (nominal, made.path)]
    run = [float(x.max()) for x in errors]
    promised = [float(np.max(x)) for x in (motion.position_rad.before, motion.position_rad.after)]
    return Outcome(made, found.headline, (1.0, promised[1] / promised[0]), (1.0, run[1] / run[0]))


def row(name: str, folder: Path) -> tuple[list[str], str]:
    """Return the cells of a machine, what no file has a place for, and its headline."""
    out = outcome(name, folder)
    gaps = [f"{100 * a:.1f} → {100 * b:.1f} %" for a, b in (out.promised, out.run)]
    left_out = ", ".join(out.made.left_out) or "nothing"
    cells = [", ".join(out.made.placed) or "–", *gaps, "yes" if out.holds else "no"]
    return cells, f"left out {left_out}, {out.headline}"


def main(names: list[str]) -> None:
    """Print the table."""
    table(("machine", "written", "verdict", "run", "within 5 points"), names or CASES, row)


if __name__ == "__main__":
    main(sys.argv[1:])
