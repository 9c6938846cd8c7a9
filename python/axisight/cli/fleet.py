"""``axisight diagnose --fleet``: many robots or many days."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from axisight.cli.common import OUT, bars, errors
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.fleet import diagnose_fleet, fleet_cases, fleet_table, render_fleet, trends
from axisight.gap import Settings
from axisight.storage import write_bytes, write_whole


def run_fleet(
    folder: Path,
    out: Path | None,
    settings: Settings,
    workers: int | None,
    scheduler: str | None,
    for_one: Sequence[str],
) -> None:
    """Diagnose a fleet into ``out``: verdicts, ``fleet.parquet`` and ``fleet.html``.

    ``for_one``: options given that are for a single diagnosis, and refused.
    """
    with errors("stopped; finished verdicts stay, run again to go on"), bars() as progress:
        if for_one:
            raise InputError(f"--fleet: expected without {', '.join(for_one)}")
        if out is None:
            raise InputError("--out: expected a folder for the verdicts of a fleet")
        verdicts = diagnose_fleet(
            folder,
            out / "verdicts",
            settings,
            workers=workers or os.cpu_count() or 1,
            scheduler=scheduler,
            progress=progress,
        )
        table = fleet_table(fleet_cases(folder), verdicts)
        series = trends(table)
        write_bytes(out / "fleet.parquet", table.to_parquet(index=False))
        write_whole(out / "fleet.html", render_fleet(folder.resolve().name, table, series))
    shown = Table("case", "verdict", "causes")
    for name, verdict in verdicts.items():
        causes = [Effect(c["effect"], c["axis"]).label for c in verdict.get("causes", ())]
        shown.add_row(name, verdict.get("verdict", verdict.get("error")), ", ".join(causes))
    OUT.print(shown)
    for t in series:
        if t.changes:
            way = "grows" if t.per_case > 0 else "shrinks"
            what = f"{Effect(t.effect, t.axis).label} {way}, {t.per_case:.3g} {t.unit} a case"
            OUT.print(f"{t.machine or folder.name}: {what}", markup=False, soft_wrap=True)
    OUT.print(f"table: {out / 'fleet.parquet'}; page: {out / 'fleet.html'}", soft_wrap=True)
