"""Synthetic mission with the signals and the scenario that the scene needs."""

from dataclasses import replace

import numpy as np
from mission_recording import mission_result

VEHICLES = {"uav": {"model": "ar_drone"}, "usv": {"model": "strider"}}
PLATFORMS = {"start": {"size": [4.0, 4.0, 0.05], "position": [-5.0, 1.0, 0.45]}}
SCENARIO = {"components": {"plant": {"arguments": {"vehicles": VEHICLES, "platforms": PLATFORMS}}}}


def scene_mission():
    """The mission of `mission_recording` with level vehicles, the vessel at its height, and its
    scenario.
    """
    result = mission_result()
    still = np.zeros_like(result.time)
    columns = dict(result.recording.columns)
    for vehicle in ("plant.uav", "plant.usv"):
        columns |= {f"{vehicle}.orientation.{part}": still + (part == "w") for part in "wxyz"}
    columns["plant.usv.position.z"] = still + 0.1245
    return replace(
        result,
        recording=replace(result.recording, columns=columns),
        metadata={"scenario": SCENARIO},
    )
