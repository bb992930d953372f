"""Locations of the files that cosim ships and of its cache, and the number of processors.

The shipped files are scenarios, FMUs, and sources of plant and controllers.
"""

import os
from functools import cache
from pathlib import Path


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
    """Return the cache folder of the user: XDG_CACHE_HOME/cosim, else ~/.cache/cosim."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "cosim"


def available_processors() -> int:
    """Return how many processors this process may use.

    Its CPU affinity may exclude some of the machine's.
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
