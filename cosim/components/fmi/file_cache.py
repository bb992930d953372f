"""FMU files that a process has examined, by content, and their extracted folders."""

from __future__ import annotations

import ctypes
import os
from collections import OrderedDict
from contextlib import suppress
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from ...process.journal import current_journal
from ...process.temporary_folders import LockedFolder

K = TypeVar("K")
V = TypeVar("V")

#: largest number of FMU contents, and of extracted folders on the disk
_MAX_CONTENTS, _MAX_FOLDERS = 256, 32

#: paths with type, size, inode and times of the files in a folder
Listing = list[tuple[str, int, int, int, int, int]]


class FileKey(NamedTuple):
    """FMU file with this content."""

    path: Path
    sha256: str


class RecentlyUsed(Generic[K, V]):
    """Mapping that forgets the values that were not used for the longest time."""

    def __init__(self, size: int):
        self._size = size
        self._values: OrderedDict[K, V] = OrderedDict()

    def get(self, key: K) -> V | None:
        """Return a value, None if there is none."""
        with suppress(KeyError):
            self._values.move_to_end(key)
            return self._values[key]
        return None

    def put(self, key: K, value: V) -> V | None:
        """Store a value; return the one that is forgotten."""
        self._values[key] = value
        return self.pop_oldest() if len(self._values) > self._size else None

    def pop_oldest(self) -> V | None:
        """Remove and return the value that was not used for the longest time, None if there is none."""
        with suppress(KeyError):
            return self._values.popitem(last=False)[1]
        return None

    def pop(self, key: K) -> V | None:
        """Remove and return a value, None if there is none."""
        return self._values.pop(key, None)

    def clear(self) -> None:
        """Forget all values."""
        self._values.clear()


class ExtractedFolder(NamedTuple):
    """Folder of an extracted FMU, and its files as they were extracted."""

    folder: LockedFolder
    listing: Listing


#: description and findings of the preflight check, by the content of the file
contents: RecentlyUsed[Any, Any] = RecentlyUsed(_MAX_CONTENTS)
#: folders that no run uses; a run has a folder of its own, because a library that is loaded twice
#: shares its static variables
_idle_folders: RecentlyUsed[FileKey, ExtractedFolder] = RecentlyUsed(_MAX_FOLDERS)


def take_folder(key: FileKey) -> ExtractedFolder | None:
    """Return the folder of an FMU that was extracted for an earlier run, if its files are unchanged; else None."""
    if not (extracted := _idle_folders.pop(key)):
        return None
    with suppress(OSError):  # another program has removed the folder
        if list_files(extracted.folder.name) == extracted.listing:
            return extracted
    extracted.folder.cleanup()
    return None


def keep_folder(key: FileKey, extracted: ExtractedFolder, library: str) -> None:
    """Keep the folder for the next run, unless the operating system has kept the FMU's library with its static variables."""
    if (
        current_journal()
    ):  # no other run follows in a supervised process, which ends without finalizers
        extracted.folder.cleanup()
        return
    with suppress(OSError):
        ctypes.CDLL(library, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        extracted.folder.cleanup()
        return
    other = _idle_folders.pop(key)
    for surplus in (other, _idle_folders.put(key, extracted)):
        if surplus:
            surplus.folder.cleanup()


def remove_idle_folders() -> None:
    """Remove the folders that are kept for further runs."""
    while extracted := _idle_folders.pop_oldest():
        extracted.folder.cleanup()


def list_files(folder: str) -> Listing:
    """Return the files of a folder and of its subfolders, with all that changes when one of them is written."""
    listing: Listing = []
    folders = [folder]
    while folders:
        with os.scandir(folders.pop()) as entries:
            for entry in entries:
                status = entry.stat(follow_symlinks=False)
                times = status.st_mtime_ns, status.st_ctime_ns
                listing.append((entry.path, status.st_mode, status.st_size, status.st_ino, *times))
                if entry.is_dir(follow_symlinks=False):
                    folders.append(entry.path)
    return sorted(listing)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle_folders.clear)  # they belong to the parent
