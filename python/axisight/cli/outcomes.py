"""Write the files of a diagnosis, and print a line about each."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import axisight
from axisight import report as pages
from axisight.cli.common import say, write_text
from axisight.cli.model_options import ModelOptions
from axisight.cli.screen import is_output
from axisight.gap import Diagnosis
from axisight.gap.facts.wording import listed
from axisight.gap.intake.inputs import Inputs
from axisight.gap.verdict.headline import clear_changes
from axisight.remainder import save_remainder
from axisight.write_back import Written
from axisight.write_back.refitted import refitted_gains

_TO_SHOW = "--to-show designs one that shows what these logs would not"


def write_found_signals(found: Diagnosis, target: Path) -> None:
    """Write the signals of a diagnosis; print the path, and that of the layout beside it."""
    path = axisight.signal_files.write_signals(found.signals, target, overwrite=True)
    say(f"signals: {path}")
    for layout in axisight.signal_files.files_of(path)[1:]:
        say(f"layout for Foxglove: {layout}")


def write_found_remainder(found: Diagnosis, target: Path) -> None:
    """Write the modelled remainder as a table, if there is one, and print the path."""
    left = found.remainder
    if left is None or left.modelled is None or not left.modelled.model.terms:
        say("no table was written: the remainder has no term")
        return
    save_remainder(left.modelled.model, target, overwrite=True)
    say(f"remainder: {target}")


def write_found_posterior(found: Diagnosis, target: Path) -> None:
    """Write the posterior of a diagnosis; print the path and how much held-out torque its band holds."""
    assert found.posterior is not None
    path = axisight.posterior.save_posterior(found.posterior, target)
    inside = [one.attrs["inside"] for one in found.posterior.held_out]
    share = (
        f"; its 95 % band holds {sum(inside) / len(inside):.1%} of held-out torque"
        if inside
        else ""
    )
    say(f"posterior: {path}{share}")


def write_found_model(
    found: Diagnosis,
    inputs: Inputs,
    options: ModelOptions,
    target: Path,
    *,
    force: bool,
    play_joints: bool = False,
) -> None:
    """Write the simulator with the causes found, and print what the file cannot state.

    Also print the causes that have rivals, and the re-fitted parameters that are not written.
    """
    modelled = None if found.remainder is None else found.remainder.modelled
    if modelled is not None and not modelled.model.terms:
        modelled = None
    if not found.causes and modelled is None and not refitted_gains(inputs.robot, found.refit):
        say("no model was written: no cause was named")
        return
    made = axisight.write_back.write_model(
        inputs.robot_source,
        inputs.robot,
        found.causes,
        target,
        refit=found.refit,
        overwrite=force,
        drives=options.drives(inputs.robot_source) if options.given() else None,
        play_joints=play_joints,
        remainder=modelled,
    )
    say(f"model: {made.path}, with {', '.join(made.placed) or 'none'}")
    for label in made.left_out:
        say(f"no place in it for {label}: {made.why[label]}")
    for cause in found.causes:
        if cause.rivals and cause.label in made.placed:
            others = listed(cause.rivals, "or")
            say(f"in doubt: {cause.label} is in it, but this data cannot tell it from {others}")
    _say_refitted(found, made)


def _say_refitted(found: Diagnosis, made: Written) -> None:
    """Print re-fitted parameters that are not written, because the gap after includes their part."""
    left = {k: v for k, v in found.refit.items() if k not in (*made.placed, *made.own)}
    changes = clear_changes(left)
    if changes and found.causes:
        say(
            f"not in it: what was re-fitted within its tolerance ({', '.join(changes)}); "
            f"part of the fall of the gap is that"
        )


def write_found_experiment(found: Diagnosis, folder: Path, *, to_show: bool) -> None:
    """Write the designed experiment if it decides between the causes; otherwise print why there is none.

    ``to_show``: the user asked for an experiment that shows an effect.
    """
    made = found.experiment
    if made is None:
        why = "there is none that would show it" if to_show else _why_none(found)
        say(f"no experiment: {why}")
    elif not made.decides:
        say("no experiment was written: none of those tried decides")
    else:
        for path in made.write(folder):
            say(f"experiment: {path}")


def _why_none(found: Diagnosis) -> str:
    """Return why no experiment was designed."""
    if not found.causes:
        return f"no cause was named, so none has a rival ({_TO_SHOW})"
    if found.equivalent:
        return f"no motion tells {listed(found.equivalent[0])} apart"
    return f"nothing is open ({_TO_SHOW})"


def diagnosis_writes(
    found: Diagnosis, json: Path | None, report: Path | None
) -> list[Callable[[], object]]:
    """Return functions that write the verdict and the report of a diagnosis, for the paths that are given."""

    def verdict(target: Path) -> None:
        write_text(target, found.to_json())
        if not is_output(target):
            say(f"verdict: {target}")

    def page(target: Path) -> None:
        pages.save_report(found, target)
        say(f"report: {target}")

    wanted = ((verdict, json), (page, report))
    return [partial(write, target) for write, target in wanted if target is not None]
