"""The explorer put together: from what a user hands over to a page that is served."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import panel as pn

from axisight.explore.background import Background
from axisight.explore.page import Page
from axisight.explore.said import read_said
from axisight.explore.server import Served, serve
from axisight.explore.session import Session
from axisight.explore.state import State
from axisight.gap.facts.settings import Settings
from axisight.gap.intake.inputs import Inputs


def prepared(
    inputs: Inputs,
    settings: Settings,
    verdict: Path | None,
    progress: Callable[[str, int, int], None],
) -> State:
    """Return the state that a page begins with; ``progress`` is told how far it is.

    ``verdict``: file of an earlier diagnosis. Raises InputError as `Session`, and for a verdict that is none
    or not of this robot.
    """
    said = None if verdict is None else read_said(verdict)
    progress("preparing the simulator", 0, 2)
    given = (inputs.name, inputs.robot, inputs.estimation, inputs.validation)
    session = Session(*given, settings, inputs.simulated)
    progress("preparing the simulator", 1, 2)
    # The page opens where there is most to see; the curves there are ready.
    log, axis = session.largest_gap()
    progress("preparing the simulator", 2, 2)
    # One thread is left to the sliders; threads change no result.
    fewer = replace(settings, threads=max(1, settings.threads - 1))
    work = Background(*given, fewer, inputs.simulated)
    return State(session, work, said, log, axis)


def served(state: State, port: int = 0) -> Served:
    """Return the running page of a state; raises InputError for a port in use."""
    # In line with what the server gives: nothing from elsewhere.
    pn.extension(design="native", inline=True)
    return serve(lambda: Page(state).view(), port, state.title())
