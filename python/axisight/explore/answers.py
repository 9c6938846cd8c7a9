"""Results that the page asks for, computed in the page's own thread."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from axisight.errors import AxisightError
from axisight.explore.regard import Against, in_bins, order_spectrum, quantity, responses
from axisight.explore.session import AS_GIVEN, Seen, Session, Version
from axisight.gap.simulator.own_parameters import with_values

Array = NDArray[np.float64]
Curve = tuple[Array, Array]

# Most dots of a scatter.
_DOTS = 6000
_FREQUENCIES = 300


@dataclass(frozen=True)
class Answer:
    """One log under the simulator as given, as chosen and as pinned."""

    log: int
    version: Version
    given: Seen
    now: Seen
    pins: dict[str, Seen]


def answer(session: Session, log: int, version: Version, pins: dict[str, Version]) -> Answer:
    """Return what changed causes show at once; raises InputError as `Session.see` does."""
    return Answer(
        log,
        version,
        session.see(log),
        session.see(log, version),
        {name: session.see(log, pin) for name, pin in pins.items()},
    )


@dataclass(frozen=True)
class Rest:
    """Slow results: the gap of all validation logs (n_axes,) [1], and the content of the open tab.

    - ``held_given``, ``held_floor``: the same gap for the simulator as given, and for noise alone.
    - ``against``: dots and bin means by version.
    - ``orders``, ``responses``: by version; the latter also as measured.
    - ``problem``: why a result is missing.
    """

    axis: int
    held: Array
    held_given: Array
    held_floor: Array
    against: tuple[Curve, dict[str, Curve]] | None = None
    orders: dict[str, Curve] = field(default_factory=dict)
    responses: dict[str, Curve] = field(default_factory=dict)
    problem: str = ""


def rest(session: Session, last: Answer, axis: int, tab: str, against: Against) -> Rest:
    """Return the slow results, for when no slider moves; ``axis`` from 0."""
    held = session.held_gap(last.version)
    log, versions = session.logs[last.log], {"given": last.given, "now": last.now}
    counted = session.view.counted(log)[:, 0]
    residuals = {key: seen.residual[:, axis] for key, seen in versions.items()}
    out = Rest(axis, held, session.held_given, session.held_floor)
    if tab == "against":
        x = quantity(log, axis, against)
        step = max(1, len(x) // _DOTS)
        shown = {key: np.where(counted > 0, r, np.nan) for key, r in residuals.items()}
        means = {key: in_bins(x, r)[:2] for key, r in shown.items()}
        return replace(out, against=((x[::step], shown["now"][::step]), means))
    if tab == "orders":
        orders = {key: order_spectrum(log, axis, counted * r) for key, r in residuals.items()}
        return replace(out, orders=orders)
    if tab == "responses":
        return _with_responses(session, last, out)
    return out


def _with_responses(session: Session, last: Answer, out: Rest) -> Rest:
    nyquist = 0.5 / session.logs[0].sample_time_s
    frequency_hz = np.geomspace(min(0.5, nyquist / 10), 0.9 * nyquist, _FREQUENCIES)
    curves: dict[str, Curve] = {}
    problem = ""
    try:
        for key, version in (("given", AS_GIVEN), ("now", last.version)):
            robot = with_values(session.robot, dict(version.robot_values))
            own = {e.label: e for e in (*robot.effects, *version.effects)}
            found = responses(robot, tuple(own.values()), frequency_hz)
            curves[key] = (frequency_hz, np.abs(found[:, :, out.axis]))
    except AxisightError as error:
        problem = f"no linear response: {error}"
    seen = session.measured_gains
    if seen is not None:
        curves["measured"] = (seen[0], seen[1][:, :, out.axis])
    return replace(out, responses=curves, problem=problem)
