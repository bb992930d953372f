"""Temporary folders of processes that start at the same time: none loses its folder to another
one's cleaning up.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from pathlib import Path
from threading import Timer

import pytest

from cosim.process import temporary_folders
from cosim.process.temporary_folders import FMU_PREFIX, RUN_PREFIX, WORKER_PREFIX, LockedFolder


@pytest.fixture
def interfere(tmp_path, monkeypatch):
    """Function that sets what another process does to the first folder between its creation and its
    lock.
    """
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    create = tempfile.mkdtemp

    def interfere(action):
        pending = [action]

        def create_and_interfere(**arguments):
            folder = create(**arguments)
            if pending:
                pending.pop()(folder)
            return folder

        monkeypatch.setattr(tempfile, "mkdtemp", create_and_interfere)

    return interfere


def lock_and_remove_soon(folder):
    """Lock the folder as a process that cleans up, and remove it while its owner waits for the
    lock.
    """
    lock = os.open(folder, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    Timer(0.05, lambda: (Path(folder).rmdir(), os.close(lock))).start()


def clean_up(folder):
    """Remove all folders that are not locked, as a process does that starts."""
    temporary_folders._remove_abandoned_folders.__wrapped__(str(Path(folder).parent))
    assert not Path(folder).exists()


@pytest.mark.parametrize("prefix", [RUN_PREFIX, FMU_PREFIX, WORKER_PREFIX])
@pytest.mark.parametrize("action", [clean_up, os.rmdir, lock_and_remove_soon])
def test_a_folder_that_is_removed_before_it_is_locked_is_replaced_by_a_locked_one(
    interfere, tmp_path, prefix, action
):
    interfere(action)
    folder = LockedFolder(prefix)
    temporary_folders._remove_abandoned_folders.__wrapped__(str(tmp_path))
    assert [str(path) for path in tmp_path.iterdir()] == [folder.name]
    folder.cleanup()
    assert list(tmp_path.iterdir()) == []


def test_without_locks_the_folder_is_used_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(fcntl, "flock", lambda *_: (_ for _ in ()).throw(OSError("no locks here")))
    folder = LockedFolder(FMU_PREFIX)
    assert Path(folder.name).is_dir()
    folder.cleanup()
    assert list(tmp_path.iterdir()) == []
