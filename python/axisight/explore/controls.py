"""The list of causes: a card with sliders for each, and the controls that add one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import panel as pn
from bokeh.models.formatters import PrintfTickFormatter

from axisight.effects import Effect, EffectParameter, effect_info, noun, title
from axisight.errors import AxisightError
from axisight.explore import words
from axisight.explore.choices import Place, slider_range, usable, usual
from axisight.explore.state import State
from axisight.gap.facts.axis_names import own_name
from axisight.report.wording import place

# Limited by this width and by the screen.
_FITTING = {"sizing_mode": "stretch_width", "max_width": 380}
# Steps over the range of a slider.
_STEPS = 400


class Controls:
    """Sliders for the causes of a state; calls ``changed`` with an error message, empty without an error."""

    def __init__(self, state: State, changed: Callable[[str], None]) -> None:
        self._state, self._changed = state, changed
        self._names = state.session.robot.axis_names
        self._none = pn.pane.HTML(words.text("None: the simulator as given.", "quiet"))
        self._none.stylesheets = [words.STYLE]
        # Cards stay and are hidden. A browser that removes elements while it draws others can show one twice,
        # and loses clicks on redrawn ones.
        self._cards = pn.Column(self._none, **_FITTING)
        self._made: dict[str, _Card] = {}
        mode = state.session.view.mode
        self._offered = usable(state.session.robot, inverse_dynamics=mode == "inverse_dynamics")
        self._name = pn.widgets.Select(
            name="cause", options={title(n): n for n in self._offered}, width=190
        )
        self._place = pn.widgets.Select(name="where", width=115)
        self._name.param.watch(lambda _event: self._places(), "value")
        self._add = pn.widgets.Button(
            name="add", width=45, align="end", margin=(5, 10), button_type="primary"
        )
        self._add.on_click(lambda _event: self.add(usual(self._name.value, self._place.value)))
        self._places()
        self._show()

    def view(self) -> Any:
        """Return the view: the cards and the controls that add a cause."""
        return pn.Column(self._cards, pn.FlexBox(self._name, self._place, self._add), **_FITTING)

    def add(self, effect: Effect) -> None:
        """Add a cause."""
        try:
            self._state.add(effect)
        except AxisightError as error:
            self._changed(str(error))
            return
        self._show()
        self._changed("")

    def _places(self) -> None:
        options = {_at(p, self._names): p for p in self._offered[self._name.value]}
        kept = self._place.value
        if options != self._place.options:
            self._place.options = options
            self._place.value = kept if kept in options.values() else next(iter(options.values()))

    def _take_out(self, label: str, _event: Any) -> None:
        self._state.take_out(label)
        self._show()
        self._changed("")

    def _moved(self, label: str, parameter: str, event: Any) -> None:
        self._state.set_value(label, parameter, float(event.new))
        self._changed("")

    def _show(self) -> None:
        chosen = {effect.label: effect for effect in self._state.chosen}
        for label, effect in chosen.items():
            if label in self._made:
                self._made[label].take(effect)
            else:
                self._made[label] = self._card(effect)
                self._cards.append(self._made[label].view)
        for label, card in self._made.items():
            card.view.visible = label in chosen
        self._none.visible = not chosen

    def _card(self, effect: Effect) -> _Card:
        return _Card(
            effect, partial(self._take_out, effect.label), partial(self._moved, effect.label)
        )


def _at(where: Place, names: Sequence[str]) -> str:
    """Return a place in words, with the joint's name if it has one."""
    if isinstance(where, tuple):
        return place(None, where)
    name = "" if where is None else own_name(where, names)
    return f"{place(where)} ({name})" if name else place(where)


class _Card:
    """The card of a cause: its name, a button that removes it, a slider per parameter."""

    def __init__(
        self,
        effect: Effect,
        out: Callable[[Any], None],
        moved: Callable[[str, Any], None],
    ) -> None:
        button = pn.widgets.Button(name="take it out", width=100, margin=(0, 5))
        button.on_click(out)
        head = pn.pane.HTML(words.text(words.name_of(effect)), stylesheets=[words.STYLE], width=240)
        self._parameters = effect_info(effect.name).parameters
        pairs = zip(self._parameters, effect.values(), strict=True)
        self._sliders = [_slider(p, value) for p, value in pairs]
        for p, slider in zip(self._parameters, self._sliders, strict=True):
            slider.param.watch(partial(moved, p.name), "value")
        self.view = pn.Column(
            pn.FlexBox(head, button),
            *self._sliders,
            **_FITTING,
            margin=(0, 0, 8, 0),
            styles={"border-left": "3px solid #0072b2", "padding-left": "8px"},
        )

    def take(self, effect: Effect) -> None:
        """Show the values of an effect, in fitting ranges."""
        for p, slider, value in zip(self._parameters, self._sliders, effect.values(), strict=True):
            shown = _shown(p, value)
            if slider.value != shown["value"]:
                slider.param.update(**shown)


def _shown(p: EffectParameter, value: float) -> dict[str, float]:
    """Return the range and the position of a slider."""
    low, high = slider_range(p, value)
    value = min(max(value, p.lower), p.upper)
    return {"start": low, "end": high, "step": (high - low) / _STEPS, "value": value}


def _slider(p: EffectParameter, value: float) -> Any:
    unit = "" if p.unit == "1" else f" [{p.unit}]"
    return pn.widgets.EditableFloatSlider(
        **_shown(p, value),
        name=f"{_plain(p.name)}{unit}",
        fixed_start=p.lower,
        fixed_end=p.upper,
        format=PrintfTickFormatter(format="%.4g"),
        sizing_mode="stretch_width",
        max_width=340,
        margin=(0, 5),
    )


# Units at the ends of names, which the page shows beside them.
_UNITS: tuple[str, ...]
_UNITS = ("_nm_s2_rad2", "_nm_s2_rad", "_nm_s_rad", "_nm_rad3", "_nm_rad", "_rad_nm", "_rad_s")
_UNITS += ("_kg_m2", "_rad", "_nm", "_kg", "_hz", "_1_w", "_s", "_m")


def _plain(name: str) -> str:
    """Return a parameter's name in words, without its unit."""
    for unit in _UNITS:
        if name.endswith(unit):
            return noun(name.removesuffix(unit))
    return noun(name)
