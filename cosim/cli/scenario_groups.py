"""Groups of the shipped scenarios, in the order in which lists show them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase

from .shipped import Entry

#: patterns of names by the heading of a group; the first matching pattern counts, "*" is the group
#: of all others
SCENARIO_GROUPS: Mapping[str, tuple[str, ...]] = {
    "demos of the paper": ("demo1_box", "demo2_sweep", "demo3_inverse_kinematics", "vtol_*"),
    "demo 1 in other surroundings": ("demo1_waves", "demo1_wind", "demo1_current", "harbour"),
    "landings in waves and on other vessels": (
        "landing_waves",
        "landing_on_otter",
        "landing_on_helping_vessel",
    ),
    "landings on measurements alone": ("*_on_sensors",),
    "faults": ("fault_*",),
    "vessels": ("station_keeping", "path_in_current", "otter_*", "vehicle_library"),
    "other vehicles and fleets": ("crazyflie_*", "survey_*", "rov_*", "fleet_*"),
    "connections of FMUs": ("free_flight", "mapped_*"),
    "timing runs of the paper": ("performance_*",),
    "replica of the published simulator": ("*_replica",),
    "others": ("*",),
}


def group_scenarios(entries: Iterable[Entry]) -> dict[str, list[Entry]]:
    """Return the scenarios by the headings of their groups; empty groups are left out."""
    found: dict[str, list[Entry]] = {heading: [] for heading in SCENARIO_GROUPS}
    for entry in entries:
        found[_heading(entry.name)].append(entry)
    return {heading: group for heading, group in found.items() if group}


def _heading(name: str) -> str:
    return next(
        h
        for h, patterns in SCENARIO_GROUPS.items()
        if any(fnmatchcase(name, pattern) for pattern in patterns)
    )
