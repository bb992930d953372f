"""Environment of the vehicles: waves, wind, current, and the surface below a multirotor."""

from typing import Any

from cosim.core.errors import InputError

from ..json_reader import JsonReader
from . import settings
from .sea import Sea


def sea(environment: Any) -> Sea:
    """Return the wave components of a world, for example for plotting.

    Args:
        environment: Argument "environment" of the world, a JSON object.

    Returns:
        Components whose time (s) counts from the start of the run; arrays of length 0 without
        waves. The world's input `environment.wave_gain` multiplies all amplitudes.

    Raises:
        InputError: With all problems.
    """
    reader = JsonReader()
    environment_settings = settings.read_environment(reader, environment)
    if reader.problems:
        raise InputError(reader.problems)
    return environment_settings.sea()
