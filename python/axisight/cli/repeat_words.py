"""What ``axisight repeat`` prints."""

from __future__ import annotations

import numpy as np
import xarray as xr
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from axisight.arguments import counted
from axisight.cli.common import say
from axisight.cli.screen import OUT
from axisight.repeats import DayComparison

# Share of a change whose power is printed: what repeats of a machine in good order may have.
_ASKED = 0.02


def show(found: DayComparison, *, places: bool) -> None:
    """Print the runs, the parameters, the torque, and what moved."""
    _show_days(found)
    OUT.print(_parameter_table(found))
    hidden = [name for name in found.of_load if name not in found.moved]
    if hidden:
        say(f"{counted(len(hidden), 'parameter')} of the load: not moved")
    OUT.print(_torque_table(found.torque))
    if places:
        OUT.print(_place_table(found))
    for text in found.findings:
        say(f"note: {text}")
    _show_power(found)
    for line in verdict(found):
        say(line)


def verdict(found: DayComparison) -> list[str]:
    """Return a line for each thing that moved, or that nothing did."""
    if not found.tested:
        return ["one day: nothing was compared"]
    if not found.moved:
        return [
            f"nothing moved: no difference between days beyond the scatter of runs (level {found.level:g})"
        ]
    return [_moved(found, name) for name in found.moved]


def _moved(found: DayComparison, name: str) -> str:
    if name not in found.parameters["parameter"].values:
        axis = int(name.rpartition(" ")[2])
        one = found.torque.sel(axis=axis)
        return (
            f"moved: {name}, {one['smooth_between_nm'].item():.3g} {one['unit'].item()} between days, "
            f"{one['smooth_within_nm'].item():.2g} {one['unit'].item()} within (p {one['p_adjusted'].item():.2g})"
        )
    one = found.parameters.sel(parameter=name)
    day = _widest(one)
    unit = "" if _percent(found, name) is not None else f" {one['unit'].item()}"
    return (
        f"moved: {name}, {_change(found, name, day)}{unit} from {found.reference} to {day} "
        f"(p {one['p_adjusted'].item():.2g})"
    )


def _widest(one: xr.Dataset) -> str:
    """Return the day that differs most from the reference day."""
    return str(one["day"].values[int(np.abs(one["change"].values).argmax())])


def _change(found: DayComparison, name: str, day: str) -> str:
    """Return a change with the half width of its interval, as a share where the value is believed."""
    one = found.parameters.sel(parameter=name, day=day)
    mean = one["change"].item()
    half = one["change_upper"].item() - mean
    scale = _percent(found, name)
    return (
        f"{mean:+.2g} ± {half:.2g}"
        if scale is None
        else f"{scale * mean:+.2g} ± {scale * half:.2g} %"
    )


def _percent(found: DayComparison, name: str) -> float | None:
    """Return per cent of the reference day's value in one unit of a parameter; None if it is not believed."""
    one = found.parameters.sel(parameter=name, day=found.reference)
    known = np.isfinite(found.shares.sel(parameter=name, day=found.reference).item())
    return 100.0 / one["value"].item() if known else None


def _show_days(found: DayComparison) -> None:
    counts = np.bincount(found.day_of_run)
    parts = [f"{day} ({n})" for day, n in zip(found.days, counts, strict=True)]
    say(
        f"{counted(len(found.runs), 'run')} of one motion on {counted(len(found.days), 'day')}: {', '.join(parts)}"
    )


def _parameter_table(found: DayComparison) -> Table:
    """Return a row for each parameter of an axis, and for those of the load that moved."""
    shown = Table(title="parameters", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    shown.add_column("parameter", no_wrap=True)
    for head in (found.reference, "largest change", "least", "p", ""):
        shown.add_column(escape(head), justify="right", no_wrap=head == "largest change")
    table = found.parameters
    for name in (str(x) for x in table["parameter"].values):
        one = table.sel(parameter=name)
        if name in found.of_load and not one["moved"].item():
            continue
        shown.add_row(*(escape(cell) for cell in _cells(found, name, one)))
    return shown


def _cells(found: DayComparison, name: str, one: xr.Dataset) -> list[str]:
    value, unit = one["value"].sel(day=found.reference).item(), str(one["unit"].item())
    cells = [name, f"{value:.3g} {unit}"]
    if not found.tested:
        return [*cells, "-", "-", "-", ""]
    scale = _percent(found, name)
    least = one["least_change"].item()
    return [
        *cells,
        _change(found, name, _widest(one)),
        f"{least:.2g}" if scale is None else f"{scale * least:.2g} %",
        f"{one['p_adjusted'].item():.1g}",
        _word(one),
    ]


def _word(one: xr.Dataset) -> str:
    return "moved" if one["moved"].item() else "echo" if one["echo"].item() else ""


def _torque_table(torque: xr.Dataset) -> Table:
    shown = Table("torque of", title="torque", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in ("within days", "between", "floor", "any day", "p", ""):
        shown.add_column(head, justify="right", no_wrap=True)
    for axis in torque["axis"].values:
        one = torque.sel(axis=axis)
        low, high = (100 * one[key].item() for key in ("floor_lower", "floor_upper"))
        p = one["p_adjusted"].item()
        shown.add_row(
            f"axis {axis}",
            f"{one['within_nm'].item():.3g} {one['unit'].item()}",
            f"{one['between_nm'].item():.2g} {one['unit'].item()}" if np.isfinite(p) else "-",
            f"{low:.3g} to {high:.3g} %",
            f"{100 * one['floor_any_day'].item():.3g} %" if np.isfinite(p) else "-",
            f"{p:.2g}" if np.isfinite(p) else "-",
            _word(one),
        )
    return shown


def _place_table(found: DayComparison) -> Table:
    shown = Table(
        "place",
        title="torque between days / within days [Nm]",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for axis in found.places["axis"].values:
        shown.add_column(f"axis {axis}", justify="right")
    for place in found.places["place"].values:
        one = found.places.sel(place=place)
        pairs = zip(one["between_nm"].values, one["within_nm"].values, strict=True)
        shown.add_row(str(place), *(f"{b:.2g} / {w:.2g}" for b, w in pairs))
    return shown


def _show_power(found: DayComparison) -> None:
    """Print with which probability a change of 2 % would have been found."""
    if not found.tested:
        return
    power = found.power(_ASKED)
    known = power.where(np.isfinite(power), drop=True)
    if known.size:
        pairs = zip(known["parameter"].values, known.values, strict=True)
        parts = ", ".join(f"{name} {100 * p:.0f} %" for name, p in pairs)
        say(f"power: a change of {100 * _ASKED:g} % would be found with probability: {parts}")
