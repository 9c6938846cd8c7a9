"""What is added to a diagnosis only on request: signals of all logs, and a modelled remainder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from axisight.gap.facts.result import Diagnosis
from axisight.gap.facts.settings import Settings
from axisight.gap.facts.simulator_variant import Variant
from axisight.gap.measure.torque_traces import signals_of
from axisight.gap.modelled.remainder import with_modelled_remainder
from axisight.gap.views.view import View
from axisight.logs import Log


@dataclass(frozen=True)
class Requested:
    """Whether signals and a modelled remainder are asked for."""

    signals: bool = False
    remainder: bool = False


def with_requested(
    out: Diagnosis,
    requested: Requested,
    view: View,
    held: Sequence[Log],
    after: Variant,
    settings: Settings,
    *,
    logged: bool,
) -> Diagnosis:
    """Return the diagnosis with what was asked for.

    ``held``: the validation logs; ``after``: the simulator with the causes; ``logged``: whether torques were logged.
    """
    if requested.remainder:
        out = with_modelled_remainder(out, view, held, after, settings)
    if requested.signals:
        out = replace(out, signals=signals_of(view, held, after, logged=logged))
    return out
