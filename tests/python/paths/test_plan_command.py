"""The command ``axisight plan``: from waypoints to references, and wrong files."""

import numpy as np
import pytest
from typer.testing import CliRunner

from axisight.cli.application import app
from axisight.excitation import read_references

pytest.importorskip("toppra", reason="toppra comes with the extra `paths`")

LIMITS = ("--velocity-limit", "200", "--acceleration-limit", "1500", "--torque-limit", "60,60,60")


def run(folder, text, *more, code=0):
    points, out = folder / "points.csv", folder / "motion.parquet"
    points.write_text(text)
    given = ["plan", "irb6600_like", str(points), *LIMITS, "--out", str(out), *more]
    result = CliRunner().invoke(app, given)
    assert result.exit_code == code, result.output
    return result.output, out


def test_waypoints_become_references(tmp_path):
    said, out = run(tmp_path, "axis1,axis2,axis3\n0,0,0\n0.4,0.2,-0.2\n")
    made = read_references(out)
    assert "from rest to rest" in said
    assert f"{made.design['duration_s']:.4g} s" in said
    assert np.abs(made.period).max() <= 200


def test_a_first_row_of_names_says_the_order(tmp_path):
    made = []
    for text in ("axis3,axis1,axis2\n0,0,0\n-0.2,0.4,0.2\n", "0,0,0\n0.4,0.2,-0.2\n"):
        made.append(read_references(run(tmp_path, text, "--force")[1]).period)
    assert np.array_equal(*made)


def test_a_line_of_the_tool(tmp_path):
    more = ("--tool", "line", "--start", "0,0,0", "--point", "1.2,0,0.2")
    _, out = run(tmp_path, "1.2,0.8,1.7\n", *more)
    assert read_references(out).n_experiments == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,0,0\n1,2\n", "line 2: expected 3 numbers (axis1, axis2, axis3)"),
        ("0,0,0\n1,2,x\n", "line 2: expected 3 numbers"),
        ("0,0,0\n1,2,nan\n", "line 2: expected 3 numbers"),
        ("a,b,c\n0,0,0\n", "expected the columns axis1, axis2, axis3, got a, b, c"),
        ("axis1,axis2,axis3\n", "none"),
        ("0,0,0\n", "n >= 2"),
    ],
)
def test_wrong_files_are_refused(tmp_path, text, message):
    said, out = run(tmp_path, text, code=2)
    assert message in " ".join(said.split())
    assert not out.exists()
