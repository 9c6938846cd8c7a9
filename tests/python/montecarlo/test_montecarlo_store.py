"""Stores of studies: interruption, resumption, damage, mismatch, and disks that refuse."""

import errno
import json
import os
import signal
import subprocess
import sys
import warnings

import numpy as np
import pytest
import xarray as xr

from axisight import StoreError, StudyError
from axisight import montecarlo as mc
from axisight.montecarlo import store
from montecarlo_data import blocks, same_bits, small_study, start, until

# Some seconds of work: a signal sent after the third block comes long before the end.
LONG = {"runs": 480, "block_runs": 4}


@pytest.fixture(scope="module")
def uninterrupted():
    return mc.run(small_study(**LONG))


def interrupted(tmp_path, sign) -> subprocess.Popen:
    """A process that runs the long study, sent a signal after its third block."""
    study, out = tmp_path / "study.toml", tmp_path / "out"
    study.write_text(small_study(**LONG).to_toml())
    command = ["axisight", "montecarlo", str(study), "--out", str(out)]
    # Shells let what they start in the background ignore Ctrl-C, and children inherit that.
    code = f"""if True:
        import signal, sys
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.argv = {command!r}
        from axisight.cli import main
        main()"""
    process = start("-c", code, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until(lambda: len(blocks(out)) >= 3)
    process.send_signal(sign)
    return process


def test_killed_and_resumed_gives_the_same_bits(tmp_path, uninterrupted):
    process = interrupted(tmp_path, signal.SIGKILL)
    process.communicate(timeout=20)
    assert process.returncode == -signal.SIGKILL
    out = tmp_path / "out"
    assert 3 <= len(blocks(out)) < 120
    assert not (out / "study.zarr" / "result").exists()
    states = []
    resumed = mc.run(small_study(**LONG), out=out, resume=True, progress=states.append)
    same_bits(resumed, uninterrupted)
    # What was stored was not computed again.
    assert states[0].done >= 3 * 4 + 4
    assert states[-1].done == 480
    with xr.open_zarr(out / "study.zarr", group="result", consolidated=False) as stored:
        same_bits(stored.load(), uninterrupted)


def test_control_c_leaves_a_resumable_store(tmp_path, uninterrupted):
    process = interrupted(tmp_path, signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130, err
    assert "--resume" in err
    same_bits(mc.run(small_study(**LONG), out=tmp_path / "out", resume=True), uninterrupted)


def test_more_runs_continue_the_study(tmp_path, uninterrupted):
    """38 runs end in a short block, which is computed anew."""
    short = mc.run(small_study(**LONG), runs=38, out=tmp_path)
    assert (short["count"] == 38).all()
    same_bits(mc.run(small_study(**LONG), out=tmp_path, resume=True), uninterrupted)
    assert len(blocks(tmp_path)) == 120
    with pytest.raises(StudyError, match="runs: expected at least the 480 stored, got 100"):
        mc.run(small_study(**LONG), runs=100, out=tmp_path, resume=True)


def test_a_finished_study_is_read_not_run(tmp_path):
    first = mc.run(small_study(), out=tmp_path)
    states = []
    same_bits(mc.run(small_study(), out=tmp_path, resume=True, progress=states.append), first)
    assert states == []
    with pytest.raises(StudyError, match="holds a study already"):
        mc.run(small_study(), out=tmp_path)


@pytest.mark.parametrize("damage", ["flip", "truncate", "remove", "metadata"])
def test_a_damaged_block_is_computed_again_and_said(tmp_path, damage):
    first = mc.run(small_study(), out=tmp_path)
    victim = blocks(tmp_path)[1]
    chunk = next(p for p in (victim / "moments").iterdir() if p.name.startswith("c"))
    data = bytearray(chunk.read_bytes())
    if damage == "flip":
        data[len(data) // 2] ^= 1
        chunk.write_bytes(data)
    elif damage == "truncate":
        chunk.write_bytes(data[:100])
    elif damage == "remove":
        chunk.unlink()
    else:
        (victim / "zarr.json").write_text("{")
    states = []
    same_bits(mc.run(small_study(), out=tmp_path, resume=True, progress=states.append), first)
    assert [victim.name in s.message for s in states] == [True, False]
    assert "damaged, computed again" in states[0].message


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"seed": 8}, "seed: expected 7"),
        ({"block_runs": 16}, "block_runs: expected 8"),
        ({"effect": []}, "effect"),
        (
            {"measurement": mc.Measurement(periods=2)},
            r"measurement\.periods: expected 1 \(as stored\), got 2",
        ),
        ({"robot_parameters": {"axis1.damping": 2e3}}, r"robot_parameters\.axis1\.damping"),
        ({"robot": "two_mass_axis"}, r"robot\.toml"),
    ],
)
def test_mismatched_resume_names_the_field(tmp_path, changes, field):
    multisine = small_study().excitation.multisine
    plain = {"excitation": mc.Excitation(multisine=multisine), "runs": 1}
    if changes.get("robot"):
        plain["effect"] = []
        changes = {**changes, "plant": mc.Plant(model="nonlinear")}
    mc.run(small_study(**plain), out=tmp_path)
    before = [p.name for p in blocks(tmp_path)]
    with pytest.raises(StudyError, match=field):
        mc.run(small_study(**{**plain, **changes}), out=tmp_path, resume=True)
    assert [p.name for p in blocks(tmp_path)] == before


