"""How far Axisight's simulation is from that of another engine, with or without an effect.

Run: python benches/outside/agree.py FOLDER

FOLDER holds cases without noise, as ``python -m outside nominal FOLDER`` and ``laws FOLDER`` write
them. Where ``labels.json`` is there, the simulation has the effect of each case with its true
parameters; effects whose parameters have other names in this engine are left out.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from axisight import Effect, effect_info, load_robot, read_case, simulate


def effect_of(truth: dict) -> Effect | None:
    """Return the effect of a truth, or None if its parameters are not those of the library."""
    known = {p.name for p in effect_info(truth["effect"]).parameters}
    if not set(truth["params"]) <= known:
        return None
    if "axes" in truth:
        return Effect(truth["effect"], axes=tuple(truth["axes"]), parameters=truth["params"])
    return Effect(truth["effect"], truth["axis"], truth["params"])


def off(case, robot, effects) -> float:
    """Return the rms difference of the torque over its standard deviation, worst axis and log."""
    worst = 0.0
    for log in [*case.estimation, *case.validation]:
        run = simulate(robot, log.velocity_ref_rad_s, effects=effects)
        found = run["torque_cmd_nm"].to_numpy()
        if len(found) < len(log.torque_nm):
            return float("nan")
        rms = np.sqrt(np.mean((found - log.torque_nm) ** 2, axis=0))
        worst = max(worst, float((rms / log.torque_nm.std(axis=0)).max()))
    return worst


def main(folder: Path) -> None:
    """Print a line for each case: the difference without and with its effect."""
    labels = folder / "labels.json"
    truths = json.loads(labels.read_text()) if labels.exists() else {}
    for path in sorted(p for p in folder.iterdir() if p.is_dir()):
        case = read_case(path)
        robot = load_robot(case.robot_path)
        line = f"{path.name:28} without {off(case, robot, []):.1e}"
        for truth in truths.get(path.name, {}).get("truth", []):
            effect = effect_of(truth)
            if effect is not None:
                line += f"   with its effect {off(case, robot, [effect]):.1e}"
        print(line, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
