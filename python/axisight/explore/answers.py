"""What the page asks for, worked out in its own thread."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from axisight.errors import AxisightError
from axisight.explore.regard import Against, in_bins, order_spectrum, quantity, responses
from axisight.explore.session import AS_GIVEN, Seen, Session, Version

Array = NDArray[np.float64]
Curve = tuple[Array, Array]

# Dots of a scatter.
_DOTS = 6000
_FREQUENCIES = 300


@dataclass(frozen=True)
class Answer:
    """One log under the simulator as given, as chosen, and as pinned."""

    log: int
    version: Version
    given: Seen
    now: Seen
    pins: dict[str, Seen]


def answer(session: Session, log: int, version: Version, pins: dict[str, Version]) -> Answer:
    """Return what a change of causes shows at once; raises InputError as `Session.see`."""
    return Answer(
        log,
        version,
        session.see(log),
        session.see(log, version),
        {name: session.see(log, pin) for name, pin in pins.items()},
    )


@dataclass(frozen=True)
class Rest:
    """What may come later: the gap of all validation logs (n_axes,), and what the open tab shows.

    ``against``: dots and means by version; ``orders`` and ``responses`` by version; ``problem``: why one of
    them cannot be.
    """

    axis: int
    held: Array
    against: tuple[Curve, dict[str, Curve]] | None = None
    orders: dict[str, Curve] = field(default_factory=dict)
    responses: dict[str, Curve] = field(default_factory=dict)
    problem: str = ""


def rest(session: Session, last: Answer, axis: int, tab: str, against: Against) -> Rest:
    """Return what is shown once nothing moves; ``axis`` from 0."""
    held = session.held_gap(last.version)
    log, versions = session.logs[last.log], {"given": last.given, "now": last.now}
    residuals = {key: seen.residual[:, axis] for key, seen in versions.items()}
    if tab == "against":
        x = quantity(log, axis, against)
        step = max(1, len(x) // _DOTS)
        means = {key: in_bins(x, r)[:2] for key, r in residuals.items()}
        return Rest(axis, held, ((x[::step], residuals["now"][::step]), means))
    if tab == "orders":
        return Rest(
            axis, held, orders={k: order_spectrum(log, axis, r) for k, r in residuals.items()}
        )
    if tab == "responses":
        return _with_responses(session, last, axis, held)
    return Rest(axis, held)


def _with_responses(session: Session, last: Answer, axis: int, held: Array) -> Rest:
    nyquist = 0.5 / session.logs[0].sample_time_s
    frequency_hz = np.geomspace(min(0.5, nyquist / 10), 0.9 * nyquist, _FREQUENCIES)
    out: dict[str, Curve] = {}
    try:
        for key, version in (("given", AS_GIVEN), ("now", last.version)):
            robot = session.robot.with_parameters(dict(version.robot_values))
            own = {e.label: e for e in (*robot.effects, *version.effects)}
            found = responses(robot, tuple(own.values()), frequency_hz)
            out[key] = (frequency_hz, np.abs(found[:, :, axis]))
    except AxisightError as error:
        return Rest(axis, held, responses=out, problem=f"no linear response: {error}")
    return Rest(axis, held, responses=out)
