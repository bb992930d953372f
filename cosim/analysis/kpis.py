"""KPIs of the control loop, for checks such as "phase margin at least 45 degrees".

    {"name": "loop", "python": "cosim.analysis.kpis:margins", "arguments": {"components": "uav",
    "at": 15}}

Each function runs the scenario of the result again up to a point in time, where it linearises the
loop.
"""

import math
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..results import Result
from ..results.kpi import better, no_value, units
from ..scenario.component_schema import change_paths
from ..scenario.file_paths import relocating
from .loop_margins import margins as loop_margins


@better(
    gain_margin="higher",
    phase_margin="higher",
    delay_margin="higher",
    disk_margin="higher",
    stable="higher",
)
@units(gain_margin="dB", phase_margin="deg", delay_margin="s")
@no_value("a loop of {components} is unstable, or its linear model is not valid")
def margins(
    result: Result,
    components: str,
    at: float,
    loops: list[str] | None = None,
    duration: float | None = None,
) -> dict[str, float | bool]:
    """Return the smallest margins at the inputs and outputs of a controller.

    They are gain (dB), phase (deg), delay (s) and disk margin (1).

    If a loop is unstable or its linear model is not valid, `stable` is false and the margins are
    NaN.

    Args:
        result: Recorded run.
        components: Name of a component or nested system.
        at: Time at which the loop is linearised (s).
        loops: Names of signals; None: all connected inputs and outputs.
        duration: Duration of the impulse responses (s); None: 256 samples, and more for slow modes.
    """
    found = loop_margins(
        recorded_scenario(result), components, at, loops=loops or (), duration=duration
    )
    if not all(each.stable and each.valid for each in found):
        return {
            **dict.fromkeys(
                ("gain_margin", "phase_margin", "delay_margin", "disk_margin"), math.nan
            ),
            "stable": False,
        }
    return {
        "gain_margin": 20 * math.log10(min((each.gain for each in found), default=math.inf)),
        "phase_margin": math.degrees(min((each.phase for each in found), default=math.inf)),
        "delay_margin": min((each.delay for each in found), default=math.inf),
        "disk_margin": min((each.disk for each in found), default=math.inf),
        "stable": True,
    }


def recorded_scenario(result: Result) -> dict[str, Any]:
    """Return the scenario of a run with absolute paths, and with the values that the caller set.

    Raises:
        InputError: The result does not hold its scenario, as that of a CSV file.
    """
    about = result.metadata
    if "scenario" not in about or "scenario_file" not in about:
        raise InputError(
            "the result does not hold its scenario, expected one of cosim.run or of a folder that "
            "cosim run wrote"
        )
    folder = Path(about["scenario_file"]).parent
    scenario = change_paths(about["scenario"], relocating(folder, None))
    for name, value in about.get("parameters", {}).items():
        component, _, variable = name.partition(".")
        spec = scenario["components"][component]
        parameters = {**spec.get("parameters", {}), variable: value}
        scenario["components"][component] = {**spec, "parameters": parameters}
    return scenario
