"""The page: choices on the left, curves on the right; simulations run outside the event loop."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import panel as pn
from bokeh.events import RangesUpdate
from bokeh.models import Range1d
from numpy.typing import NDArray

from axisight.errors import AxisightError
from axisight.explore import words
from axisight.explore.answers import Answer, Rest, answer, rest
from axisight.explore.beside import Beside
from axisight.explore.controls import Controls
from axisight.explore.exports import figure_png, robot_text, verdict_text
from axisight.explore.plots import Orders, Regard, Responses, time_figures
from axisight.explore.regard import AGAINST
from axisight.explore.state import PINS, State
from axisight.gap.facts.axis_names import axis_label
from axisight.gap.facts.compared_quantity import torque_of

Array = NDArray[np.float64]

# Slow results wait until the sliders have rested for this long.
_REST_MS = 250
_POLL_MS = 300
# Side by side if both columns fit, else stacked; never wider than the screen.
_LEFT = {"flex": "0 1 420px", "min-width": "min(100%, 300px)", "margin-right": "15px"}
_RIGHT = {"flex": "1 1 480px", "min-width": "min(100%, 320px)"}

_LABELS = {"given": "as given", "now": "as chosen"} | {p: f"pin {p}" for p in PINS}
_MODES = {
    "closed_loop": "Closed loop: robot and controller are simulated together, from the logged references.",
    "inverse_dynamics": "Inverse dynamics: the torque is computed from the measured motion.",
}

_TABS = ("time", "against", "orders", "bands", "responses")


def _whole(duration_s: float) -> tuple[float, float]:
    """Return the time range of a whole log, with a margin to the frame."""
    return -0.01 * duration_s, 1.01 * duration_s


def _told(error: Exception) -> str:
    """Return the message of an error, with its type if axisight did not raise it."""
    return str(error) if isinstance(error, AxisightError) else f"{type(error).__name__}: {error}"


class Page:
    """One visit of the page; all visits share the choices in ``state``."""

    def __init__(self, state: State) -> None:
        self.state = state
        session = state.session
        names = session.robot.axis_names
        self._labels = [axis_label(i + 1, names) for i in range(session.n_axes)]
        kind = session.robot.axis_is_prismatic
        self._units = [("N", "m") if prismatic else ("Nm", "rad") for prismatic in kind]
        self._busy = self._wanted = False
        self._resting: Any = None
        self._last: Answer | None = None
        self._doc: Any = pn.state.curdoc
        self._beside = Beside(self._doc)
        self._time = Range1d(*_whole(session.logs[state.log].duration_s))
        self._curves = time_figures(self._time)
        self._curves["torque"].figure.on_event(RangesUpdate, lambda _event: self._zoomed())
        self._regard, self._orders = Regard(), Orders()
        self._responses = Responses(session.n_axes, session.robot.axis_names)
        self._head = self._html("")
        self._bands = self._html("")
        self._gaps, self._held, self._message = self._html(""), self._html(""), self._html("")
        self._pinned = self._html("")
        self._controls = Controls(state, self.changed)
        self._build_choices()
        self._build_diagnosis()
        self._tabs = self._build_tabs()
        self._first()
        pn.state.on_session_destroyed(lambda _context: self._beside.close())

    def _first(self) -> None:
        """Draw everything once, so that every figure has its ranges."""
        state = self.state
        try:
            self._answered(answer(state.session, state.log, state.version(), dict(state.pins)))
            for tab in _TABS[1:]:
                if self._last is not None:
                    self._rested(rest(state.session, self._last, state.axis, tab, "speed"))
        except AxisightError as error:
            self._say(str(error))

    def _html(self, text: str) -> Any:
        return pn.pane.HTML(text, stylesheets=[words.STYLE], sizing_mode="stretch_width")

    # What is chosen

    def _build_choices(self) -> None:
        session, state = self.state.session, self.state
        # By number, because two logs may share a name.
        logs = {
            f"{i + 1}. {log.name} ({role})": i
            for i, (log, role) in enumerate(zip(session.logs, session.roles, strict=True))
        }
        axes = {f"axis {label}": i for i, label in enumerate(self._labels)}
        self._log = pn.widgets.Select(name="log", options=logs, value=state.log, width=220)
        self._axis = pn.widgets.Select(name="axis", options=axes, value=state.axis, width=130)
        self._log.param.watch(self._other_log, "value")
        self._axis.param.watch(self._other_axis, "value")
        self._against = pn.widgets.Select(
            name="against", options={words_: key for key, words_ in AGAINST.items()}, width=200
        )
        self._against.param.watch(lambda _event: self._rest_soon(), "value")
        self._pins = [
            pn.widgets.Button(name=f"pin as {pin}", width=110, margin=(5, 5)) for pin in PINS
        ]
        for pin, button in zip(PINS, self._pins, strict=True):
            button.on_click(partial(self._pin, pin))
        self._unpin = pn.widgets.Button(name="clear pins", width=110, margin=(5, 5))
        self._unpin.on_click(self._clear_pins)
        self._downloads = [
            self._download("robot file", "robot.toml", self._robot),
            self._download("verdict", "verdict.json", self._verdict),
            self._download("figure", "figure.png", self._figure),
        ]

    def _download(self, label: str, name: str, make: Callable[[], bytes]) -> Any:
        def made() -> io.BytesIO:
            try:
                return io.BytesIO(make())
            except AxisightError as error:
                self._say(str(error))
                return io.BytesIO(f"# not made: {error}\n".encode())

        return pn.widgets.FileDownload(
            callback=made, filename=name, label=label, width=110, margin=(5, 5)
        )

    def _robot(self) -> bytes:
        return robot_text(self.state.session, self.state.version()).encode()

    def _verdict(self) -> bytes:
        if self.state.said is None:
            raise AxisightError("No verdict yet: run the diagnosis, or start with --verdict FILE.")
        return verdict_text(self.state.said.document).encode()

    def _figure(self) -> bytes:
        state, session = self.state, self.state.session
        given, seen = session.see(state.log), session.see(state.log, state.version())
        unit = self._units[state.axis][0]
        return figure_png(session, state.log, state.axis, given, seen, unit)

    def _other_log(self, event: Any) -> None:
        self.state.log = event.new
        duration_s = self.state.session.logs[event.new].duration_s
        self._time.start, self._time.end = _whole(duration_s)
        self._time.reset_start, self._time.reset_end = self._time.start, self._time.end
        self.ask()

    def _other_axis(self, event: Any) -> None:
        self.state.axis = event.new
        if self._last is not None:
            self._draw(self._last)
        self.ask()

    def _pin(self, pin: str, _event: Any) -> None:
        self.state.pins[pin] = self.state.version()
        self.ask()

    def _clear_pins(self, _event: Any) -> None:
        self.state.pins.clear()
        self.ask()

    # The diagnosis

    def _build_diagnosis(self) -> None:
        self._said = pn.Column(sizing_mode="stretch_width")
        self._run = pn.widgets.Button(name="run the diagnosis", width=170, button_type="primary")
        self._stop = pn.widgets.Button(name="stop", width=80, disabled=True)
        self._says = self._html("")
        self._bar = pn.indicators.Progress(
            value=0, max=100, sizing_mode="stretch_width", max_width=360, visible=False
        )
        self._run.on_click(lambda _event: self._begin())
        self._stop.on_click(lambda _event: self.state.background.stop())
        # A list instead of a checkbox, whose label screen readers do not find here.
        self._refitted = pn.widgets.Select(
            name="own parameters",
            options={"as given": False, "re-fitted": True},
            value=self.state.refitted,
            width=200,
        )
        self._refitted.param.watch(self._refit, "value")
        self._polls: Any = None
        self._show_said()
        if self.state.background.state != "idle":
            # Another visit may have started or finished the diagnosis.
            self._poll()

    def _begin(self) -> None:
        self.state.background.start()
        self._poll()

    def _poll(self) -> None:
        if self._polls is None:
            self._polls = self._doc.add_periodic_callback(self._look, _POLL_MS)
        self._look()

    def _look(self) -> None:
        """Show the progress of the diagnosis, and its verdict at the end."""
        work = self.state.background
        self._run.disabled, self._stop.disabled = work.busy, not work.busy
        kind = "problem" if work.state == "failed" else "quiet"
        self._says.object = words.text(": ".join(filter(None, (work.state, work.says))), kind)
        self._bar.visible, self._bar.value = work.busy, int(100 * work.share)
        if work.busy:
            return
        if self._polls is not None:
            self._doc.remove_periodic_callback(self._polls)
            self._polls = None
        if work.state == "done" and work.document is not None:
            self.state.hear(work.document)
            self._show_said()

    def _show_said(self) -> None:
        said = self.state.said
        title = self.state.title()
        self._head.object = words.heading(title, 1) + self._compared()
        if self._doc is not None:
            self._doc.title = title
        self._refitted.visible = said is not None
        self._downloads[1].disabled = said is None
        if said is None:
            self._said.objects = [self._html(words.text("Not run yet.", "quiet"))]
            return
        rows: list[Any] = [self._html(words.of_verdict(said, self._labels))]
        for cause in said.causes:
            button = pn.widgets.Button(name="add the cause", width=120, margin=(5, 5))
            button.on_click(partial(self._add_said, cause.effect))
            rows.append(pn.Column(self._html(words.of_cause(cause)), button))
        if not said.causes:
            rows.append(self._html(words.text("It names no cause.", "quiet")))
        self._said.objects = rows

    def _add_said(self, effect: Any, _event: Any) -> None:
        self._controls.add(effect)

    def _refit(self, event: Any) -> None:
        self.state.refitted = event.new
        self.ask()

    # Simulation

    def changed(self, problem: str = "") -> None:
        """Simulate again after a change of causes; ``problem`` says why a change failed."""
        self._say(problem)
        if not problem:
            self.ask()

    def ask(self) -> None:
        """Request a simulation of the present choice; only the last request counts."""
        self._wanted = True
        if not self._busy:
            self._begin_answer()

    def _begin_answer(self) -> None:
        self._busy, self._wanted = True, False
        state = self.state
        task = partial(
            answer, state.session, state.log, state.version(), dict(sorted(state.pins.items()))
        )
        self._beside.submit(task, self._answered)

    def _answered(self, found: Answer | Exception) -> None:
        self._busy = False
        if isinstance(found, Exception):
            self._say(_told(found))
        elif found.log == self.state.log:
            self._last = found
            self._draw(found)
        if self._wanted:
            self._begin_answer()
        else:
            self._rest_soon()

    def _rest_soon(self) -> None:
        if self._resting is not None:
            self._doc.remove_timeout_callback(self._resting)
        self._resting = self._doc.add_timeout_callback(self._at_rest, _REST_MS)

    def _at_rest(self) -> None:
        self._resting = None
        if self._last is None or self._busy:
            return
        state, tab = self.state, _TABS[self._tabs.active]
        task = partial(rest, state.session, self._last, state.axis, tab, self._against.value)
        self._beside.submit(task, self._rested)

    # Drawing

    def _say(self, problem: str) -> None:
        self._message.object = words.text(problem, "problem") if problem else ""

    def _zoomed(self) -> None:
        for curves in self._curves.values():
            curves.draw()

    def _draw(self, found: Answer) -> None:
        axis, session = self.state.axis, self.state.session
        log = session.logs[found.log]
        torque, angle = self._units[axis]
        versions = {"given": found.given, "now": found.now, **found.pins}
        counts = session.counts(found.log)
        self._curves["torque"].show("measured", log.time_s, found.now.measured, axis, counts)
        self._curves["position"].show("measured", log.time_s, log.position_rad, axis)
        for key in ("given", "now", *PINS):
            seen = versions.get(key)
            shown: tuple[Array | None, ...] = (None, None, None)
            if seen is not None:
                shown = (seen.simulated, seen.residual, seen.position_rad)
            for name, values in zip(("torque", "residual", "position"), shown, strict=True):
                # Positions are known at the ends of a log too.
                shows = None if name == "position" else counts
                self._curves[name].show(key, log.time_s, values, axis, shows)
        for name, label in (
            ("torque", f"torque [{torque}]"),
            ("residual", f"sim. − measured [{torque}]"),
            ("position", f"position [{angle}]"),
        ):
            self._curves[name].figure.yaxis.axis_label = label
        self._gaps.object = words.heading(f"Gap on {log.name}") + self._gap_table(
            versions, log.name
        )
        self._bands.object = self._band_table(versions)
        self._pinned.object = "".join(
            words.text(f"{pin}: {self.state.said_of(made)}", "quiet")
            for pin, made in sorted(self.state.pins.items())
        )
        if found.now.broken_at_s is not None:
            self._say(f"The simulation breaks off at {found.now.broken_at_s:.2f} s.")
        else:
            self._say("")

    def _gap_table(self, versions: dict[str, Any], log: str) -> str:
        head = ("axis", *(_LABELS[k] for k in versions))
        rows = [
            (label, *(words.share(v.gap[i]) for v in versions.values()))
            for i, label in enumerate(self._labels)
        ]
        return words.table(head, rows, "gaps", f"Gap on log {log}, by axis", unseen=True)

    def _band_table(self, versions: dict[str, Any]) -> str:
        session = self.state.session
        out = words.text(words.BANDS, "quiet")
        for i, label in enumerate(self._labels):
            head = ("Hz", *(_LABELS[k] for k in versions))
            rows = [
                (f"{low:g} to {high:g}", *(words.share(v.bands[i, b]) for v in versions.values()))
                for b, (low, high) in enumerate(session.bands)
            ]
            out += words.table(head, rows, f"bands-{i + 1}", f"Axis {label}")
        return out

    def _rested(self, found: Rest | Exception) -> None:
        if isinstance(found, Exception):
            self._say(_told(found))
            return
        self._held.object = words.heading("Gap on all validation logs") + words.table(
            ("axis", "as given", "as chosen", "floor"),
            [
                (label, *map(words.share, row))
                for label, *row in zip(
                    self._labels, found.held_given, found.held, found.held_floor, strict=True
                )
            ],
            "held",
            "Gap on all validation logs, by axis",
            unseen=True,
        )
        unit, angle = self._units[found.axis]
        if found.against is not None:
            dots, means = found.against
            self._regard.dots.data = {"x": dots[0], "y": dots[1]}
            for key, (x, y) in means.items():
                self._regard.show(key, x, y)
            label = {"speed": f"{angle}/s", "angle": angle, "load": unit, "time": "s"}
            chosen = self._against.value
            self._regard.figure.xaxis.axis_label = f"{AGAINST[chosen]} [{label[chosen]}]"
            self._regard.figure.yaxis.axis_label = f"simulated − measured [{unit}]"
        for key, (orders, amplitude) in found.orders.items():
            self._orders.show(key, orders, amplitude)
        self._orders.figure.yaxis.axis_label = f"amplitude in the residual [{unit}]"
        self._responses.of(found.axis)
        if found.responses:
            self._responses.show(found.responses)
        if found.problem:
            self._say(found.problem)

    # The whole

    def _build_tabs(self) -> Any:
        panes = {
            "time": pn.Column(
                self._html(words.text(f"{words.TIME} {self.state.session.filter_words}", "quiet")),
                *(
                    pn.pane.Bokeh(c.figure, sizing_mode="stretch_width")
                    for c in self._curves.values()
                ),
                sizing_mode="stretch_width",
            ),
            "residual against": pn.Column(
                self._html(words.text(words.AGAINST, "quiet")),
                self._against,
                pn.pane.Bokeh(self._regard.figure, sizing_mode="stretch_width"),
                sizing_mode="stretch_width",
            ),
            "orders": pn.Column(
                self._html(words.text(words.ORDERS, "quiet")),
                pn.pane.Bokeh(self._orders.figure, sizing_mode="stretch_width"),
                sizing_mode="stretch_width",
            ),
            "bands": self._bands,
            "response": pn.Column(
                self._html(words.text(words.RESPONSE, "quiet")),
                pn.pane.Bokeh(self._responses.figure, sizing_mode="stretch_width"),
                sizing_mode="stretch_width",
            ),
        }
        tabs = pn.Tabs(*panes.items(), sizing_mode="stretch_width")
        tabs.param.watch(lambda _event: self._rest_soon(), "active")
        return tabs

    def view(self) -> Any:
        """Return the whole page."""
        left = pn.Column(
            pn.FlexBox(self._log, self._axis),
            self._gaps,
            self._held,
            self._message,
            self._html(words.heading("Causes put in by hand")),
            self._controls.view(),
            self._html(words.heading("Diagnosis")),
            pn.Row(self._run, self._stop),
            self._says,
            self._bar,
            self._said,
            self._refitted,
            self._html(words.heading("Compare simulators")),
            pn.FlexBox(*self._pins, self._unpin),
            self._pinned,
            self._html(words.heading("Export")),
            pn.FlexBox(*self._downloads),
            styles=_LEFT,
        )
        self._tabs.styles = _RIGHT
        return pn.Column(
            self._head,
            pn.FlexBox(left, self._tabs, sizing_mode="stretch_width"),
            sizing_mode="stretch_width",
            margin=10,
        )

    def _compared(self) -> str:
        session = self.state.session
        how = _MODES[session.view.mode]
        gap = f"{words.GAP} {torque_of(session.view.compared)}."
        robot, case = session.robot.name, session.name
        named = "" if case in (robot, "") else words.text(f"Case {case}", "quiet")
        return named + words.text(f"{how} {session.filter_words} {gap}", "quiet")
