"""``axisight diagnose --fleet``: diagnose many robots or many days."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from axisight.cli.common import bars, errors, say, write_each
from axisight.cli.screen import OUT
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.fleet import diagnose_fleet, fleet_cases, fleet_table, render_fleet, trends
from axisight.fleet.trends import Trend
from axisight.gap import Settings
from axisight.storage import check_folder, check_targets, write_bytes, write_whole


def run_fleet(
    folder: Path,
    out: Path | None,
    settings: Settings,
    workers: int | None,
    scheduler: str | None,
    for_one: Sequence[str],
) -> None:
    """Diagnose every case below ``folder``; write verdicts, ``fleet.parquet``, ``fleet.html`` to ``out``.

    ``for_one`` lists the given options that only a single diagnosis can use; any of them is refused.
    """
    with errors("stopped; finished verdicts stay, run again to go on"):
        if for_one:
            raise InputError(
                f"--fleet: expected no options of a single diagnosis, got {', '.join(for_one)}"
            )
        if out is None:
            raise InputError("--out: expected a folder for the verdicts of a fleet, got none")
        data, page = out / "fleet.parquet", out / "fleet.html"
        check_targets({"--out, table": data, "--out, page": page})
        check_folder(out / "verdicts")
        with bars() as progress:
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
        _show(folder.name, verdicts, series)
        title = folder.resolve().name
        write_each(
            [
                lambda: write_bytes(data, table.to_parquet(index=False)),
                lambda: write_whole(page, render_fleet(title, table, series)),
            ]
        )
        say(f"table: {data}; page: {page}")


def _show(fleet: str, verdicts: dict[str, dict[str, Any]], series: Sequence[Trend]) -> None:
    shown = Table("case", "verdict", "causes")
    for name, verdict in verdicts.items():
        causes = [Effect(c["effect"], c["axis"]).label for c in verdict.get("causes", ())]
        cells = (name, verdict.get("verdict", verdict.get("error")), ", ".join(causes))
        shown.add_row(*(escape(str(cell)) for cell in cells))
    OUT.print(shown)
    for t in series:
        if t.changes:
            way = "grows" if t.per_case > 0 else "shrinks"
            what = f"{Effect(t.effect, t.axis).label} {way}, {t.per_case:.3g} {t.unit} a case"
            say(f"{t.machine or fleet}: {what}")
