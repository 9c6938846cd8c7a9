"""Diagnoses that run for an assistant: with progress, until it cancels them, one at a time."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import anyio
from mcp.server.mcpserver import Context

from axisight.arguments import shown
from axisight.cli.model_options import ModelOptions
from axisight.errors import InputError
from axisight.explore.background import Background
from axisight.gap import Diagnosis, Settings, diagnose
from axisight.gap.intake.inputs import Inputs

# Diagnoses that stay in memory with their logs.
_KEPT = 8
_EVERY_S = 0.1


@dataclass(frozen=True)
class Kept:
    """A diagnosis with what it was made of."""

    inputs: Inputs
    options: ModelOptions
    settings: Settings
    found: Diagnosis


class Diagnoses:
    """The diagnoses of a server by their numbers, ``d1`` first; the last eight are kept.

    ``run`` is `axisight.diagnose`, or what a test puts in its place.
    """

    def __init__(self, run: Callable[..., Any] = diagnose) -> None:
        self._run = run
        self._kept: OrderedDict[str, Kept] = OrderedDict()
        self._count = 0
        self._one_at_a_time = anyio.Lock()
        self._last: Background | None = None

    def keep(self, kept: Kept) -> str:
        """Keep a diagnosis; return its number."""
        self._count += 1
        number = f"d{self._count}"
        self._kept[number] = kept
        while len(self._kept) > _KEPT:
            self._kept.popitem(last=False)
        return number

    def get(self, number: str) -> Kept:
        """Return a kept diagnosis; raise InputError, with the known numbers, for an unknown one."""
        if number not in self._kept:
            known = ", ".join(self._kept) or "none yet: call diagnose first"
            raise InputError(f"diagnosis: expected one of {known}, got {shown(number)}")
        return self._kept[number]

    async def run(
        self, context: Context[Any, Any], inputs: Inputs, settings: Settings, **more: Any
    ) -> Diagnosis:
        """Return the diagnosis of inputs; ``more`` are further options of `axisight.diagnose`.

        Reports every step to the client. When the client cancels, the diagnosis stops at its next step.
        """
        async with self._one_at_a_time:
            # One that was cancelled may still be in its last step.
            while self._last is not None and self._last.busy:
                await anyio.sleep(_EVERY_S)
            self._last = work = Background(
                inputs.name,
                inputs.robot,
                inputs.estimation,
                inputs.validation,
                settings,
                inputs.simulated,
                run=partial(self._run, **more),
            )
            await _watched(work, context)
        if work.error is not None:
            raise work.error
        found: Diagnosis = work.found
        return found


async def _watched(work: Background, context: Context[Any, Any]) -> None:
    told = 0
    work.start()
    try:
        while work.busy:
            if work.steps > told:
                told = work.steps
                # Steps are counted over all stages, as progress must not fall; their total is not known.
                await context.report_progress(told, None, work.says)
            await anyio.sleep(_EVERY_S)
    finally:
        work.stop()
