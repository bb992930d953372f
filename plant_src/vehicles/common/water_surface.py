"""Elevation of the water surface in irregular waves.

It is a CasADi function that the binaries of vehicles call in C.
The elevation is the sum over components of a cos(k (x cos d + y sin d) - w t + phase).
"""

import casadi as ca
from casadi import SX

from cosim.export.equations.c_code import sum_over_rows

from .elementary_functions import sine_and_cosine
from .interface import MAX_WAVE_COMPONENTS

#: columns of the table of components: amplitude (m), wave number along x and y (rad/m), frequency
#: (rad/s), phase (rad)
WAVE_COLUMNS = 5


def _elevation_term() -> ca.Function:
    """Return the function of one component.

    (x, y, time) and a row of the table to the elevation.
    """
    place, row = SX.sym("place", 3), SX.sym("row", WAVE_COLUMNS)
    amplitude, kx, ky, frequency, phase = ca.vertsplit(row)
    angle = kx * place[0] + ky * place[1] - frequency * place[2] + phase
    return ca.Function("elevation_term", [place, row], [amplitude * sine_and_cosine(angle)[1]])


#: sum over all components, which the equations call as a loop in C
SURFACE_SUM = sum_over_rows("surface", _elevation_term(), MAX_WAVE_COMPONENTS)


def create_elevation_function() -> ca.Function:
    """Return the function from (x, y, time), number and table of components to the elevation."""
    place, count = SX.sym("place", 3), SX.sym("count")
    rows = SX.sym("rows", MAX_WAVE_COMPONENTS, WAVE_COLUMNS)
    return ca.Function(
        "water_elevation",
        [place, count, ca.vec(rows)],
        [SURFACE_SUM(place, count, rows)],
        ["place_and_time", "wave_count", "waves"],
        ["elevation"],
    )
