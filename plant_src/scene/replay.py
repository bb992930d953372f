"""Scene description for the 3-D replay: bodies, static parts, water, waypoints and plots.

The description follows from the scenario alone. World frame, z up, m; colours of parts are red,
green, blue in 0 ... 1.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from ..catalogue import default_model
from ..environment import sea
from ..environment.sea import Sea
from ..placement import obstacles_of
from .parts import static_parts, vehicle_parts

Scene = dict[str, Any]

#: colours of the paths of multirotors and vessels; the first of each is that of the figures
MULTIROTOR_COLOURS = ("#0072b2", "#56b4e9", "#cc79a7", "#7a5fb5")
VESSEL_COLOURS = ("#d55e00", "#e69f00", "#009e73", "#b8860b")

#: colour of crashes and ditchings
FAILURE_COLOUR = "#c62828"

#: largest number of vessels with an onboard camera
MAX_VIEWS = 3

#: eye and target of an onboard camera relative to the vessel's centre of mass (m, body axes)
ONBOARD_CAMERA = {"eye": (-2.6, 0.0, 1.5), "target": (0.2, 0.0, 0.45)}


def world_scene(
    name: str, scenario: Mapping[str, Any], models: Mapping[str, Any] | None = None
) -> Scene:
    """Return the scene of a world.

    Args:
        name: Name of the component that is the world.
        scenario: Scenario as a JSON object.
        models: Vehicle of the catalogue by name, for a world whose arguments name no models.

    Returns:
        Scene description.
    """
    arguments = scenario["components"][name].get("arguments", {})
    models = models or {vehicle: spec["model"] for vehicle, spec in arguments["vehicles"].items()}
    vehicles = {f"{name}.{vehicle}": model for vehicle, model in models.items()}
    fixed = static_parts(arguments.get("platforms", {}), obstacles_of(arguments))
    waves = _waves(sea(arguments.get("environment", {})))
    return {
        **_scene(vehicles, scenario),
        "fixed": [part._asdict() for part in fixed],
        "water": {"waves": waves, "gain": f"{name}.environment.wave_gain"},
    }


def free(scenario: Mapping[str, Any], vehicles: Mapping[str, Any]) -> Scene:
    """Return the scene of a scenario with plant FMUs instead of a world.

    Args:
        scenario: Scenario as a JSON object.
        vehicles: Vehicle of the catalogue, or data of a vehicle, by component ({"quadcopter":
            "ar_drone"}).

    Returns:
        Scene description.
    """
    return {**_scene(vehicles, scenario), "fixed": [], "water": {"waves": [], "gain": 1}}


def published_simulator_scene(name: str, scenario: Mapping[str, Any]) -> Scene:
    """Return the scene of the replica's world.

    Its attitude angles are converted to the conventions of the plant.
    """
    scene = world_scene(name, scenario, {"uav": "ar_drone", "usv": "strider"})
    uav, usv = (f"{name}.{vehicle}.attitude" for vehicle in ("uav", "usv"))
    attitudes: list[list[Any]] = [
        [f"{uav}.phi", f"-{uav}.theta", f"-{uav}.psi"],
        [0, 0, f"{usv}.yaw"],
    ]
    for body, attitude in zip(scene["bodies"], attitudes, strict=True):
        body["attitude"] = attitude
        del body["orientation"]
    return scene


def _waves(components: Sea) -> list[Scene]:
    keys = ("amplitude", "frequency", "number", "direction", "phase")
    return [dict(zip(keys, wave, strict=True)) for wave in np.stack(components, axis=1).tolist()]


def _scene(vehicles: Mapping[str, Any], scenario: Mapping[str, Any]) -> Scene:
    colours = {False: cycle(MULTIROTOR_COLOURS), True: cycle(VESSEL_COLOURS)}
    models = {name: default_model(vehicle) for name, vehicle in vehicles.items()}
    has_landings = any(model.airframe for model in models.values())
    bodies, spans, marks = list[Scene](), list[Scene](), list[Scene]()
    for name, vehicle in vehicles.items():
        title, is_vessel = _short_name(name), models[name].is_vessel
        colour = next(colours[is_vessel])
        bodies.append(
            {
                "name": name,
                "title": title,
                "colour": colour,
                "position": [f"{name}.position.{axis}" for axis in "xyz"],
                "orientation": [f"{name}.orientation.{axis}" for axis in "wxyz"],
                "parts": [part._asdict() for part in vehicle_parts(vehicle, has_landings)],
            }
        )
        if not is_vessel:
            signal = f"{name}.contact.touching"
            spans.append({"signal": signal, "label": f"{title} touches", "colour": colour})
        for failure in ("crashed", "ditched"):
            label = f"{title} {failure}"
            mark = {"signal": f"{name}.{failure}", "label": label, "colour": FAILURE_COLOUR}
            marks.append({**mark, "on": name})
    vessels = [name for name, model in models.items() if model.is_vessel]
    flying = [name for name in vehicles if name not in vessels]
    views = []
    for vessel in vessels[:MAX_VIEWS]:
        title = "Deck" if len(vessels) == 1 else f"Deck {_short_name(vessel)}"
        views.append({"name": title, "on": vessel, **ONBOARD_CAMERA})
    return {
        "bodies": bodies,
        "views": views,
        "markers": list(_waypoint_markers(scenario)),
        "spans": spans,
        "marks": marks,
        "plots": _plot_patterns(flying[:1], vessels[:1]),
    }


def _short_name(name: str) -> str:
    return name.rpartition(".")[2]


def _waypoint_markers(scenario: Mapping[str, Any]) -> Iterator[Scene]:
    """Yield the waypoints of all components and nested systems.

    They are those of the parameters `waypoint_x` and `waypoint_y`.
    """
    for component in scenario["components"].values():
        parameters = component.get("parameters", {})
        for key, x in parameters.items():
            prefix = key.removesuffix("waypoint_x")
            y = parameters.get(f"{prefix}waypoint_y")
            if prefix == key or not isinstance(x, list) or not isinstance(y, list):
                continue
            count = parameters.get(f"{prefix}waypoint_count", len(x))
            radius = parameters.get(f"{prefix}acceptance_radius", 0.5)
            for number, position in enumerate(list(zip(x, y, strict=False))[:count], start=1):
                yield {"position": (*position, 0.0), "radius": radius, "label": str(number)}


def _plot_patterns(flying: Sequence[str], sailing: Sequence[str]) -> list[list[str]]:
    """Return patterns of signal names, one list for each plot."""
    heights = [f"{name}.position.z" for name in flying]
    heights += [f"{name}.deck.position.z" for name in sailing]
    plots = [heights]
    for signal in ("velocity.*", "attitude.*", "contact.force"):
        plots.append([f"{name}.{signal}" for name in flying])
    for signal in ("attitude.yaw", "velocity_body.*"):
        plots.append([f"{name}.{signal}" for name in sailing])
    return plots
