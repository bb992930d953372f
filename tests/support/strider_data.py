"""The Strider as data of the planar and of the floating family, from the parameters of its own
equations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_src.vehicles.strider import parameters as geometry
from plant_src.vehicles.strider import parameters as p
from plant_src.vehicles.strider_6dof import parameters as p6

#: linear damping of u, v, r by both hulls of the paper
HULLS = -p.HULL_COUNT * np.array([[0, 0, 0], [0, p.Y_V, p.Y_R], [0, p.N_V, p.N_R]])


def _common() -> dict[str, Any]:
    boxes = []
    for box in geometry.BODY.boxes:
        size = [2 * half for half in box.half_extents]
        boxes.append({"size": size, "position": list(box.position)})
    return {
        "mass": p.MASS,
        "water_density": p.WATER_DENSITY,
        "air_drag": [p.AIR_DRAG, p.AIR_DRAG],
        "deck_centre": list(geometry.DECK_CENTRE),
        # a thrust of 1 N per (rad/s)^2
        "propellers": [{"position": [0, 0, 0], "thrust_coefficient": 1, "max_speed": 100}],
        "boxes": boxes,
        "crash_speed": p.CRASH_SPEED,
    }


def _rudder(height: float) -> dict[str, Any]:
    stall, lift = p.STALL_ANGLE, p.RUDDER_MAX_LIFT_COEFFICIENT
    place = [-p.RUDDER_ARM, 0, height]
    return {
        "position": place,
        "area": p.RUDDER_AREA,
        "max_lift_coefficient": lift,
        "stall_angle": stall,
        "max_angle": 1.5,
    }


def planar_strider() -> dict[str, Any]:
    return {
        **_common(),
        "family": "planar_vessel",
        "yaw_inertia": p.INERTIA[2],
        "height": p.CENTRE_OF_MASS_HEIGHT,
        "added_mass": [0, 0, 0],
        "linear_damping": HULLS.tolist(),
        "rudders": [_rudder(0.0)],
    }


def floating_strider() -> dict[str, Any]:
    damping = np.zeros((6, 6))
    damping[np.ix_([0, 1, 5], [0, 1, 5])] = HULLS
    damping[3] = -p6.HULL_FORCE_HEIGHT * damping[1]
    damping[[2, 3, 4], [2, 3, 4]] += p6.DAMPING
    hull = {
        "count": 2,
        "length": p.HULL_LENGTH,
        "beam": p.HULL_BEAM,
        "offset": p.HULL_OFFSET,
        "depth": p6.HULL_DEPTH,
    }
    hull |= {
        "bottom": -p.CENTRE_OF_MASS_HEIGHT - p6.MEAN_DRAUGHT,
        "waterplane_coefficient": p.WATERPLANE_COEFFICIENT,
    }
    return {
        **_common(),
        "family": "surface_vessel",
        "inertia": list(p.INERTIA),
        "hull": {**hull, "vertical_drag_coefficient": p6.PLATE_DRAG_COEFFICIENT},
        "added_mass": np.diag(p6.ADDED_MASS).tolist(),
        "coriolis_added_mass": np.diag(p6.CORIOLIS_ADDED_MASS).tolist(),
        "linear_damping": damping.tolist(),
        "rudders": [_rudder(p6.RUDDER_HEIGHT)],
    }