def test_another_version_does_not_resume(tmp_path):
    mc.run(small_study(runs=1), out=tmp_path)
    path = tmp_path / "study.zarr" / "zarr.json"
    root = json.loads(path.read_text())
    design = json.loads(root["attributes"]["design"])
    design["axisight_version"] = "0.0.1"
    root["attributes"]["design"] = json.dumps(design)
    path.write_text(json.dumps(root))
    with pytest.raises(StudyError, match=r"axisight_version: expected '0\.0\.1'"):
        mc.run(small_study(runs=1), out=tmp_path, resume=True)


def test_provenance(tmp_path):
    result = mc.run(small_study(runs=2), out=tmp_path)
    for name in ("study", "design", "design_sha256", "seed", "axisight_version", "block_runs"):
        assert name in result.attrs, name
    again = tmp_path / "again.toml"
    again.write_text(result.attrs["study"])
    same_bits(mc.run(again), result)
    same_bits(mc.run(tmp_path / "study.toml"), result)


@pytest.mark.parametrize("where", ["file/inside", "/proc/axisight"])
def test_unwritable_folder(tmp_path, where):
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match="cannot be written"):
        mc.run(small_study(runs=1), out=tmp_path / where)


def test_folder_of_something_else(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(StudyError, match=r"new or empty folder.*thesis\.tex"):
        mc.run(small_study(runs=1), out=tmp_path)


def test_full_disk_keeps_finished_blocks(tmp_path, monkeypatch, uninterrupted):
    """The fifth block finds no room; after tidying up the study goes on."""
    create, calls = store.zarr.create_group, []

    def full(*args, **kwargs):
        calls.append(args)
        # The first group is the store itself.
        if len(calls) == 6:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return create(*args, **kwargs)

    monkeypatch.setattr(store.zarr, "create_group", full)
    with pytest.raises(StoreError, match=r"blocks/\d+-4: .*No space left.*resume"):
        mc.run(small_study(**LONG), out=tmp_path)
    monkeypatch.undo()
    assert len(blocks(tmp_path)) == 4
    same_bits(mc.run(small_study(**LONG), out=tmp_path, resume=True), uninterrupted)


def test_two_processes_do_not_write_one_study(tmp_path):
    script = (
        "import sys; from axisight.montecarlo.store import open_store\n"
        "from pathlib import Path\n"
        "with open_store(Path(sys.argv[1])): print('owned', flush=True); sys.stdin.read()"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], **pipes) as other:
        assert other.stdout.readline() == b"owned\n"
        with pytest.raises(StoreError, match="another process"):
            mc.run(small_study(runs=1), out=tmp_path)
        other.stdin.close()


def test_progress_counts_and_estimates(tmp_path):
    states = []
    mc.run(small_study(), out=tmp_path, progress=states.append)
    assert [s.done for s in states] == [8, 16, 24, 32, 40]
    assert all(s.total == 40 and s.rate_hz > 0 for s in states)
    assert np.isclose(states[0].remaining_s, 32 / states[0].rate_hz)
    assert states[-1].remaining_s == 0


def test_responses_need_to_be_kept(tmp_path):
    mc.run(small_study(runs=1), out=tmp_path)
    with pytest.raises(StoreError, match="without keep_responses"):
        mc.responses(tmp_path)
    with warnings.catch_warnings(), pytest.raises(StoreError, match="expected a store"):
        mc.responses(tmp_path / "nowhere")
