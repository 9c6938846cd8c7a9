"""The server ``axisight mcp``, asked by the official client in the same process."""

from __future__ import annotations

import json
import os
import shutil
import threading
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import anyio
import h5py
import numpy as np
import pandas as pd
import pytest
from jsonschema import Draft202012Validator

from axisight.cli.demo import write_demo_case
from axisight.effects import Effect
from axisight.errors import InputError
from axisight.excitation import References
from axisight.gap import Settings, diagnose, verdict_schema
from axisight.gap.facts.experiment import Plan, ShowingExperiment
from axisight.logs import check_log, parse_column_map
from axisight.logs.guessing import guess_columns
from axisight.paths import joint_trajectory
from axisight.robot import load_robot

pytest.importorskip("mcp", reason="extra mcp")

from mcp import Client

from axisight.cli.assistants.server import make_server

LOG = "case/logs/moves.parquet"
MODEL = "case/robot.toml"


@pytest.fixture(scope="module")
def demo_case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_demo_case(tmp_path_factory.mktemp("made") / "case")


@pytest.fixture(scope="module")
def found(demo_case: Path) -> Any:
    return diagnose(demo_case, settings=Settings(threads=1))


@pytest.fixture
def folder(demo_case: Path, tmp_path: Path) -> Path:
    shutil.copytree(demo_case, tmp_path / "served" / "case")
    return tmp_path / "served"


def asked(server: Any, ask: Callable[[Client], Awaitable[Any]]) -> Any:
    """Return what a function gets of a client of the server."""

    async def session() -> Any:
        async with Client(server) as client:
            return await ask(client)

    return anyio.run(session)


def called(server: Any, tool: str, **arguments: Any) -> Any:
    return asked(server, lambda client: client.call_tool(tool, arguments))


def good(result: Any) -> dict[str, Any]:
    assert not result.is_error, result.content[0].text
    assert result.content[0].text
    return dict(result.structured_content)


def refused(result: Any, kind: str = "InputError") -> str:
    assert result.is_error, result.structured_content
    assert result.structured_content["error"] == kind
    message = result.structured_content["message"]
    assert result.content[0].text == f"{kind}: {message}"
    return str(message)


