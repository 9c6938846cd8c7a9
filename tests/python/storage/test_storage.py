"""The one law of outputs: what may be written where, said before the work."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

import pytest

from axisight import storage
from axisight.errors import AxisightError, InputError

posix = pytest.mark.skipif(os.name == "nt", reason="pipes, masks and links of POSIX")


def refused(target: Path, **more) -> str:
    """Return what is said of a target, which stays as it was."""
    before = sorted(target.parent.iterdir()) if target.parent.is_dir() else None
    with pytest.raises(InputError) as caught:
        storage.check_target(target, **more)
    assert str(target) in str(caught.value)
    assert before is None or sorted(target.parent.iterdir()) == before
    return str(caught.value)


def test_a_new_file_and_one_to_replace_pass_and_nothing_is_made(tmp_path):
    storage.check_target(tmp_path / "a" / "b" / "new.json")
    (tmp_path / "old.json").write_text("old")
    storage.check_target(tmp_path / "old.json")
    assert "exists" in refused(tmp_path / "old.json", overwrite=False)
    assert [p.name for p in tmp_path.iterdir()] == ["old.json"]


def test_an_input_is_refused_by_whatever_name(tmp_path):
    log = tmp_path / "own.parquet"
    log.write_text("measured")
    (tmp_path / "soft").symlink_to(log)
    (tmp_path / "hard").hardlink_to(log)
    for name in ("own.parquet", "soft", "hard", "../" + tmp_path.name + "/own.parquet"):
        assert "got an input" in refused(tmp_path / name, inputs=[log, Path("a_preset")])


@posix
def test_only_files_are_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "to_folder").symlink_to(tmp_path / "folder")
    (tmp_path / "round").symlink_to(tmp_path / "round")
    assert "got a pipe" in refused(tmp_path / "pipe")
    assert "got a folder" in refused(tmp_path / "folder")
    assert "got a folder" in refused(tmp_path / "to_folder")
    assert "got a device" in refused(Path("/dev/null"))
    assert "cannot be written" in refused(tmp_path / "round")
    for name in ("pipe", "folder"):
        with pytest.raises(InputError, match="expected a file to write"):
            storage.write_whole(tmp_path / name, "new")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_folders_that_cannot_be_written_to(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    assert "expected a folder" in refused(tmp_path / "file" / "a.json")
    assert "expected a folder" in refused(tmp_path / "file" / "deep" / "a.json")
    with pytest.raises(InputError, match="expected a folder"):
        storage.check_folder(tmp_path / "file")
    assert "too long" in refused(tmp_path / ("x" * 300))

    def refuse(*_args: object, **_more: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(storage.tempfile, "TemporaryFile", refuse)
    assert "Read-only file system" in refused(tmp_path / "a.json")


def test_outputs_of_a_command_are_named_and_differ(tmp_path):
    one = tmp_path / "one.json"
    storage.check_targets({"--json": one, "--report": None, "--out": tmp_path / "two"})
    with pytest.raises(InputError, match=r"^--report: expected another file than --json"):
        storage.check_targets({"--json": one, "--report": tmp_path / "." / "one.json"})
    with pytest.raises(InputError, match=r"^--json: .*got a folder"):
        storage.check_targets({"--json": tmp_path})


def test_what_an_output_replaces_is_told_by_its_ending(tmp_path):
    old, log = tmp_path / "old.JSON", tmp_path / "run.csv"
    for path in (old, log):
        path.write_text("")
    results = {"--json": (".json",), "-o": ()}
    storage.check_targets({"--json": old, "-o": tmp_path / "new.toml"}, replaces=results)
    storage.check_targets({"--out, page": log}, replaces=results)
    for option, target, words in (("--json", log, " and is no .json"), ("-o", old, "")):
        expected = f"^{option}: .*exists{words}: choose another name, or --force replaces it"
        with pytest.raises(InputError, match=expected):
            storage.check_targets({option: target}, replaces=results)
        storage.check_targets({option: target}, replaces=results, force=True)


@posix
def test_a_link_is_followed(tmp_path):
    (tmp_path / "there").mkdir()
    target = tmp_path / "there" / "result.json"
    link = tmp_path / "link.json"
    link.symlink_to(target)
    for text in ("first", "second"):
        storage.write_whole(link, text)
        assert link.is_symlink()
        assert target.read_text() == text


@posix
def test_the_umask_holds_and_a_file_keeps_its_permissions(tmp_path):
    path = tmp_path / "result.json"
    before = os.umask(0o077)
    try:
        storage.write_whole(path, "new")
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        os.umask(0o002)
        storage.write_whole(tmp_path / "shared.json", "new")
        assert stat.S_IMODE((tmp_path / "shared.json").stat().st_mode) == 0o664
        path.chmod(0o640)
        storage.write_whole(path, "again")
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
    finally:
        os.umask(before)


@posix
def test_a_full_disk_is_said_and_leaves_what_was_there(tmp_path):
    import resource  # noqa: PLC0415 (POSIX alone)

    path = tmp_path / "result.json"
    storage.write_whole(path, "old")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(AxisightError, match=r"result\.json: cannot be written: File too large"):
            storage.write_bytes(path, bytes(100_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]


def test_names_as_long_as_they_can_be(tmp_path):
    path = tmp_path / ("x" * 255)
    storage.write_whole(path, "text")
    assert path.read_text() == "text"
