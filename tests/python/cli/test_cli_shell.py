"""The command line among other programs: what goes where, how it exits, what it says unasked."""

from __future__ import annotations

import json
import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from axisight.cli import app
from axisight.cli import diagnose as command
from axisight.cli.demo import write_demo_case
from axisight.cli.diagnose import EXIT_CODES
from axisight.gap.facts.axis_names import in_words
from columns_data import maker_columns, write_csv
from diagnosis_data import VERDICTS, explained, of

AXISIGHT = (sys.executable, "-c", "from axisight.cli import main; main()")


@pytest.fixture(scope="module")
def case(tmp_path_factory) -> Path:
    return write_demo_case(tmp_path_factory.mktemp("made") / "case")


@pytest.fixture
def quick(monkeypatch) -> None:
    def work(*, progress, **_more):
        progress("screening", 1, 2)
        return explained()

    monkeypatch.setattr(command, "diagnose", work)


def run(*arguments: str | Path, status: int = 0):
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    assert done.exit_code == status, (done.output, done.exception)
    return done


def test_alone_it_says_what_to_do_next():
    said = run().stdout
    for words in ("axisight demo", "axisight check LOG", "axisight diagnose LOG", "--help"):
        assert words in said
    assert len(said.splitlines()) < 12
    assert "Usage" not in said


def test_the_commands_it_says_are_there():
    for line in run().stdout.splitlines():
        words = line.split()
        if line.startswith("  axisight "):
            helped = run(words[1], "--help").output
            assert all(w in helped for w in words if w.startswith("--"))


def test_json_has_the_output_to_itself(case, quick):
    done = run("diagnose", case, "--json", "-")
    assert json.loads(done.stdout)["verdict"] == "explained"
    assert done.stdout == explained().to_json()
    assert "Axis 2 has Coulomb friction" in done.stderr
    assert "verdict: -" not in done.stderr


def test_the_next_command_has_the_output_again(case, quick):
    run("diagnose", case, "--json", "-", "--quiet")
    assert "Axis 2 has Coulomb friction" in run("diagnose", case).stdout


