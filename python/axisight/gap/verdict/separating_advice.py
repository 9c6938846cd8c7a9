"""The experiment that separates effects which one data set cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

from axisight.effects import effect_info

# Experiments in the order in which they are preferred.
_ADVICE = {
    "amplitudes": "Repeat the multisine at three amplitudes, and in another pose (another preload).",
    "wide_band": "Excite a wider band, up to several times the bandwidth of the controller.",
    "speeds": "Move at several constant speeds in both directions, with and without a load.",
    "slow_turns": "Move slowly at two constant speeds. Log a joint-side sensor too, if there is one.",
    "poses": "Hold and move in several poses, with and without a known payload.",
}


def separating_experiment(labels: Sequence[str]) -> str:
    """Return the experiment that would separate candidates named ``effect@axis``."""
    effects = {label.split("@")[0] for label in labels}
    axes = {label.split("@")[1] for label in labels if "@" in label}
    if len(axes) > 1 and len(effects) == 1:
        return "Move one axis at a time and hold the others."
    for experiment, advice in _ADVICE.items():
        if all(experiment in effect_info(name).shown_by for name in effects):
            return advice
    return (
        "Record one axis at a time: first slow motion in both directions at several speeds and poses, then a "
        "multisine at three amplitudes."
    )
