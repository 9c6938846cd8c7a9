"""The constants of the diagnosis: each says what it rests on, and they become fewer."""

from pathlib import Path

from axisight.gap.constants import constants, main

# So many decide. A rule that needs one more has to find another that nothing needs.
MOST = 375
# Rooms that act after the verdict and cannot change it: next experiments, remainder, posterior.
AFTER = ("separate/", "modelled/", "uncertainty/")


def test_every_constant_says_what_it_rests_on():
    silent = [f"{c.place}: {c.name}" for c in constants() if len(c.words) < 12]
    assert silent == []


def test_constants_that_decide_do_not_become_more():
    deciding = [c for c in constants() if not c.place.startswith(AFTER)]
    assert len(deciding) <= MOST


def test_the_command_prints_where_each_stands(capsys):
    main()
    printed = capsys.readouterr().out
    assert "INDEPENDENT_BLOCKS = 60.0" in printed
    assert "Settings.explained_share = 0.6" in printed


def test_words_are_the_docstring_or_the_comment_beside_or_above(tmp_path: Path):
    (tmp_path / "a.py").write_text(
        """# Above two of them.
_ONE = 1
_TWO = 2.0
THREE = 3
\"\"\"Said below.\"\"\"
_FOUR = 4  # Beside it.
_NAME = "no number"
lower = 5
"""
    )
    found = {c.name: c.words for c in constants(tmp_path)}
    assert found == {
        "_ONE": "Above two of them.",
        "_TWO": "Above two of them.",
        "THREE": "Said below.",
        "_FOUR": "Beside it.",
    }
