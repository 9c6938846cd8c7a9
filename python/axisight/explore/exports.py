"""Files from the explorer: the robot with its causes, the verdict, a figure."""

from __future__ import annotations

import io
import json
from importlib.metadata import version
from typing import Any

import matplotlib.figure
import numpy as np

from axisight import palette
from axisight.explore.session import Seen, Session, Version
from axisight.gap.facts.axis_names import axis_label
from axisight.gap.simulator.own_parameters import split
from axisight.report.curves import thin
from axisight.robot_file import Provenance, identified
from axisight.robot_file.document import render


def robot_text(session: Session, made: Version) -> str:
    """Return the robot file of a version; raises RobotError for values that no body can have."""
    own = {e.label for e in session.robot.effects}
    values, gains = split(session.robot, dict(made.robot_values))
    # A cause set by hand replaces the fitted one.
    by_hand = {e.label for e in made.effects}
    fitted = [e for e in gains if e.label not in by_hand]
    acting = [e for e in (*made.effects, *fitted) if e.acts]
    removed = [e for e in made.effects if not e.acts and e.label in own]
    found = identified(values, Provenance("explorer"), effects=acting, removed=removed)
    text = render(session.robot, found, "")
    # The head names a file of identified errors, which values set by hand do not have.
    body = "".join(text.splitlines(True)[1:])
    causes = ", ".join(e.label for e in acting) or "none"
    return f"# Axisight {version('axisight')}, explorer. Causes put in by hand: {causes}.\n{body}"


def verdict_text(document: dict[str, Any]) -> str:
    """Return the text of a verdict file."""
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


_POINTS = 4000


def figure_png(session: Session, log: int, axis: int, given: Seen, seen: Seen, unit: str) -> bytes:
    """Return a PNG figure of one log and axis (from 0): torque above, residual below."""
    time, counts = session.logs[log].time_s, session.counts(log)
    figure = matplotlib.figure.Figure(figsize=(10, 6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    curves = (
        (above, seen.measured, palette.MEASURED, "measured"),
        (above, given.simulated, palette.BEFORE, "as given"),
        (above, seen.simulated, palette.AFTER, "with the causes"),
        (below, given.residual, palette.BEFORE, f"as given, gap {given.gap[axis]:.1%}"),
        (below, seen.residual, palette.AFTER, f"with the causes, gap {seen.gap[axis]:.1%}"),
    )
    for panel, values, color, label in curves:
        t, v = thin(time, np.where(counts, values[:, axis], np.nan), _POINTS)
        panel.plot(t, v, color=color, lw=0.8, label=label)
    # Names come from users; a dollar sign would start a formula.
    name = session.logs[log].name
    label = axis_label(axis + 1, session.robot.axis_names)
    title = f"{session.robot.name}, {name}, axis {label}\n{session.filter_words}"
    above.set_title(title, parse_math=False, fontsize="medium")
    above.set_ylabel(f"torque [{unit}]")
    below.set_ylabel(f"simulated less measured [{unit}]")
    below.set_xlabel("time [s]")
    for panel in (above, below):
        panel.legend(loc="upper right", fontsize="small")
        panel.grid(alpha=0.3)
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=150)
    return out.getvalue()
