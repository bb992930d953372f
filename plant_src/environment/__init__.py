"""What surrounds the vehicles: waves, wind, current, and what lies below a multirotor."""

from __future__ import annotations

from typing import Any

from cosim.core.errors import InputError

from ..json_reader import JsonReader
from . import settings
from .sea import CALM, Sea, realise_sea


def sea(environment: Any) -> Sea:
    """The components of the sea that the section "environment" of a world's arguments describes, as the world makes them.

    Their time counts from the start of the run, and the world's input `environment.wave_gain` multiplies all amplitudes.
    No waves: arrays of length 0. Raises InputError with all problems.
    """
    reader = JsonReader()
    read = settings.read_environment(reader, environment)
    if reader.problems:
        raise InputError(reader.problems)
    return realise_sea(read.waves, read.seed) if read.waves else CALM
