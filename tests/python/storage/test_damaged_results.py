"""Results that were damaged on disk: verdicts, truths, designs and references are refused by name, or made again."""

import json
from pathlib import Path

import numpy as np
import pytest

from axisight import montecarlo as mc
from axisight.blind import judged_cases
from axisight.blind.sealed import SEAL, seal_of
from axisight.errors import InputError, StoreError, StudyError
from axisight.excitation import multisine, read_references, write_references
from axisight.excitation import references as references_of
from axisight.fleet.solve import _checksum, _known
from axisight.montecarlo.design import compute_block, core_study, freeze
from axisight.montecarlo.result import responses
from axisight.montecarlo.store import Store
from montecarlo_data import small_study

NO_JSON = {
    "nothing": "",
    "cut off": '{"verdict": "none", "cau',
    "nested": "[" * 100_000,
    "nested objects": '{"a":' * 100_000,
    "digits": '{"a": ' + "9" * 5000 + "}",
}
NO_OBJECT = {"list": "[]", "number": "1", "null": "null"}
EMPTY = {"empty": "{}", "causes": '{"causes": 7, "verdict": []}'}


def texts(*groups: dict[str, str]) -> pytest.MarkDecorator:
    every = {k: v for group in groups for k, v in group.items()}
    return pytest.mark.parametrize("text", every.values(), ids=list(every))


def benchmark(folder: Path, truth: str, verdict: str) -> list[Path]:
    """One case of a benchmark, its truth sealed as it stands."""
    folders = [folder / name for name in ("cases", "truths", "verdicts")]
    (folders[0] / "one").mkdir(parents=True)
    (folders[0] / "one" / SEAL).write_text(seal_of(truth))
    for path, text in zip(folders[1:], (truth, verdict), strict=True):
        path.mkdir()
        (path / "one.json").write_text(text)
    return folders


@texts(NO_JSON, NO_OBJECT, EMPTY)
@pytest.mark.parametrize("which", ["truths", "verdicts"])
def test_a_damaged_verdict_or_truth_is_named(tmp_path, text, which):
    good = '{"error": "x"}'
    truth, verdict = (
        (text, good) if which == "truths" else ('{"severity": [], "effects": []}', text)
    )
    with pytest.raises(InputError, match=r"one\.json: expected") as caught:
        judged_cases(*benchmark(tmp_path, truth, verdict))
    assert len(str(caught.value)) < 1000


@texts(NO_JSON, NO_OBJECT, EMPTY)
def test_a_verdict_of_a_fleet_that_was_damaged_is_made_again(tmp_path, text):
    path = tmp_path / "one.json"
    path.write_text(text)
    assert _known(path, "print") is None


def test_a_verdict_of_a_fleet_holds_what_it_was_written_with(tmp_path):
    path, verdict = tmp_path / "one.json", {"gap": 0.25, "fingerprint": "print"}
    verdict["sha256"] = _checksum(verdict)
    path.write_text(json.dumps(verdict, indent=2))
    assert _known(path, "print") == verdict
    assert _known(path, "other") is None
    # One digit: still JSON, still of this case.
    path.write_text(path.read_text().replace("0.25", "0.75"))
    assert _known(path, "print") is None


@texts(NO_JSON, NO_OBJECT, EMPTY)
def test_a_design_that_is_none(text):
    for call in (lambda: core_study(text), lambda: compute_block(text, 1, 0, 1)):
        with pytest.raises(StudyError, match=r"^(design|axisight_version): expected") as caught:
            call()
        assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("value", [None, 7, "x", [], {}, [[1]], 10**30, -1.5])
def test_a_design_with_anything_for_anything(value):
    whole = json.loads(freeze(small_study()))
    for section in ("robot", "excitation", "plant", "measurement", "spread", "statistics"):
        if not value and not whole[section]:  # nothing in place of nothing
            continue
        with pytest.raises(StudyError):
            core_study(json.dumps(whole | {section: value}))
        if not isinstance(whole[section], dict):
            continue
        for key in whole[section]:
            # Many a value is a right one: only what is raised counts.
            try:
                core_study(json.dumps(whole | {section: whole[section] | {key: value}}))
            except StudyError as error:
                assert len(str(error)) < 1000


@pytest.mark.parametrize("spoil", ["design", "changed", "seed", "hash"])
def test_responses_of_a_store_whose_design_was_damaged(tmp_path, spoil):
    statistics = mc.Statistics(keep_responses=True)
    mc.run(small_study(runs=8, statistics=statistics), out=tmp_path)
    assert np.isfinite(responses(tmp_path)).all()
    path = Store(tmp_path).root / "zarr.json"
    described = json.loads(path.read_text())
    attributes = described["attributes"]
    if spoil == "design":
        attributes["design"] = "[" * 100_000
    elif spoil == "changed":  # other frequencies for the same numbers, said by nobody
        assert "40.0]" in attributes["design"]
        attributes["design"] = attributes["design"].replace("40.0]", "42.0]")
    else:
        del attributes["seed" if spoil == "seed" else "design_sha256"]
    path.write_text(json.dumps(described))
    with pytest.raises(StoreError, match=r"zarr\.json: .*put back a copy") as caught:
        responses(tmp_path)
    assert len(str(caught.value)) < 1000


@pytest.fixture
def references(tmp_path):
    path = tmp_path / "x.csv"
    write_references(references_of(multisine(0.5, 0.002, band_hz=(2.0, 40.0)), 3), path)
    read_references(path)
    return path


@texts(NO_JSON, NO_OBJECT, {"empty": "{}", "schema": '{"schema": "' + "x" * 100_000 + '"}'})
def test_designs_beside_references(references, text):
    references.with_name("x.design.json").write_text(text)
    with pytest.raises(InputError, match=r"x\.csv: ") as caught:
        read_references(references)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("key", ["shape", "lines", "detection_lines", "sample_time_s", "design"])
@pytest.mark.parametrize("value", [None, "x", {}, [[1], [2, 3]], 10**30, [10**30], -1.5])
def test_designs_with_anything_for_anything(references, key, value):
    beside = references.with_name("x.design.json")
    beside.write_text(json.dumps(json.loads(beside.read_text()) | {key: value}))
    try:
        read_references(references)
    except InputError as error:
        assert len(str(error)) < 1000


def test_references_that_are_wider_than_their_size_allows(references):
    header, row = ",".join(f"c{k}" for k in range(9_000)), "\n" * 300_000
    references.write_text(header + "\n" + row)
    with pytest.raises(InputError, match=r"x\.csv: .*MB to be needed"):
        read_references(references)
