"""JSON Schema of a world's argument "environment".

`environment/settings.py` checks the values and explains the keys.
"""

from ..environment.sea import (
    GAMMA,
    MAX_COMPONENTS,
    MAX_GAMMA,
    MIN_GAMMA,
    SIGNIFICANT_HEIGHTS,
    SPECTRA,
)
from ..environment.settings import (
    MAX_SIGNIFICANT_HEIGHT,
    MAX_SPREADING,
    REFERENCE_HEIGHT,
    TURBULENCE_HEIGHT,
)
from ..environment.wind_and_current import MAX_HEIGHT, MIN_HEIGHT
from .schema_parts import (
    AT_LEAST_0,
    NUMBER,
    POSITIVE,
    Schema,
    documented_object,
    documented_part,
    documented_value,
    documented_vector,
)

_COUNTER_CLOCKWISE = "towards which it moves, counter-clockwise from x (east)"


_WAVE_HEIGHT_RANGE: Schema = {"type": "number", "minimum": 0, "maximum": MAX_SIGNIFICANT_HEIGHT}
_HEIGHT_RANGE: Schema = {"type": "number", "minimum": MIN_HEIGHT, "maximum": MAX_HEIGHT}
_EXPONENT_RANGE: Schema = {"type": "number", "minimum": 0, "maximum": 1}


def _flow(axes: str) -> dict[str, Schema]:
    """Return the keys of a mean velocity: speed and direction, or a vector with these axes."""
    zeros = [0.3, 0.1, 0][: len(axes)]
    return {
        "speed": documented_value(
            AT_LEAST_0, "mean speed; required unless `velocity` is given", "m/s", 5
        ),
        "direction": documented_value(NUMBER, f"direction {_COUNTER_CLOCKWISE}", "rad", 1.0, 0.0),
        "velocity": documented_vector(
            f"mean velocity [{', '.join(axes)}], in place of `speed` and `direction`", "m/s", zeros
        ),
    }


