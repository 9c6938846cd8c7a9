"""The output files of ``axisight diagnose``: checked before it runs, written at its end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import axisight
from axisight.cli.model_options import ModelOptions
from axisight.cli.outcomes import (
    diagnosis_writes,
    write_found_experiment,
    write_found_model,
    write_found_posterior,
    write_found_remainder,
    write_found_signals,
)
from axisight.cli.screen import is_output
from axisight.gap import Diagnosis
from axisight.gap.facts.experiment import experiment_files
from axisight.gap.intake.inputs import Inputs
from axisight.posterior.files import check_library
from axisight.storage import check_targets

# Suffixes of earlier results that an output may replace without --force.
_RESULTS = {
    "--json": (".json",),
    "--report": (".html", ".htm"),
    "--signals": (".parquet", ".mcap", ".rrd"),
    "--posterior": (".nc",),
    "--remainder-table": (".toml",),
    "--write-model": (),
}


@dataclass(frozen=True)
class Outputs:
    """The requested output files of a diagnosis, None for options not given.

    ``to_show``: the experiment must show an effect. ``force``: any existing file may be replaced. ``play_joints``:
    an MJCF gets a joint for backlash.
    """

    json: Path | None
    report: Path | None
    model: Path | None
    signals: Path | None
    posterior: Path | None
    remainder: Path | None
    next_experiment: Path | None
    to_show: bool
    force: bool
    play_joints: bool = False

    def given(self) -> list[str]:
        """Return the given options, each of which prints a line when its file is written."""
        files = {
            "--json": None if is_output(self.json) else self.json,
            "--report": self.report,
            "--write-model": self.model,
            "--signals": self.signals,
            "--posterior": self.posterior,
            "--remainder-table": self.remainder,
            "--next-experiment": self.next_experiment,
        }
        return [option for option, path in files.items() if path is not None]

    def check(self, inputs: Inputs, read: Sequence[Path]) -> None:
        """Raise OutputError, naming the option, for files that cannot be written or must not be replaced.

        ``read`` are the files that the command reads. Raises MissingExtraError if a library for the signals
        or the posterior is not installed.
        """
        targets = {
            "--json": None if is_output(self.json) else self.json,
            "--report": self.report,
            "--write-model": self.model,
            "--signals": self.signals,
            "--posterior": self.posterior,
            "--remainder-table": self.remainder,
        }
        if self.next_experiment is not None:
            for path in experiment_files(self.next_experiment):
                targets[f"--next-experiment, {path.name}"] = path
        if self.signals is not None:
            for path in axisight.signal_files.files_of(self.signals)[1:]:
                targets[f"--signals, {path.name}"] = path
        check_targets(targets, inputs=read, replaces=_RESULTS, force=self.force)
        if self.model is not None:
            axisight.write_back.check_target(inputs.robot_source, self.model, overwrite=self.force)
        if self.signals is not None:
            axisight.signal_files.check_target(self.signals, overwrite=True)
        if self.posterior is not None:
            check_library()

    def writes(
        self, found: Diagnosis, inputs: Inputs, options: ModelOptions
    ) -> list[Callable[[], object]]:
        """Return a function for each output that writes it."""
        out = diagnosis_writes(found, self.json, self.report)
        if self.next_experiment is not None:
            folder = self.next_experiment
            out.append(partial(write_found_experiment, found, folder, to_show=self.to_show))
        if self.model is not None:
            write = partial(write_found_model, force=self.force, play_joints=self.play_joints)
            out.append(partial(write, found, inputs, options, self.model))
        if self.signals is not None:
            out.append(partial(write_found_signals, found, self.signals))
        if self.posterior is not None:
            out.append(partial(write_found_posterior, found, self.posterior))
        if self.remainder is not None:
            out.append(partial(write_found_remainder, found, self.remainder))
        return out
