"""Locks of outputs."""

from __future__ import annotations

import os
import signal
import sys

import pytest

from cosim.core.errors import InputError, OutputError
from cosim.process.output_lock import LOCK_FILE, LockKeeper, acquire_lock

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no file locks")


def is_locked(folder) -> bool:
    try:
        acquire_lock(folder / LOCK_FILE, folder).release()
    except InputError:
        return True
    return False


def test_a_lock_is_released_and_its_file_removed(tmp_path):
    lock = acquire_lock(tmp_path / LOCK_FILE, tmp_path)
    assert is_locked(tmp_path)
    lock.release()
    assert not is_locked(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b"[" * 100_000, b'{"process": 3}', b"\xff"])
def test_any_content_of_a_lock_file_names_another_process(tmp_path, content):
    lock = acquire_lock(tmp_path / LOCK_FILE, tmp_path)
    (tmp_path / LOCK_FILE).write_bytes(content)
    with pytest.raises(InputError, match="in use by another process"):
        acquire_lock(tmp_path / LOCK_FILE, tmp_path)
    lock.release()


def test_a_file_without_a_lock_is_taken_over(tmp_path):
    (tmp_path / LOCK_FILE).write_text('{"process": 1, "host": "gone", "start": "long ago"}')
    acquire_lock(tmp_path / LOCK_FILE, tmp_path).release()
    assert list(tmp_path.iterdir()) == []


def test_a_link_is_not_followed(tmp_path):
    (tmp_path / "mine").write_text("mine")
    (tmp_path / LOCK_FILE).symlink_to(tmp_path / "mine")
    with pytest.raises(InputError, match="cannot write to"):
        acquire_lock(tmp_path / LOCK_FILE, tmp_path)
    assert (tmp_path / "mine").read_text() == "mine"


def in_child(work) -> int:
    """Call a function in a forked process, which is killed afterwards."""
    child = os.fork()
    if child == 0:
        try:
            work()
        finally:
            os.kill(os.getpid(), signal.SIGKILL)
    return os.waitpid(child, 0)[1]


def test_the_lock_of_a_killed_child_is_kept_until_its_results_are_saved(tmp_path):
    with LockKeeper() as keeper:
        in_child(lambda: keeper.lock(tmp_path / LOCK_FILE, tmp_path))
        assert is_locked(tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert not is_locked(tmp_path)


def test_a_keeper_without_a_lock(tmp_path):
    with LockKeeper():
        in_child(lambda: None)
    assert not is_locked(tmp_path)


def test_foreign_code_finds_no_descriptor_of_the_lock(tmp_path):
    """A process that it leaves behind cannot hold the lock."""

    def descriptors_of_lock() -> list[str]:
        links = [f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd")]  # noqa: PTH208
        targets = [os.readlink(link) for link in links if os.path.lexists(link)]  # noqa: PTH115
        return [path for path in targets if LOCK_FILE in path]

    with LockKeeper() as keeper:
        keeper.lock(tmp_path / LOCK_FILE, tmp_path)
        assert is_locked(tmp_path)
        if sys.platform == "linux":
            assert descriptors_of_lock() == []


def test_nothing_is_locked_while_the_disk_is_full(tmp_path, monkeypatch):
    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.write", full)
    with pytest.raises(OutputError, match="No space left on device"):
        acquire_lock(tmp_path / LOCK_FILE, tmp_path)
    assert list(tmp_path.iterdir()) == []
