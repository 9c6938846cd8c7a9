"""Tools on the gap between simulator and logs: diagnose, explain, design the next experiment."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import anyio.to_thread
import numpy as np
from mcp.server.mcpserver import Context
from mcp.types import CallToolResult

from axisight.cli.assistants import fields
from axisight.cli.assistants.answers import (
    DiagnosisAnswer,
    ExperimentAnswer,
    ExplainAnswer,
    answer,
    told_errors,
)
from axisight.cli.assistants.folder import Folder
from axisight.cli.assistants.running import Diagnoses, Kept
from axisight.cli.assistants.verdict_files import verdict_file
from axisight.cli.assistants.words import next_calls
from axisight.cli.common import write_each
from axisight.cli.model_options import ModelOptions
from axisight.cli.outputs import Outputs
from axisight.cli.robot import load_simulator, parse_effect, parse_effects
from axisight.cli.screen import OUT
from axisight.cli.show import show_diagnosis
from axisight.cli.summary import summary
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.gap import Diagnosis, ExperimentLimits, Settings
from axisight.gap.facts.experiment import Experiment, experiment_files
from axisight.gap.facts.trace import Trace
from axisight.gap.intake.inputs import Inputs, read_inputs
from axisight.gap.prepare.used_part import Used
from axisight.gap.separate.asked import LIMITS
from axisight.gap.simulator.tolerances import with_tolerances
from axisight.report.account import account
from axisight.storage import check_targets

_LARGE = ("detection_limits", "ranking", "trace")


@dataclass(frozen=True)
class _Given:
    """The input of a diagnosis as a tool received it."""

    case: str | None
    logs: Sequence[str]
    model: str | None
    validation: Sequence[str]
    columns: str | None
    columns_text: str | None
    effects: Sequence[str]
    options: ModelOptions
    used: Used

    def read(self, folder: Folder) -> tuple[Inputs, str]:
        """Return simulator and logs, and what reading them says."""
        if (self.case is None) == (not self.logs):
            raise InputError("case, logs: expected a case folder or logs, got both or neither")
        if self.case is None and self.model is None:
            raise InputError("model: expected the simulator of the logs, got none")
        paths = [folder.log("logs", name) for name in self.logs]
        if self.case is not None:
            paths = [folder.read("case", self.case)]
        load = partial(load_simulator, given=parse_effects(self.effects), options=self.options)
        with OUT.recorded() as said:
            inputs = read_inputs(
                paths,
                None if self.model is None else folder.model("model", self.model),
                [folder.log("validation", name) for name in self.validation],
                folder.columns(self.columns, self.columns_text),
                load,
                self.used,
                bare=self.options.load,
                untrusted=True,
            )
        return inputs, said()


class DiagnosisTools:
    """The tools on diagnoses of cases and logs in a folder."""

    def __init__(self, folder: Folder, diagnoses: Diagnoses) -> None:
        self.folder = folder
        self._diagnoses = diagnoses

    @told_errors
    async def diagnose(
        self,
        context: Context[Any, Any],
        case: fields.Case = None,
        logs: fields.Logs = None,
        model: fields.Model = None,
        validation: fields.Validation = None,
        columns: fields.Columns = None,
        columns_text: fields.ColumnsText = None,
        effects: fields.Effects = None,
        base: fields.Base = None,
        tip: fields.Tip = None,
        payload: fields.Payload = None,
        from_s: fields.StartS = 0.0,
        to_s: fields.StopS = None,
        moving: fields.Moving = False,
        cutoff_hz: fields.CutoffHz = None,
        despite: fields.Despite = None,
        max_causes: fields.MaxCauses = Settings.max_causes,
        seed: fields.Seed = 0,
        time_limit_s: fields.TimeLimit = Settings.time_limit_s,
        full: fields.Full = False,
        write_verdict: fields.WriteVerdict = None,
        write_report: fields.WriteReport = None,
        write_model: fields.WriteModel = None,
    ) -> Annotated[CallToolResult, DiagnosisAnswer]:
        """Find why the simulator differs from measured logs: which causes, of what size, how sure.

        Give a case, or a model with logs. Takes from 5 s to several minutes, reports progress, and can be
        cancelled. Gaps are rms errors as shares of the torque of each axis. Values of causes have SI units
        and 95 % intervals.
        """
        options = ModelOptions(base, tip, payload)
        given = _Given(
            case,
            logs or (),
            model,
            validation or (),
            columns,
            columns_text,
            effects or (),
            options,
            Used(from_s, to_s, moving, False),
        )
        outputs = Outputs(
            self.folder.write("write_verdict", write_verdict),
            self.folder.write("write_report", write_report),
            self.folder.write("write_model", write_model),
            signals=None,
            posterior=None,
            remainder=None,
            next_experiment=None,
            to_show=False,
            force=False,
        )
        settings = Settings(
            seed=seed,
            cutoff_hz=cutoff_hz,
            max_causes=max_causes,
            despite=tuple(despite or ()),
            time_limit_s=time_limit_s,
            threads=os.cpu_count() or 1,
        )
        inputs, said = await anyio.to_thread.run_sync(given.read, self.folder)
        outputs.check(inputs, inputs.files())
        settings = with_tolerances(settings, inputs.robot, inputs.robot_source)
        found = await self._diagnoses.run(context, inputs, settings)
        kept = Kept(inputs, options, settings, found)
        number = self._diagnoses.keep(kept)
        return await anyio.to_thread.run_sync(self._diagnosed, number, kept, said, outputs, full)

    @told_errors
    async def explain(
        self,
        diagnosis: fields.NumberOrNone = None,
        verdict: fields.VerdictFile = None,
        tables: fields.Tables = False,
    ) -> Annotated[CallToolResult, ExplainAnswer]:
        """Say how the verdict of a diagnosis came about: comparisons, why rivals lost, moves, rules.

        Of a diagnosis of this server by its number, or of a verdict file in the folder. Log-odds are in nats. Computes
        nothing new.
        """
        if (diagnosis is None) == (verdict is None):
            raise InputError("diagnosis, verdict: expected one of them, got both or neither")
        if verdict is not None:
            if tables:
                raise InputError("tables: expected false beside a verdict file, got true")
            head, trace = verdict_file(self.folder, verdict)
            return self._explained(verdict, trace, f"{head}\n")
        found = self._diagnoses.get(str(diagnosis)).found
        if not tables:
            return self._explained(str(diagnosis), found.trace)
        with OUT.recorded() as said:
            show_diagnosis(found, verbose=True)
        return self._explained(str(diagnosis), found.trace, f"{said()}\n")

    def _explained(self, name: str, trace: Trace, head: str = "") -> CallToolResult:
        """Return the account of a trace, below the text ``head``."""
        told = account(trace)
        text = head + "\n".join(told.lines())
        first = [line for head, rivals in told.comparisons for line in (head, *rivals)]
        content = ExplainAnswer(
            diagnosis=name,
            comparisons=first,
            moves=[*told.moves, *told.named],
            rules=list(told.rules),
            work=list(told.work),
        )
        return answer(self.folder.shown(text), content)

    @told_errors
    async def next_experiment(
        self,
        context: Context[Any, Any],
        diagnosis: fields.Number,
        to_show: fields.ToShow = None,
        velocity_limit_rad_s: fields.VelocityLimits = None,
        travel_limit_rad: fields.TravelLimits = None,
        torque_limit_nm: fields.TorqueLimits = None,
        acceleration_limit_rad_s2: fields.AccelerationLimits = None,
        room_m: fields.Room = None,
        write_to: fields.WriteExperiment = None,
    ) -> Annotated[CallToolResult, ExperimentAnswer]:
        """Design the next experiment after a diagnosis: it tells open causes apart, or shows an effect.

        After an unknown verdict it is a record that shows more. Repeats the diagnosis, so takes as long as it did.
        Limits default to those of the robot's model, else to what the logs reach.
        A person has to check the motion before a robot runs it.
        """
        kept = self._diagnoses.get(diagnosis)
        target = self.folder.write("write_to", write_to)
        if target is not None:
            check_targets({f"write_to, {p.name}": p for p in experiment_files(target)})
        effect: Effect | str | None = to_show
        if to_show is not None and to_show != LIMITS:
            effect = parse_effect(to_show, "to_show").on(kept.inputs.robot)
        within = ExperimentLimits(
            velocity_rad_s=_one_or_each(velocity_limit_rad_s),
            travel_rad=_one_or_each(travel_limit_rad),
            torque_nm=_one_or_each(torque_limit_nm),
            acceleration_rad_s2=_one_or_each(acceleration_limit_rad_s2),
            room_m=room_m,
        )
        found = await self._diagnoses.run(
            context, kept.inputs, kept.settings, separate=True, to_show=effect, within=within
        )
        made = found.experiment
        written: list[Path] = []
        if made is not None and made.decides and target is not None:
            written = made.write(target)
        names = [self.folder.relative(path.resolve()) for path in written]
        advice = found.next_experiment or "No experiment: nothing is open, or no motion decides it."
        text = "\n".join([advice, *(f"experiment: {name}" for name in names)])
        return answer(text, _experiment(diagnosis, advice, made, names))

    def _diagnosed(
        self, number: str, kept: Kept, said: str, outputs: Outputs, full: bool
    ) -> CallToolResult:
        """Write the files of a diagnosis, and return the answer."""
        found = kept.found
        with OUT.recorded() as told:
            write_each(outputs.writes(found, kept.inputs, kept.options))
        paths = filter(None, (outputs.json, outputs.report, outputs.model))
        written = [self.folder.relative(p.resolve()) for p in paths if p.exists()]
        lines = summary(found, 100, steps=next_calls(found, number, self.folder))
        text = "\n".join([f"diagnosis {number}", *lines, told()])
        left_out = [] if full else list(_LARGE)
        content = DiagnosisAnswer(
            diagnosis=number, verdict=_verdict(found, left_out), left_out=left_out, written=written
        )
        return answer(self.folder.shown(f"{said}{text}"), content)


def _verdict(found: Diagnosis, left_out: Sequence[str]) -> dict[str, Any]:
    return {key: value for key, value in found.to_verdict().items() if key not in left_out}


def _one_or_each(given: list[float] | None) -> float | list[float] | None:
    return given[0] if given is not None and len(given) == 1 else given


def _experiment(
    number: str, advice: str, made: Experiment | None, written: list[str]
) -> ExperimentAnswer:
    plan = None if made is None else made.plan
    peaks = [] if plan is None else np.abs(plan.references.period).max(axis=(0, 1)).tolist()
    return ExperimentAnswer(
        diagnosis=number,
        advice=advice,
        decides=None if made is None else made.decides,
        motion=None if plan is None else plan.motion,
        axes=[] if plan is None else list(plan.axes),
        period_s=None if plan is None else plan.references.period_s,
        repeats=None if plan is None else plan.repeats,
        peak_rad_s=peaks,
        limits=[] if plan is None else [str(limit) for limit in plan.limits],
        written=written,
    )
