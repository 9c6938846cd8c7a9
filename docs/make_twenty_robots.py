"""Write docs/twenty_robots.md from the texts, table and results in benches (twenty_robots_page.md, .toml, .json).

Usage: python docs/make_twenty_robots.py

`benches/twenty_robots.py` writes the JSON; its page says how.
"""

import json
import tomllib
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parent / "twenty_robots.md"
BENCHES = PAGE.parents[1] / "benches"


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _found(row: dict[str, Any]) -> str:
    if "error" in row:
        return "failed: " + " ".join(row["error"].split())[-160:].replace("|", "/")
    if "refusal" in row:
        return "refused"
    return f"{row['verdict'].replace('_', ' ')}: {', '.join(row['named']) or 'nothing'}"


def _results(rows: list[dict[str, Any]]) -> list[str]:
    lines = [
        "| robot | kind | withheld | verdict and causes | right | gap in MuJoCo |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        withheld = row.get("withheld", "–" if "refusal" in row else "real recording")
        mark = {True: "yes", False: "no"}.get(row.get("right"), "–")
        gaps = row.get("mujoco")
        gap = f"{_percent(gaps[0])} → {_percent(gaps[1])}" if gaps else "–"
        cells = (row["name"], row["kind"], withheld, _found(row), mark, gap)
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _counts(rows: list[dict[str, Any]]) -> str:
    made = [row for row in rows if "withheld" in row]
    first = sum(row.get("right", False) for row in made)
    alone = sum(row.get("right", False) and len(row["named"]) == 1 for row in made)
    played = [row["mujoco"] for row in rows if "mujoco" in row]
    fell = sum(after < before for before, after in played)
    tenth = sum(after < 0.1 * before for before, after in played)
    return (
        f"Of {len(made)} machines, {first} have the withheld effect as the first cause, {alone} of them as the only "
        f"one. The gap in MuJoCo falls for {fell} of {len(played)} patched models, for {tenth} of them below a tenth."
    )


def _models(table: list[dict[str, Any]], rows: dict[str, dict[str, Any]]) -> list[str]:
    lines = ["| robot | model | licence | recording | commands |", "|---|---|---|---|---|"]
    for entry in table:
        source = f"[{entry['repository']}](https://github.com/{entry['repository']})"
        recording = entry.get("recording", "")
        heard = f"[{recording}](https://github.com/{recording})" if recording else "MuJoCo"
        commands = "<br>".join(
            f"`{line}`" for line in rows.get(entry["name"], {}).get("commands", [])
        )
        model = f"{source}, `{entry['path']}`"
        cells = (entry["name"], model, entry["licence"], heard, commands or "–")
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _refused(rows: list[dict[str, Any]]) -> list[str]:
    lines: list[str] = []
    for row in rows:
        if "refusal" in row:
            lines += [f"**{row['name']}** is refused:", "", "```text", row["refusal"], "```", ""]
    return lines


def render() -> str:
    """Return the page."""
    table = tomllib.loads((BENCHES / "twenty_robots.toml").read_text())["robot"]
    rows = json.loads((BENCHES / "twenty_robots.json").read_text())
    made = {
        "results": [_counts(rows), "", *_results(rows)],
        "refused": _refused(rows),
        "models": _models(table, {row["name"]: row for row in rows}),
    }
    text = (BENCHES / "twenty_robots_page.md").read_text(encoding="utf-8")
    for name, lines in made.items():
        text = text.replace(f"{{{name}}}\n", "\n".join(lines).rstrip() + "\n")
    return text


if __name__ == "__main__":
    PAGE.write_text(render(), encoding="utf-8")