def files_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of every file."""
    return {
        str(p): (p.stat().st_size, p.stat().st_mtime_ns) for p in folder.rglob("*") if p.is_file()
    }


def test_tools_say_what_they_do_and_what_they_take(folder: Path) -> None:
    tools = asked(make_server(folder), lambda client: client.list_tools()).tools
    assert [tool.name for tool in tools] == [
        "list_files",
        "check_log",
        "guess_columns",
        "diagnose",
        "explain",
        "next_experiment",
    ]
    for tool in tools:
        assert tool.description and tool.output_schema is not None
        assert tool.annotations.read_only_hint is True
        for name, argument in tool.input_schema["properties"].items():
            assert argument.get("description", "").endswith("."), f"{tool.name}: {name}"
    writing = asked(make_server(folder, may_write=True), lambda client: client.list_tools()).tools
    hints = {tool.name: tool.annotations.read_only_hint for tool in writing}
    assert not hints["diagnose"] and hints["check_log"] and hints["explain"]


def test_files_are_listed_and_links_are_not(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("a\n1\n")
    (folder / "link.csv").symlink_to(tmp_path / "secret.csv")
    (folder / ".hidden.csv").write_text("a\n1\n")
    listed = good(called(make_server(folder), "list_files"))
    paths = [entry["path"] for entry in listed["files"]]
    assert paths[:2] == ["case", "case/robot.toml"]
    assert LOG in paths and "link.csv" not in paths and ".hidden.csv" not in paths
    assert listed["may_write"] is False


def test_check_says_what_the_command_says(folder: Path) -> None:
    result = called(make_server(folder), "check_log", log=LOG, model=MODEL)
    content, alone = good(result), check_log(folder / LOG)
    assert content["fits"] is True and content["readable"] is True
    assert content["sample_rate_hz"] == alone.sample_rate_hz
    assert [f["message"] for f in content["findings"]] == [f.message for f in alone.findings]
    assert "Torques are compared in closed loop" in result.content[0].text
    assert str(folder) not in result.content[0].text


def test_a_log_that_does_not_fit_is_told_by_its_fault(folder: Path) -> None:
    frame = pd.read_parquet(folder / LOG)
    frame[["torque_cmd_1", "torque_cmd_2"]] = frame[["torque_cmd_2", "torque_cmd_1"]]
    for log in (folder / "case" / "logs").iterdir():
        frame.to_parquet(log, index=False)
    result = called(make_server(folder), "check_log", log=LOG, model=MODEL)
    assert good(result)["fits"] is False
    assert "refused: " in result.content[0].text
    result = called(make_server(folder), "diagnose", case="case")
    refused(result, "RefusedInputError")
    assert "axes_swapped" in result.structured_content["faults"]


def test_a_guessed_map_serves_the_other_tools_as_text(folder: Path) -> None:
    frame = pd.read_parquet(folder / LOG)
    units = {"time_s": "[s]", "torque": "[Nm]", "position": "[rad]", "velocity_ref": "[rad/s]"}
    frame.columns = [
        f"motor_{name} {next(u for start, u in units.items() if name.startswith(start))}"
        for name in frame.columns
    ]
    frame.to_csv(folder / "own.csv", index=False)
    server = make_server(folder)
    content = good(called(server, "guess_columns", log="own.csv", model=MODEL))
    assert content["written"] == []
    assert parse_column_map(content["text"]) == guess_columns(folder / "own.csv").columns
    checked = called(server, "check_log", log="own.csv", model=MODEL, columns_text=content["text"])
    assert good(checked)["fits"] is True
    both = called(server, "check_log", log="own.csv", columns="ur-rtde", columns_text="")
    assert "expected one of them, got both" in refused(both)


def test_diagnosis_equals_that_of_the_library(folder: Path, found: Any) -> None:
    told: list[tuple[float, str | None]] = []

    async def progress(done: float, _total: float | None, message: str | None) -> None:
        told.append((done, message))

    async def ask(client: Client) -> Any:
        first = await client.call_tool(
            "diagnose", {"case": "case", "full": True}, progress_callback=progress
        )
        second = await client.call_tool("explain", {"diagnosis": "d1", "tables": True})
        return first, second

    result, explained = asked(make_server(folder), ask)
    content = good(result)
    verdict, own = content["verdict"], found.to_verdict()
    # The time that it took is not a property of the diagnosis.
    verdict["provenance"].pop("seconds"), own["provenance"].pop("seconds")
    # The number of threads changes no result.
    verdict["settings"].pop("threads", None), own["settings"].pop("threads", None)
    assert verdict == own
    Draft202012Validator(verdict_schema()).validate(found.to_verdict())
    assert content["diagnosis"] == "d1" and content["left_out"] == []
    assert found.headline[:40] in result.content[0].text
    assert "explain d1" in result.content[0].text
    counts = [count for count, _ in told]
    assert counts == sorted(set(counts)) and len(counts) >= 2
    assert any("screening" in (message or "") for _, message in told)
    account = good(explained)
    assert account["comparisons"] and "95 % interval" in explained.content[0].text


def quick(found: Any) -> Callable[..., Any]:
    """Return a diagnosis that takes no time."""
    return lambda **_: found


def test_a_verdict_file_is_explained_as_the_diagnosis_that_wrote_it(
    folder: Path, found: Any
) -> None:
    """Identity: the file holds the whole trace, removed hypotheses and broken losses included."""
    found.save_verdict(folder / "verdict.json")

    async def ask(client: Client) -> tuple[Any, Any]:
        good(await client.call_tool("diagnose", {"case": "case"}))
        return (
            await client.call_tool("explain", {"diagnosis": "d1"}),
            await client.call_tool("explain", {"verdict": "verdict.json"}),
        )

    of_number, of_file = asked(make_server(folder, run=quick(found)), ask)
    expected = good(of_number) | {"diagnosis": "verdict.json"}
    assert good(of_file) == expected and expected["comparisons"]
    assert of_file.content[0].text == f"{found.headline}\n{of_number.content[0].text}"


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({}, "diagnosis, verdict: expected one of them"),
        ({"diagnosis": "d1", "verdict": "verdict.json"}, "diagnosis, verdict: expected one"),
        ({"verdict": "verdict.json", "tables": True}, "tables: expected false"),
        ({"verdict": "../verdict.json"}, "without ..,"),
        ({"verdict": "none.json"}, "verdict: expected a file or folder"),
        ({"verdict": LOG}, "cannot be read"),
        ({"verdict": "bare.json"}, "trace: expected the trace of a diagnosis, got None"),
        ({"verdict": "broken.json"}, "trace.comparisons.0.round"),
    ],
)
def test_what_is_no_verdict_is_not_explained(
    folder: Path, found: Any, given: dict[str, Any], says: str
) -> None:
    verdict = found.to_verdict()
    files = {"verdict": verdict, "bare": {k: v for k, v in verdict.items() if k != "trace"}}
    trace = verdict["trace"]
    first = {**trace["comparisons"][0], "round": "first"}
    files["broken"] = {**verdict, "trace": {**trace, "comparisons": [first]}}
    for name, content in files.items():
        (folder / f"{name}.json").write_text(json.dumps(content), "utf-8")
    assert says in refused(called(make_server(folder), "explain", **given))


def test_a_short_answer_leaves_out_large_tables(folder: Path, found: Any) -> None:
    content = good(called(make_server(folder, run=quick(found)), "diagnose", case="case"))
    assert content["left_out"] == ["detection_limits", "ranking", "trace"]
    assert set(content["verdict"]) == set(found.to_verdict()) - set(content["left_out"])


def test_the_next_experiment_asks_for_what_it_was_told(folder: Path, found: Any) -> None:
    seen: list[dict[str, Any]] = []

    def run(**given: Any) -> Any:
        seen.append(given)
        return found

    async def ask(client: Client) -> Any:
        await client.call_tool("diagnose", {"case": "case"})
        asked_for = {"diagnosis": "d1", "to_show": "torque_offset@1 offset_nm=1"}
        limits = {
            "velocity_limit_rad_s": [10.0],
            "torque_limit_nm": [1.0, 2.0, 3.0],
            "acceleration_limit_rad_s2": [50.0],
            "room_m": [-1.0, -1.0, 0.0, 1.0, 1.0, 2.0],
        }
        return await client.call_tool("next_experiment", asked_for | limits)

    content = good(asked(make_server(folder, run=run), ask))
    assert content["decides"] is None and "No experiment" in content["advice"]
    first, second = seen
    assert second["estimation"] == first["estimation"] and second["separate"] is True
    assert second["to_show"].label == "torque_offset@1"
    assert second["within"].velocity_rad_s == 10.0
    assert second["within"].torque_nm == [1.0, 2.0, 3.0]
    assert second["within"].acceleration_rad_s2 == 50.0
    assert second["within"].room_m == [-1.0, -1.0, 0.0, 1.0, 1.0, 2.0]
    unknown = called(make_server(folder), "next_experiment", diagnosis="d7")
    assert "none yet: call diagnose first" in refused(unknown)


def test_a_cancelled_diagnosis_stops_and_the_next_one_runs(folder: Path, found: Any) -> None:
    begun, ended = threading.Event(), threading.Event()

    def endless(progress: Callable[[str, int, int], None], **_: Any) -> Any:
        if ended.is_set():
            return found
        try:
            while True:
                progress("fitting", 1, 4)
                begun.set()
                threading.Event().wait(0.01)
        finally:
            ended.set()

    async def ask(client: Client) -> Any:
        async with anyio.create_task_group() as group:
            group.start_soon(client.call_tool, "diagnose", {"case": "case"})
            while not begun.is_set():
                await anyio.sleep(0.01)
            group.cancel_scope.cancel()
        with anyio.fail_after(20):
            return await client.call_tool("diagnose", {"case": "case"})

    content = good(asked(make_server(folder, run=endless), ask))
    assert ended.is_set() and content["diagnosis"] == "d1"


@pytest.mark.parametrize(
    "name",
    [
        "../outside.csv",
        "case/../../outside.csv",
        "/etc/passwd",
        "C:\\secret.csv",
        "..\\outside.csv",
        "link.csv",
        "linked/outside.csv",
        "linked#0",
        "circle",
        "a\0b",
    ],
)
def test_names_outside_the_folder_are_refused(folder: Path, tmp_path: Path, name: str) -> None:
    outside = tmp_path / "outside.csv"
    outside.write_text("secret_word\n1\n")
    (folder / "link.csv").symlink_to(outside)
    (folder / "linked").symlink_to(tmp_path)
    (folder / "circle").symlink_to(folder / "circle")
    server = make_server(folder, may_write=True)
    for tool, argument in [
        ("check_log", {"log": name}),
        ("check_log", {"log": LOG, "columns": name}),
        ("check_log", {"log": LOG, "model": name}),
        ("guess_columns", {"log": name}),
        ("guess_columns", {"log": LOG, "model": name}),
        ("diagnose", {"case": name}),
        ("diagnose", {"logs": [name], "model": MODEL}),
        ("diagnose", {"logs": [LOG], "validation": [name], "model": MODEL}),
        ("diagnose", {"case": "case", "write_verdict": name}),
        ("diagnose", {"case": "case", "write_report": name}),
        ("diagnose", {"case": "case", "write_model": name}),
        ("guess_columns", {"log": LOG, "write_to": name}),
    ]:
        result = called(server, tool, **argument)
        assert "secret_word" not in result.content[0].text
        assert "expected" in refused(result)
    assert outside.read_text() == "secret_word\n1\n"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["outside.csv", "served"]


def test_files_that_lead_out_of_a_case_or_log_are_refused(folder: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside.parquet"
    shutil.copy(folder / LOG, outside)
    with h5py.File(folder / "log.h5", "w") as file:
        file["time"] = h5py.ExternalLink(str(outside), "time")
    server = make_server(folder)
    refused(called(server, "check_log", log="log.h5"), "LogError")
    (folder / "arm.urdf").write_text("<robot/>")
    (folder / "arm.drives.toml").symlink_to(outside)
    assert "link out of it" in refused(called(server, "check_log", log=LOG, model="arm.urdf"))
    (folder / LOG).unlink()
    (folder / LOG).symlink_to(outside)
    refused(called(server, "diagnose", case="case"), "CaseError")


def test_nothing_is_written_without_leave(folder: Path, found: Any) -> None:
    before = files_of(folder)

    async def ask(client: Client) -> None:
        good(await client.call_tool("list_files", {}))
        good(await client.call_tool("check_log", {"log": LOG, "model": MODEL}))
        good(await client.call_tool("diagnose", {"case": "case"}))
        good(await client.call_tool("explain", {"diagnosis": "d1"}))
        good(await client.call_tool("next_experiment", {"diagnosis": "d1"}))
        for option in ("write_verdict", "write_report", "write_model"):
            result = await client.call_tool("diagnose", {"case": "case", option: "out.html"})
            assert "--allow-write" in refused(result, "OutputError")
        result = await client.call_tool("guess_columns", {"log": LOG, "write_to": "m.toml"})
        assert "--allow-write" in refused(result, "OutputError")
        result = await client.call_tool("next_experiment", {"diagnosis": "d1", "write_to": "next"})
        assert "--allow-write" in refused(result, "OutputError")

    asked(make_server(folder, run=quick(found)), ask)
    assert files_of(folder) == before


def test_files_are_written_with_leave(folder: Path, found: Any) -> None:
    server = make_server(folder, may_write=True, run=quick(found))
    names = {"write_verdict": "o/v.json", "write_report": "o/r.html", "write_model": "o/new.toml"}
    content = good(called(server, "diagnose", case="case", **names))
    assert content["written"] == list(names.values())
    assert (folder / "o" / "v.json").read_text() == found.to_json()
    assert "coulomb" in (folder / "o" / "new.toml").read_text()
    again = called(server, "diagnose", case="case", write_model="o/new.toml")
    assert "exists" in refused(again, "OutputError")
    over = called(server, "diagnose", case="case", write_verdict=MODEL)
    assert "expected another file" in refused(over, "OutputError")


def test_a_designed_experiment_is_written_with_leave(folder: Path, found: Any) -> None:
    swing = References(0.001, np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]]))
    path = joint_trajectory(swing, load_robot("irb6600_like"), [0.0, 0.0, 0.0])
    plan = Plan("Slow swings", (1,), swing, path, repeats=2, times_shorter=np.inf)
    made = ShowingExperiment(plan, Effect("torque_offset", 1, {"offset_nm": 1.0}), share=4.0)

    def run(separate: bool = False, **_: Any) -> Any:
        # Diagnoses with an experiment are tested beside the diagnosis itself.
        return replace(found, experiment=made, next_experiment=str(made)) if separate else found

    async def ask(client: Client) -> Any:
        await client.call_tool("diagnose", {"case": "case"})
        show = {"diagnosis": "d1", "to_show": "torque_offset@1 offset_nm=1", "write_to": "next"}
        return await client.call_tool("next_experiment", show)

    content = good(asked(make_server(folder, may_write=True, run=run), ask))
    assert content["decides"] is True and content["axes"] == [1]
    files = ("references.parquet", "trajectory.csv", "trajectory.yaml", "experiment.txt")
    assert content["written"] == [f"next/{name}" for name in files]
    assert content["peak_rad_s"] == [2.0, 0.0, 0.0] and content["period_s"] == 0.002
    assert (
        (folder / "next" / "experiment.txt").read_text() == f"{made}\n" == f"{content['advice']}\n"
    )


def test_wrong_arguments_are_told(folder: Path) -> None:
    server = make_server(folder)
    assert "Did you mean" in refused(called(server, "check_log", log="case/logs/movs.parquet"))
    assert "got both or neither" in refused(called(server, "diagnose"))
    assert "model: expected" in refused(called(server, "diagnose", logs=[LOG]))
    unknown = called(server, "diagnose", case="case", effects=["coulomb_frction@2"])
    assert "coulomb_friction" in refused(unknown)
    missing = called(server, "check_log")
    assert missing.is_error and "log" in missing.content[0].text
    with pytest.raises(InputError, match="FOLDER: expected a folder"):
        make_server(folder / MODEL)


def test_the_skill_is_a_resource(folder: Path) -> None:
    read = asked(make_server(folder), lambda client: client.read_resource("axisight://skill"))
    assert read.contents[0].text.startswith("---\nname: axisight")


def test_the_folder_itself_may_be_a_link(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "alias").symlink_to(folder)
    assert good(called(make_server(tmp_path / "alias"), "check_log", log=LOG))["readable"]
    assert os.fspath(tmp_path) not in str(called(make_server(folder), "list_files"))
