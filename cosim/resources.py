"""Where the files live that cosim ships: scenarios, FMUs, plant and controller sources."""

from __future__ import annotations

import os
from pathlib import Path


def root() -> Path:
    """The folder that holds `scenarios/`, `fmus/`, `plant_src/` and `controllers/`: the installed bundle, else the checkout."""
    package = Path(__file__).resolve().parent
    bundle = package / "_bundle"
    return bundle if bundle.is_dir() else package.parent


def cache_directory() -> Path:
    """The per-user folder for things that can be made again (XDG_CACHE_HOME/cosim, else ~/.cache/cosim)."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "cosim"