#: schemas of the environment and of the objects in it by name
ENVIRONMENT_SCHEMAS: dict[str, Schema] = {
    "WorldEnvironment": documented_object(
        (
            "Waves, wind and current of a world. Directions are those towards which waves, wind "
            "and current move."
        ),
        {
            "seed": documented_value(
                {"type": "integer", "minimum": 0},
                "seed of waves and gusts; equal seeds give equal runs",
                "",
                7,
                0,
            ),
            "sea_state": documented_value(
                {"type": "integer", "minimum": 0, "maximum": len(SIGNIFICANT_HEIGHTS) - 1},
                "sea state of the WMO, which stands for a significant height of "
                f"{', '.join(f'{height:g}' for height in SIGNIFICANT_HEIGHTS)} m; default: no "
                "waves",
                "",
                3,
            ),
            "waves": documented_part(
                "WorldWaves",
                "properties of the waves; default: no waves",
                {"significant_height": 0.5, "peak_period": 3},
            ),
            "wind": documented_part(
                "WorldWind", "wind; default: none", {"speed": 5, "direction": 1}
            ),
            "current": documented_part(
                "WorldCurrent", "current of the water; default: none", {"velocity": [0.3, 0.1]}
            ),
        },
    ),
    "WorldWaves": documented_object(
        "Irregular waves. The significant height is required unless `sea_state` gives it.",
        {
            "significant_height": documented_value(
                _WAVE_HEIGHT_RANGE, "significant height Hs, in place of `sea_state`", "m", 0.5
            ),
            "peak_period": documented_value(
                POSITIVE,
                "peak period; default: that of the fully developed sea, 5.0 sqrt(Hs)",
                "s",
                3.0,
            ),
            "spectrum": {
                "enum": list(SPECTRA),
                "description": "`pierson_moskowitz` (ITTC-modified) or `jonswap` (DNV-RP-C205)",
                "default": "pierson_moskowitz",
                "examples": ["jonswap"],
            },
            "gamma": documented_value(
                {"type": "number", "minimum": MIN_GAMMA, "maximum": MAX_GAMMA},
                "peak enhancement of `jonswap`",
                "1",
                2.0,
                GAMMA,
            ),
            "direction": documented_value(
                NUMBER, f"mean direction {_COUNTER_CLOCKWISE}", "rad", 0.5, 0.0
            ),
            "spreading": documented_value(
                {"type": ["number", "null"], "minimum": 0, "maximum": MAX_SPREADING},
                "power n of the spreading function cos^n; default: long-crested waves",
                "1",
                2,
            ),
            "components": documented_value(
                {"type": "integer", "minimum": 1, "maximum": MAX_COMPONENTS},
                "number of wave components; fewer are faster",
                "",
                32,
                MAX_COMPONENTS,
            ),
        },
    ),
    "WorldWind": documented_object(
        "Mean wind, its profile over the height, and gusts.",
        {
            **_flow("xyz"),
            "turbulence": documented_part(
                "WorldTurbulence",
                (
                    "Dryden gusts (MIL-F-8785C); `{}` derives all values from the mean wind; "
                    "default: none"
                ),
                {"height": 10},
            ),
            "profile": documented_part(
                "WorldWindProfile",
                "mean wind over the height; default: the same at all heights",
                {"exponent": 0.14},
            ),
        },
    ),
    "WorldTurbulence": documented_object(
        "Gusts.",
        {
            "speed_20ft": documented_value(
                AT_LEAST_0, "wind speed at 6.1 m; default: the mean wind", "m/s", 5
            ),
            "intensity": documented_vector(
                "standard deviations along u, v, w, in place of `speed_20ft`",
                "m/s",
                [0.5, 0.5, 0.3],
            ),
            "height": documented_value(
                _HEIGHT_RANGE,
                "height above ground of the turbulence model",
                "m",
                10,
                TURBULENCE_HEIGHT,
            ),
            "airspeed": documented_value(
                POSITIVE,
                "speed at which the gusts pass the vehicle; default: the mean wind",
                "m/s",
                5,
            ),
        },
    ),
    "WorldWindProfile": documented_object(
        "Wind over the height: a power law or a logarithmic profile.",
        {
            "exponent": documented_value(_EXPONENT_RANGE, "exponent of the power law", "1", 0.14),
            "roughness": documented_value(
                POSITIVE,
                "roughness length of the logarithmic profile, in place of `exponent`",
                "m",
                0.0002,
            ),
            "reference_height": documented_value(
                POSITIVE,
                "height at which the profile equals the mean wind",
                "m",
                5,
                REFERENCE_HEIGHT,
            ),
        },
    ),
    "WorldCurrent": documented_object(
        "Current of the water, equal at all places.",
        {
            **_flow("xy"),
            "ramp": documented_part(
                "WorldCurrentRamp",
                "change of the mean current; default: none",
                {"change": [0.1, 0], "duration": 20},
            ),
            "variation": documented_part(
                "WorldCurrentVariation",
                "random variation; default: none",
                {"standard_deviation": 0.05, "time_constant": 60},
            ),
        },
    ),
    "WorldCurrentRamp": documented_object(
        "Change of the current that grows linearly.",
        {
            "change": documented_vector("change [x, y] at the end of the ramp", "m/s", [0.1, 0]),
            "start": documented_value(AT_LEAST_0, "time at which it begins", "s", 10, 0.0),
            "duration": documented_value(POSITIVE, "duration", "s", 20),
        },
        ("change", "duration"),
    ),
    "WorldCurrentVariation": documented_object(
        "First-order Gauss-Markov process in x and y.",
        {
            "standard_deviation": documented_value(AT_LEAST_0, "standard deviation", "m/s", 0.05),
            "time_constant": documented_value(POSITIVE, "correlation time", "s", 60),
        },
        ("standard_deviation", "time_constant"),
    ),
}
