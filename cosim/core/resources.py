"""Locations of the files that cosim ships and of its cache, and the number of processors.

The shipped files are scenarios, FMUs, and sources of plant and controllers.
"""

import os
import stat
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import gettempdir


@cache
def package_folder() -> Path:
    """Return the folder of the installed package `cosim`."""
    return Path(__file__).resolve().parents[1]


@cache
def root() -> Path:
    """Return the folder of scenarios, FMUs, plant and controller sources.

    The installed bundle, else the checkout.
    """
    bundle = package_folder() / "_bundle"
    return bundle if bundle.is_dir() else package_folder().parent


def shipped_names(pattern: str) -> list[str]:
    """Return names of shipped files by a pattern such as "scenarios/*.json", without suffixes."""
    return sorted(path.stem for path in root().glob(pattern))


def cache_directory() -> Path:
    """Return the cache folder of the user: XDG_CACHE_HOME/cosim, else ~/.cache/cosim.

    Where no home folder can be written, as in many containers, it is a folder for temporary files
    that belongs to the user.
    """
    base = os.environ.get("XDG_CACHE_HOME")
    return Path(base) / "cosim" if base else _default_cache(os.environ.get("HOME"))


@cache
def _default_cache(_home: str | None) -> Path:
    folder = Path("~/.cache/cosim")
    with suppress(OSError, RuntimeError):  # the home folder cannot be written, or is not known
        folder = folder.expanduser()
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    with suppress(OSError):
        private = Path(gettempdir(), f"cosim-{os.getuid()}")
        private.mkdir(0o700, exist_ok=True)
        about = private.lstat()  # others could put libraries into a folder that is not private
        if about.st_mode == stat.S_IFDIR | 0o700 and about.st_uid == os.getuid():
            return private
    return folder


def available_processors() -> int:
    """Return how many processors this process may use.

    Its CPU affinity may exclude some of the machine's.
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
