"""The command ``axisight explore``."""

from __future__ import annotations

import os
import webbrowser
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from axisight.cli.common import (
    AtRests,
    Columns,
    CutoffHz,
    Despite,
    From,
    MaxBytes,
    Model,
    Moving,
    Simulated,
    To,
    Untrusted,
    Validation,
    bars,
    errors,
    say,
)
from axisight.cli.model_options import Base, Load, ModelOptions, Tip
from axisight.cli.robot import GivenEffects, load_simulator, parse_effects
from axisight.errors import MissingExtraError
from axisight.gap.facts.settings import Settings
from axisight.gap.intake.inputs import read_inputs
from axisight.gap.prepare.used_part import Used
from axisight.gap.simulator.tolerances import with_tolerances


def explore_command(
    case_or_logs: Annotated[
        list[Path],
        typer.Argument(help="A case folder, or logs; the simulator may stand first."),
    ],
    model: Model = None,
    base: Base = None,
    tip: Tip = None,
    payload: Load = None,
    validation: Validation = None,
    columns: Columns = None,
    verdict: Annotated[
        Path | None, typer.Option(help="Verdict of an earlier diagnosis, to try its causes.")
    ] = None,
    cutoff_hz: CutoffHz = None,
    despite: Despite = None,
    effect: GivenEffects = None,
    simulated: Simulated = None,
    start_s: From = 0.0,
    stop_s: To = None,
    moving: Moving = False,
    cut_at_rests: AtRests = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the page. Default: a free one.")
    ] = 0,
    no_open: Annotated[
        bool, typer.Option("--no-open", help="Print the address and open no browser.")
    ] = False,
    untrusted: Untrusted = False,
    max_bytes: MaxBytes = None,
) -> None:
    """Look at logs beside the simulator on a local page, and try causes by hand."""
    with errors(stopped="stopped"):
        if find_spec("panel") is None:
            raise MissingExtraError("axisight explore needs Panel: pip install axisight[explore]")
        options = ModelOptions(base, tip, payload)
        load = partial(load_simulator, given=parse_effects(effect), options=options)
        inputs = read_inputs(
            case_or_logs,
            model,
            validation or [],
            columns,
            load,
            Used(start_s, stop_s, moving, cut_at_rests),
            simulated or [],
            bare=options.load,
            untrusted=untrusted,
            max_bytes=max_bytes,
        )
        settings = Settings(
            cutoff_hz=cutoff_hz, despite=tuple(despite or ()), threads=os.cpu_count() or 1
        )
        settings = with_tolerances(settings, inputs.robot, inputs.robot_source)
        app = import_module("axisight.explore.app")
        with bars() as progress:
            state = app.prepared(inputs, settings, verdict, progress)
        served = app.served(state, port)
        say(f"explorer: {served.url}")
        say("for this machine only; Ctrl-C ends it")
        if not no_open:
            webbrowser.open(served.url)
        served.run()
