"""Assembly of the explorer: from the user's inputs to a served page."""

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
    """Return the state that a page starts with; ``progress`` is called with label, done and total.

    ``verdict``: file of an earlier diagnosis. Raises InputError as `Session` does, and for a file that is no
    verdict or belongs to another robot.
    """
    said = None if verdict is None else read_said(verdict)
    progress("preparing the simulator", 0, 2)
    given = (inputs.name, inputs.robot, inputs.estimation, inputs.validation)
    session = Session(*given, settings, inputs.simulated)
    progress("preparing the simulator", 1, 2)
    # The page opens at the largest gap, with its curves already computed.
    log, axis = session.largest_gap()
    progress("preparing the simulator", 2, 2)
    # Keeps one thread for the sliders; the number of threads changes no result.
    fewer = replace(settings, threads=max(1, settings.threads - 1))
    work = Background(*given, fewer, inputs.simulated)
    return State(session, work, said, log, axis)


def served(state: State, port: int = 0) -> Served:
    """Return the server of a state's page; raises InputError for a port in use."""
    # The server's content policy blocks other origins, so the resources must be inline.
    pn.extension(design="native", inline=True)
    return serve(lambda: Page(state).view(), port, state.title())
