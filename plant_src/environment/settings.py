"""Reading the section "environment" of a scenario's world: JSON -> what air and water do.

    {"seed": 7, "sea_state": 3,
     "waves": {"spectrum": "jonswap", "significant_height": 0.05, "peak_period": 2.0, "gamma": 3.3, "direction": 0.5,
               "spreading": 2, "components": 64},
     "wind": {"speed": 5, "direction": 1.0, "turbulence": {"speed_20ft": 5, "height": 6.1, "airspeed": 5},
              "profile": {"exponent": 0.14, "reference_height": 10}},
     "current": {"speed": 0.2, "direction": 0.0, "ramp": {"change": [0.1, 0], "start": 10, "duration": 20},
                 "variation": {"standard_deviation": 0.05, "time_constant": 60}}}

Everything can be left out; what each key means and what stands for it if it is missing is said in plant_src/README.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..json_reader import Keys, Numbers, Reader
from .current import Current, Ramp, Variation
from .sea import MOST_COMPONENTS, Waves
from .spectrum import GAMMA, LARGEST_GAMMA, SIGNIFICANT_HEIGHTS, SMALLEST_GAMMA, SPECTRA, fully_developed_period
from .wind import HIGHEST, LOWEST, Height, Turbulence, Wind, deviations, logarithmic, power_law

#: height (m) at which the wind is measured for turbulence, 20 ft
TURBULENCE_HEIGHT = 6.096

#: height (m) at which the mean wind is meant where it grows with height
REFERENCE_HEIGHT = 10.0

#: greater powers of the spreading function are long crests; greater heights (m) are no seas
LARGEST_SPREADING, LARGEST_HEIGHT = 1000.0, 30.0

_WAVE_KEYS = ("spectrum", "significant_height", "peak_period", "gamma", "direction", "spreading", "components")


@dataclass(frozen=True)
class Environment:
    """What surrounds the vehicles; None: there is none of it, and its variables do not exist."""

    seed: int = 0
    waves: Waves | None = None
    wind: Wind | None = None
    current: Current | None = None


def read(reader: Reader, spec: Any) -> Environment:
    """Read the section; problems are left with the reader."""
    root = ("environment",)
    spec = reader.keys(spec, root, (), ("seed", "sea_state", "waves", "wind", "current"))
    return Environment(
        reader.integer(spec.get("seed", 0), (*root, "seed"), 0),
        _waves(reader, spec, root) if {"sea_state", "waves"} & set(spec) else None,
        _wind(reader, spec["wind"], (*root, "wind")) if "wind" in spec else None,
        _current(reader, spec["current"], (*root, "current")) if "current" in spec else None,
    )


def _waves(reader: Reader, spec: Mapping[str, Any], root: Keys) -> Waves:
    path = (*root, "waves")
    height = _significant_height(reader, spec, root)
    waves = reader.keys(spec.get("waves", {}), path, (), _WAVE_KEYS)
    usual = fully_developed_period(height) if height else 1.0
    spectrum = reader.choice(waves.get("spectrum", "pierson_moskowitz"), (*path, "spectrum"), tuple(SPECTRA))
    if "gamma" in waves and spectrum != "jonswap":
        reader.complain((*path, "gamma"), f'found a peak enhancement, which a "{spectrum}" spectrum does not have')
    spreading = waves.get("spreading")
    return Waves(
        spectrum,
        height,
        reader.positive(waves.get("peak_period", usual), (*path, "peak_period")),
        reader.number(waves.get("gamma", GAMMA), (*path, "gamma"), SMALLEST_GAMMA, LARGEST_GAMMA),
        reader.number(waves.get("direction", 0.0), (*path, "direction")),
        None if spreading is None else reader.number(spreading, (*path, "spreading"), 0.0, LARGEST_SPREADING),
        reader.integer(waves.get("components", MOST_COMPONENTS), (*path, "components"), 1, MOST_COMPONENTS),
    )


def _significant_height(reader: Reader, spec: Mapping[str, Any], root: Keys) -> float:
    """Hs in m, from the sea state or the waves, whichever is given."""
    path, waves = (*root, "waves", "significant_height"), spec.get("waves", {})
    if not isinstance(waves, Mapping):
        return 0.0
    if "sea_state" not in spec:
        if "significant_height" not in waves:
            reader.complain(path[:-1], '"significant_height" is missing; or say "sea_state" beside "waves"')
        return reader.number(waves.get("significant_height", 0.0), path, 0.0, LARGEST_HEIGHT)
    if "significant_height" in waves:
        reader.complain(path, 'found beside "sea_state", which says it already; expected one of them')
    state = reader.integer(spec["sea_state"], (*root, "sea_state"), 0, len(SIGNIFICANT_HEIGHTS) - 1)
    return SIGNIFICANT_HEIGHTS[state]


def _velocity(reader: Reader, spec: Any, path: Keys, axes: str) -> Numbers:
    """A vector "velocity", or "speed" and "direction" (rad, towards which, counter-clockwise from x)."""
    if not isinstance(spec, Mapping):
        return (0.0,) * len(axes)
    if "velocity" in spec:
        for key in {"speed", "direction"} & set(spec):
            reader.complain((*path, key), 'found beside "velocity", which says it already; expected one of them')
        return reader.vector(spec["velocity"], (*path, "velocity"), axes)
    if "speed" not in spec:
        reader.complain(path, '"speed" is missing; or say "velocity"')
    speed = reader.number(spec.get("speed", 0.0), (*path, "speed"), 0.0)
    direction = reader.number(spec.get("direction", 0.0), (*path, "direction"))
    level = (speed * math.cos(direction), speed * math.sin(direction), 0.0)
    return level[: len(axes)]


def _wind(reader: Reader, spec: Any, path: Keys) -> Wind:
    x, y, z = _velocity(reader, spec, path, "xyz")
    spec = reader.keys(spec, path, (), ("speed", "direction", "velocity", "turbulence", "profile"))
    turbulence, profile = (*path, "turbulence"), (*path, "profile")
    return Wind(
        (x, y, z),
        _turbulence(reader, spec["turbulence"], turbulence, math.hypot(x, y)) if "turbulence" in spec else None,
        _profile(reader, spec["profile"], profile) if "profile" in spec else None,
    )


def _turbulence(reader: Reader, spec: Any, path: Keys, speed: float) -> Turbulence:
    spec = reader.keys(spec, path, (), ("speed_20ft", "intensity", "height", "airspeed"))
    height = reader.number(spec.get("height", TURBULENCE_HEIGHT), (*path, "height"), LOWEST, HIGHEST)
    if "airspeed" not in spec and speed == 0:
        reader.complain(path, '"airspeed" is missing: without a mean wind nothing says how fast the gusts pass')
    airspeed = reader.positive(spec.get("airspeed", speed or 1.0), (*path, "airspeed"))
    if "intensity" not in spec:
        speed_20ft = reader.number(spec.get("speed_20ft", speed), (*path, "speed_20ft"), 0.0)
        return Turbulence(deviations(speed_20ft, height), height, airspeed)
    if "speed_20ft" in spec:
        reader.complain((*path, "speed_20ft"), 'found beside "intensity", which says it already; expected one of them')
    u, v, w = reader.vector(spec["intensity"], (*path, "intensity"), "uvw")
    if min(u, v, w) < 0:
        reader.complain((*path, "intensity"), f"found {[u, v, w]}, expected standard deviations of at least 0")
    return Turbulence((u, v, w), height, airspeed)


def _profile(reader: Reader, spec: Any, path: Keys) -> Height:
    spec = reader.keys(spec, path, (), ("exponent", "roughness", "reference_height"))
    height = reader.positive(spec.get("reference_height", REFERENCE_HEIGHT), (*path, "reference_height"))
    if ("exponent" in spec) == ("roughness" in spec):
        reader.complain(path, 'expected either "exponent" or "roughness"')
    if "roughness" not in spec:
        return power_law(reader.number(spec.get("exponent", 0.0), (*path, "exponent"), 0.0, 1.0), height)
    roughness = reader.positive(spec["roughness"], (*path, "roughness"))
    if roughness >= height:
        reader.complain((*path, "roughness"), f"found {roughness:g}, expected less than the reference height of {height:g} m")
        roughness = height / 2
    return logarithmic(roughness, height)


def _current(reader: Reader, spec: Any, path: Keys) -> Current:
    x, y = _velocity(reader, spec, path, "xy")
    spec = reader.keys(spec, path, (), ("speed", "direction", "velocity", "ramp", "variation"))
    return Current(
        (x, y),
        _ramp(reader, spec["ramp"], (*path, "ramp")) if "ramp" in spec else None,
        _variation(reader, spec["variation"], (*path, "variation")) if "variation" in spec else None,
    )


def _ramp(reader: Reader, spec: Any, path: Keys) -> Ramp:
    spec = reader.keys(spec, path, ("change", "duration"), ("start",))
    x, y = reader.vector(spec.get("change", [0.0, 0.0]), (*path, "change"), "xy")
    start = reader.number(spec.get("start", 0.0), (*path, "start"), 0.0)
    return Ramp((x, y), start, reader.positive(spec.get("duration", 1.0), (*path, "duration")))


def _variation(reader: Reader, spec: Any, path: Keys) -> Variation:
    spec = reader.keys(spec, path, ("standard_deviation", "time_constant"), ())
    deviation = reader.number(spec.get("standard_deviation", 0.0), (*path, "standard_deviation"), 0.0)
    return Variation(deviation, reader.positive(spec.get("time_constant", 1.0), (*path, "time_constant")))
