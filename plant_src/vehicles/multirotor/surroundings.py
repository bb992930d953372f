"""Surface below a multirotor and height of the water at it.

The multirotor's binary computes them in each step of a world.

The surface is the highest deck, platform or water vertically below the centre of the rotors. An
edge at the distance d from the centre leaves the share 1/2 + (c sqrt(1 - c^2) + asin c) / pi of a
disc of the radius R, with c = d / R limited to -1 ... 1: the area of a segment of a circle. The
share of a strip is the sum of those of its edges minus 1. The share of a rectangle is the product
of those of its two strips, which is exact beside one edge.
"""

import math

import casadi as ca
from casadi import SX

from cosim.export.equations.c_code import Callee, call_in_c

from ..common import kinematics
from ..common.elementary_functions import arctangent
from ..common.interface import MAX_WAVE_COMPONENTS, SURFACE_COLUMNS
from ..common.water_surface import WAVE_COLUMNS, create_elevation_function

#: height above the still water (m) from which waves are ignored, because they do not affect a rotor
MAX_WAVE_EFFECT_HEIGHT = 5.0

#: replaces smaller radii (m)
_SMALLEST_RADIUS = 1e-9


def create_surroundings_function() -> tuple[ca.Function, Callee]:
    """Return the exported function `surroundings` and the function with a C body that it calls.

    Its arguments are:

    - pose: position and quaternion of the multirotor, shape (7,).
    - disc: centre of the rotors (m, body frame), radius of the disc of the rotors (m), and distance
      (m) above all crests within which the vehicle needs the water level, shape (5,).
    - sea: time of the waves (s), factor on all amplitudes (1), number of components, and height
      that no crest exceeds (m).
    - waves: table of the components, shape (MAX_WAVE_COMPONENTS, WAVE_COLUMNS), see
      `environment.sea.Sea.component_table`.
    - surface_count: number of surfaces.
    - surface_rows: table of surfaces, one row after the other. It may have any number of rows in C,
      and one in CasADi.

    Its result has the shape (3,): distance (m) from the centre of the rotors to the surface below,
    0 under water; share (1) of the disc that is above this surface; height of the water (m) at the
    centre of mass, or below all crests if it is not needed.
    """
    sizes = {
        "pose": 7,
        "disc": 5,
        "sea": 4,
        "waves": MAX_WAVE_COMPONENTS * WAVE_COLUMNS,
        "surface_count": 1,
        "surface_rows": SURFACE_COLUMNS,
    }
    arguments = pose, disc, sea, waves, count, row = [
        SX.sym(name, size) for name, size in sizes.items()
    ]
    centre_of_rotors = pose[0:3] + kinematics.rotation_matrix(pose[3:7]) @ disc[0:3]
    point = ca.Function("disc_centre", [pose, disc], [centre_of_rotors])
    elevation = create_elevation_function()
    surface = _surface_function()
    centre = point(pose, disc)
    height, share = ca.vertsplit(surface(centre, disc[3], row))
    hidden = ca.logic_and(ca.logic_and(count > 0, share > 0), height <= centre[2])
    level, level_here = (
        sea[1] * elevation(ca.vertcat(place[0:2], sea[0]), sea[2], waves)
        for place in (centre, pose)
    )
    water = ca.if_else(centre[2] < MAX_WAVE_EFFECT_HEIGHT, level, 0)
    below = ca.if_else(
        hidden, ca.vertcat(centre[2] - height, share), ca.vertcat(ca.fmax(centre[2] - water, 0), 1)
    )
    needed = ca.if_else(pose[2] - disc[4] < sea[3], level_here, -sea[3])
    reference = ca.Function(
        "multirotor_surroundings", arguments, [ca.vertcat(below, needed)], {"never_inline": True}
    )
    body = _SURROUNDINGS_C % {"columns": SURFACE_COLUMNS, "wave_height": MAX_WAVE_EFFECT_HEIGHT}
    callee = Callee(reference, body, [elevation, point, surface])
    results = call_in_c(reference, *arguments)
    return ca.Function("surroundings", arguments, results, [*sizes], ["surroundings"]), callee


def _surface_function() -> ca.Function:
    """Return the function of a surface below a disc.

    Its arguments are a point (m), a radius (m) and a row of the table, its results the height (m)
    of the plane and its share. The share is 0 if the rectangle is beside the disc or upside down.
    """
    point, radius = SX.sym("point", 3), SX.sym("radius")
    row = SX.sym("row", SURFACE_COLUMNS)
    rotation, offset = kinematics.rotation_matrix(row[5:9]), point[0:2] - row[2:4]
    normal = rotation[:, 2]
    upright = normal[2] > 0
    rise = -(normal[0] * offset[0] + normal[1] * offset[1]) / ca.if_else(upright, normal[2], 1)
    along = rotation[:, 0:2].T @ ca.vertcat(offset, rise)
    limited = ca.fmax(radius, _SMALLEST_RADIUS)
    share = _share_of_strip(row[0], along[0], limited) * _share_of_strip(row[1], along[1], limited)
    return ca.Function(
        "surface_below",
        [point, radius, row],
        [ca.vertcat(row[4] + rise, ca.if_else(upright, share, 0))],
    )


def _share_of_strip(half_width: SX, position: SX, radius: SX) -> SX:
    """Return the share of a disc at a position (m) above a strip around 0."""
    near, far = half_width - ca.fabs(position), half_width + ca.fabs(position)
    return ca.fmax(_share_of_half_plane(near / radius) + _share_of_half_plane(far / radius) - 1, 0)


def _share_of_half_plane(ratio: SX) -> SX:
    """Return the share of a disc whose centre is `ratio` radii inside the edge of a half-plane."""
    root = ca.sqrt(ca.fmax(1 - ratio * ratio, 0))
    at_the_edge = 0.5 + (ratio * root + arctangent(ratio, root)) / math.pi
    return ca.if_else(ca.fabs(ratio) < 1, at_the_edge, ratio > 0)


_SURROUNDINGS_C = """{
    const double *const pose = in[0], *const disc = in[1], *const sea = in[2], *const waves = in[3];
    const double count = in[4][0], gain = sea[1], highest_water = sea[3];
    double centre[3], highest = -INFINITY, share = 0, level = 0;
    disc_centre((const double *const[]){pose, disc}, (double *const[]){centre});
    for (int k = 0; k < count; ++k) {
        const double *const row = in[5] + %(columns)d * k, reach = row[0] + row[1] + disc[3];
        double surface[2];
        if (!(fabs(centre[0] - row[2]) <= reach && fabs(centre[1] - row[3]) <= reach)) continue;
        surface_below((const double *const[]){centre, disc + 3, row}, (double *const[]){surface});
        if (surface[1] > 0 && surface[0] > highest && surface[0] <= centre[2]) {
            highest = surface[0];
            share = surface[1];
        }
    }
    if (share == 0 && centre[2] < %(wave_height)r) {
        const double place[] = {centre[0], centre[1], sea[0]};
        water_elevation((const double *const[]){place, sea + 2, waves}, (double *const[]){&level});
        level *= gain;
    }
    out[0][0] = share > 0 ? centre[2] - highest : centre[2] > level ? centre[2] - level : 0;
    out[0][1] = share > 0 ? share : 1;
    out[0][2] = -highest_water;
    if (pose[2] - disc[4] < highest_water) {
        const double place[] = {pose[0], pose[1], sea[0]};
        water_elevation((const double *const[]){place, sea + 2, waves}, \
(double *const[]){out[0] + 2});
        out[0][2] *= gain;
    }
}
"""
