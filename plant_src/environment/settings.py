"""Reader of a world's argument "environment".

The argument is a JSON object such as

    {"seed": 7, "sea_state": 3,
     "waves": {"spectrum": "jonswap", "significant_height": 0.05, "peak_period": 2.0,
               "gamma": 3.3, "direction": 0.5, "spreading": 2, "components": 64},
     "wind": {"speed": 5, "direction": 1.0,
              "turbulence": {"speed_20ft": 5, "height": 6.1, "airspeed": 5},
              "profile": {"exponent": 0.14, "reference_height": 10}},
     "current": {"speed": 0.2, "direction": 0.0,
                 "ramp": {"change": [0.1, 0], "start": 10, "duration": 20},
                 "variation": {"standard_deviation": 0.05, "time_constant": 60}}}

Every key is optional; plant_src/README.md lists meanings, units and defaults.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..json_reader import JsonPath, JsonReader, Numbers
from .sea import (
    CALM,
    GAMMA,
    MAX_COMPONENTS,
    MAX_GAMMA,
    MIN_GAMMA,
    SIGNIFICANT_HEIGHTS,
    SPECTRA,
    Sea,
    Waves,
    fully_developed_period,
    realise_sea,
)
from .wind_and_current import (
    MAX_HEIGHT,
    MIN_HEIGHT,
    Current,
    Ramp,
    Turbulence,
    Variation,
    Wind,
    WindProfile,
    logarithmic_profile,
    power_law_profile,
    turbulence_intensities,
)

#: default height of the turbulence model: 20 ft (m)
TURBULENCE_HEIGHT = 6.096

#: default height at which a wind profile equals the mean wind (m)
REFERENCE_HEIGHT = 10.0

#: upper limits of the spreading exponent (1) and of the significant wave height (m)
MAX_SPREADING, MAX_SIGNIFICANT_HEIGHT = 1000.0, 30.0

_WAVE_KEYS = (
    "spectrum",
    "significant_height",
    "peak_period",
    "gamma",
    "direction",
    "spreading",
    "components",
)


@dataclass(frozen=True)
class EnvironmentSettings:
    """Waves, wind and current of a world; the world has no variables of those that are None."""

    seed: int = 0
    waves: Waves | None = None
    wind: Wind | None = None
    current: Current | None = None

    def sea(self) -> Sea:
        """Return the realisation of the waves."""
        return realise_sea(self.waves, self.seed) if self.waves else CALM


def read_environment(reader: JsonReader, spec: Any) -> EnvironmentSettings:
    """Read the argument "environment" of a world; problems are added to `reader`."""
    root = ("environment",)
    spec = reader.read_object(spec, root, (), ("seed", "sea_state", "waves", "wind", "current"))
    return EnvironmentSettings(
        reader.integer(spec.get("seed", 0), (*root, "seed"), 0),
        _read_waves(reader, spec, root) if {"sea_state", "waves"} & set(spec) else None,
        _read_wind(reader, spec["wind"], (*root, "wind")) if "wind" in spec else None,
        _read_current(reader, spec["current"], (*root, "current")) if "current" in spec else None,
    )


def _read_waves(reader: JsonReader, spec: Mapping[str, Any], root: JsonPath) -> Waves:
    path = (*root, "waves")
    height = _read_significant_height(reader, spec, root)
    waves = reader.read_object(spec.get("waves", {}), path, (), _WAVE_KEYS)
    default_period = fully_developed_period(height) if height else 1.0
    spectrum = reader.choice(
        waves.get("spectrum", "pierson_moskowitz"), (*path, "spectrum"), tuple(SPECTRA)
    )
    if "gamma" in waves and spectrum != "jonswap":
        reader.add_problem(
            (*path, "gamma"),
            f'a "{spectrum}" spectrum has no peak enhancement, expected "spectrum": "jonswap"',
        )
    spreading = waves.get("spreading")
    return Waves(
        spectrum,
        height,
        reader.positive(waves.get("peak_period", default_period), (*path, "peak_period")),
        reader.number(waves.get("gamma", GAMMA), (*path, "gamma"), MIN_GAMMA, MAX_GAMMA),
        reader.number(waves.get("direction", 0.0), (*path, "direction")),
        None
        if spreading is None
        else reader.number(spreading, (*path, "spreading"), 0.0, MAX_SPREADING),
        reader.integer(
            waves.get("components", MAX_COMPONENTS), (*path, "components"), 1, MAX_COMPONENTS
        ),
    )


def _read_significant_height(reader: JsonReader, spec: Mapping[str, Any], root: JsonPath) -> float:
    """Return the significant wave height Hs (m) from "sea_state" or "waves"."""
    path, waves = (*root, "waves", "significant_height"), spec.get("waves", {})
    if not isinstance(waves, Mapping):
        return 0.0
    if "sea_state" not in spec:
        if "significant_height" not in waves:
            reader.add_problem(
                path[:-1],
                '"significant_height" is missing; alternatively set "sea_state" beside "waves"',
            )
        return reader.number(
            waves.get("significant_height", 0.0), path, 0.0, MAX_SIGNIFICANT_HEIGHT
        )
    if "significant_height" in waves:
        reader.add_problem(path, 'found beside "sea_state", expected only one of them')
    state = reader.integer(spec["sea_state"], (*root, "sea_state"), 0, len(SIGNIFICANT_HEIGHTS) - 1)
    return SIGNIFICANT_HEIGHTS[state]


def _read_velocity(reader: JsonReader, spec: Any, path: JsonPath, axes: str) -> Numbers:
    """Read "velocity" (m/s), or "speed" (m/s) and "direction" of the flow.

    The direction is in rad, counter-clockwise from x.
    """
    if not isinstance(spec, Mapping):
        return (0.0,) * len(axes)
    if "velocity" in spec:
        for key in {"speed", "direction"} & set(spec):
            reader.add_problem((*path, key), 'found beside "velocity", expected only one of them')
        return reader.vector(spec["velocity"], (*path, "velocity"), axes)
    if "speed" not in spec:
        reader.add_problem(path, '"speed" is missing; alternatively set "velocity"')
    speed = reader.number(spec.get("speed", 0.0), (*path, "speed"), 0.0)
    direction = reader.number(spec.get("direction", 0.0), (*path, "direction"))
    velocity = (speed * math.cos(direction), speed * math.sin(direction), 0.0)
    return velocity[: len(axes)]


def _read_wind(reader: JsonReader, spec: Any, path: JsonPath) -> Wind:
    x, y, z = _read_velocity(reader, spec, path, "xyz")
    spec = reader.read_object(
        spec, path, (), ("speed", "direction", "velocity", "turbulence", "profile")
    )
    turbulence, profile = (*path, "turbulence"), (*path, "profile")
    return Wind(
        (x, y, z),
        _read_turbulence(reader, spec["turbulence"], turbulence, math.hypot(x, y))
        if "turbulence" in spec
        else None,
        _read_profile(reader, spec["profile"], profile) if "profile" in spec else None,
    )


def _read_turbulence(reader: JsonReader, spec: Any, path: JsonPath, speed: float) -> Turbulence:
    spec = reader.read_object(spec, path, (), ("speed_20ft", "intensity", "height", "airspeed"))
    height = reader.number(
        spec.get("height", TURBULENCE_HEIGHT), (*path, "height"), MIN_HEIGHT, MAX_HEIGHT
    )
    if "airspeed" not in spec and speed == 0:
        reader.add_problem(path, '"airspeed" is missing; it is required without a mean wind')
    airspeed = reader.positive(spec.get("airspeed", speed or 1.0), (*path, "airspeed"))
    if "intensity" not in spec:
        speed_20ft = reader.number(spec.get("speed_20ft", speed), (*path, "speed_20ft"), 0.0)
        return Turbulence(turbulence_intensities(speed_20ft, height), height, airspeed)
    if "speed_20ft" in spec:
        reader.add_problem(
            (*path, "speed_20ft"), 'found beside "intensity", expected only one of them'
        )
    u, v, w = reader.vector(spec["intensity"], (*path, "intensity"), "uvw")
    if min(u, v, w) < 0:
        reader.add_problem(
            (*path, "intensity"),
            f"found {[u, v, w]}, expected standard deviations of at least 0 m/s",
        )
    return Turbulence((u, v, w), height, airspeed)


def _read_profile(reader: JsonReader, spec: Any, path: JsonPath) -> WindProfile:
    spec = reader.read_object(spec, path, (), ("exponent", "roughness", "reference_height"))
    height = reader.positive(
        spec.get("reference_height", REFERENCE_HEIGHT), (*path, "reference_height")
    )
    if ("exponent" in spec) == ("roughness" in spec):
        reader.add_problem(path, 'expected either "exponent" or "roughness"')
    if "roughness" not in spec:
        return power_law_profile(
            reader.number(spec.get("exponent", 0.0), (*path, "exponent"), 0.0, 1.0), height
        )
    roughness = reader.positive(spec["roughness"], (*path, "roughness"))
    if roughness >= height:
        reader.add_problem(
            (*path, "roughness"),
            f"found {roughness:g}, expected less than the reference height of {height:g} m",
        )
        roughness = height / 2
    return logarithmic_profile(roughness, height)


def _read_current(reader: JsonReader, spec: Any, path: JsonPath) -> Current:
    x, y = _read_velocity(reader, spec, path, "xy")
    spec = reader.read_object(
        spec, path, (), ("speed", "direction", "velocity", "ramp", "variation")
    )
    return Current(
        (x, y),
        _read_ramp(reader, spec["ramp"], (*path, "ramp")) if "ramp" in spec else None,
        _read_variation(reader, spec["variation"], (*path, "variation"))
        if "variation" in spec
        else None,
    )


def _read_ramp(reader: JsonReader, spec: Any, path: JsonPath) -> Ramp:
    spec = reader.read_object(spec, path, ("change", "duration"), ("start",))
    x, y = reader.vector(spec.get("change", [0.0, 0.0]), (*path, "change"), "xy")
    start = reader.number(spec.get("start", 0.0), (*path, "start"), 0.0)
    return Ramp((x, y), start, reader.positive(spec.get("duration", 1.0), (*path, "duration")))


def _read_variation(reader: JsonReader, spec: Any, path: JsonPath) -> Variation:
    spec = reader.read_object(spec, path, ("standard_deviation", "time_constant"), ())
    deviation = reader.number(
        spec.get("standard_deviation", 0.0), (*path, "standard_deviation"), 0.0
    )
    return Variation(
        deviation, reader.positive(spec.get("time_constant", 1.0), (*path, "time_constant"))
    )