def test_no_file_is_made_for_standard_output(case, quick, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("diagnose", case, "--json", "-")
    for option in ("--report", "--signals", "--write-model"):
        assert (
            f"{option}: expected a file, got -"
            in run("diagnose", case, option, "-", status=2).stderr
        )
    own = write_csv(tmp_path / "own.csv", maker_columns("abb", 6))
    assert run("columns", "guess", own, "-o", "-").stdout == run("columns", "guess", own).stdout
    assert [path.name for path in tmp_path.iterdir()] == ["own.csv"]


def test_quiet_says_nothing_and_writes_what_is_asked(case, quick, tmp_path):
    for option in ("--quiet", "-q"):
        verdict = tmp_path / f"v{option}.json"
        done = run("diagnose", case, "--json", verdict, option)
        assert (done.stdout, done.stderr) == ("", "")
        assert json.loads(verdict.read_text())["verdict"] == "explained"
    piped = run("diagnose", case, "--json", "-", "-q")
    assert json.loads(piped.stdout)["verdict"] == "explained"
    assert piped.stderr == ""


def test_quiet_may_stand_before_the_command(case, quick, tmp_path):
    verdict = tmp_path / "v.json"
    done = run("-q", "diagnose", case, "--json", verdict)
    assert (done.stdout, done.stderr) == ("", "")
    assert json.loads(verdict.read_text())["verdict"] == "explained"
    # What only prints has nothing else to do.
    assert run("-q", "schema").stdout == run("schema").stdout


def test_quiet_says_errors_and_keeps_exit_codes(case, tmp_path):
    refused = run("diagnose", case, "--tolerance", "mass", "-q", status=2)
    assert refused.stdout == ""
    assert "NAME=VALUE" in refused.stderr
    checked = run("check", tmp_path / "absent.csv", "-q", status=1)
    assert (checked.stdout, checked.stderr) == ("", "")


@pytest.mark.parametrize(
    "name",
    ["diagnose", "check", "demo", "simulate", "excite", "montecarlo", "identify axis", "blind run"],
)
def test_what_works_can_be_quiet(name):
    assert "--quiet" in run(*name.split(), "--help").output


@pytest.mark.parametrize("name", ["schema", "effects", "completion", "columns list"])
def test_what_only_prints_cannot(name):
    assert "--quiet" not in run(*name.split(), "--help").output


@pytest.mark.parametrize(
    ("verdict", "status"), [("none", 0), ("explained", 10), ("unknown", 11), ("undecidable", 12)]
)
def test_the_verdict_is_the_exit_code_where_it_is_asked_for(case, monkeypatch, verdict, status):
    monkeypatch.setattr(command, "diagnose", lambda **_more: of(verdict))
    run("diagnose", case, "--exit-code", status=status)
    run("diagnose", case, status=0)


def test_every_verdict_has_an_exit_code_that_no_error_has(repository):
    assert set(EXIT_CODES) == set(VERDICTS)
    assert not set(EXIT_CODES.values()) & {1, 2}
    page = (repository / "docs" / "outputs.md").read_text("utf-8")
    for place in (page, " ".join(run("diagnose", "--help").output.split())):
        for verdict, code in EXIT_CODES.items():
            assert f"{code} {in_words(verdict)}" in place.replace(" │ │ ", " ")


def test_an_error_is_no_verdict(case):
    run("diagnose", case, "--exit-code", "--tolerance", "mass", status=2)


def on_a_terminal(*arguments: str, **more: str) -> str:
    """What a command writes where all of its outputs are a terminal."""
    ours, its = pty.openpty()
    names = ("NO_COLOR", "FORCE_COLOR", "CI", "GITHUB_ACTIONS", "TTY_COMPATIBLE", "TERM")
    plain = {k: v for k, v in os.environ.items() if k not in names}
    child = subprocess.Popen(
        [*AXISIGHT, *arguments], stdout=its, stderr=its, env=plain | {"TERM": "xterm"} | more
    )
    os.close(its)
    said = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # how Linux ends it
            break
        if not part:
            break
        said += part
    os.close(ours)
    child.wait()
    return said.decode()


def test_colours_are_for_terminals():
    wrong = ("columns", "show", "nothing")
    assert "\x1b[31merror:" in on_a_terminal(*wrong)
    assert "\x1b[31m" not in on_a_terminal(*wrong, NO_COLOR="1")
    piped = subprocess.run([*AXISIGHT, *wrong], capture_output=True, check=False)
    assert b"error:" in piped.stderr
    assert b"\x1b" not in piped.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_scripts_of_completion_name_the_command(shell):
    said = run("completion", shell).stdout
    assert f"_AXISIGHT_COMPLETE=complete_{shell}" in said


def test_another_shell_is_refused_by_name():
    assert "tcsh" in run("completion", "tcsh", status=2).output


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
@pytest.mark.parametrize(
    ("words", "proposed"),
    [
        (["di"], {"diagnose"}),
        (["co"], {"columns", "completion"}),
        (["identify", ""], {"rigid-body", "axis", "elastic", "multiaxis"}),
        (["diagnose", "--rep"], {"--report"}),
        (["diagnose", "--qui"], {"--quiet"}),
        (["completion", ""], {"bash", "zsh", "fish"}),
    ],
)
def test_bash_proposes(tmp_path, words, proposed):
    shim = tmp_path / "axisight"
    shim.write_text(f"#!/bin/sh\nexec '{sys.executable}' -c '{AXISIGHT[2]}' \"$@\"\n")
    shim.chmod(0o755)
    typed = " ".join(f"'{word}'" for word in ["axisight", *words])
    script = f"""
        eval "$(axisight completion bash)"
        COMP_WORDS=({typed}); COMP_CWORD={len(words)}
        _axisight_completion axisight
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(
        ["bash", "--norc", "-c", script],
        capture_output=True,
        check=True,
        text=True,
        env=os.environ | {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"},
    )
    assert set(done.stdout.split()) == proposed


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_are_answered(shell):
    asked = {"_AXISIGHT_COMPLETE": f"complete_{shell}", "_TYPER_COMPLETE_ARGS": "axisight dia"}
    asked["_TYPER_COMPLETE_FISH_ACTION"] = "get-args"
    done = subprocess.run(AXISIGHT, capture_output=True, check=True, env=os.environ | asked)
    assert "diagnose" in done.stdout.decode()
    assert "montecarlo" not in done.stdout.decode()
