"""The five control blocks as one FMU, and as the nested system that wires them: the same
controller, bit for bit.
"""

from __future__ import annotations

import json
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

SYSTEM = json.loads(
    (Path(__file__).parents[2] / "scenarios/systems/ar_drone_cascaded.json").read_text()
)


def covered(name: str, prefix: str) -> bool:
    return name == prefix or name.startswith((prefix + ".", prefix + "["))


class Wired:
    """The nested system, run block by block in its stage order."""

    def __init__(self, controller: Any):
        self.blocks = {
            name: controller(Path(c["fmu"]).stem) for name, c in SYSTEM["components"].items()
        }

    def step(self, inputs: dict[str, float]) -> dict[str, float]:
        pending: dict[str, dict[str, float]] = {name: {} for name in self.blocks}
        signals: dict[str, float] = {}
        for port, value in inputs.items():
            head, *_ = port.split(".")
            self._deliver(SYSTEM["ports"]["inputs"][head], head, port, value, pending)
        for name in chain.from_iterable(SYSTEM["algorithm"]["stages"]):
            for output, value in self.blocks[name].step(pending[name]).items():
                signals[f"{name}.{output}"] = value
                for wire in SYSTEM["connections"]:
                    if covered(f"{name}.{output}", wire["from"]):
                        self._deliver(wire["to"], wire["from"], f"{name}.{output}", value, pending)
        outputs = dict[str, float]()
        for port, inner in SYSTEM["ports"]["outputs"].items():
            outputs |= {
                port + signal.removeprefix(inner): value
                for signal, value in signals.items()
                if covered(signal, inner)
            }
        return outputs

    def _deliver(
        self,
        ends: str | list[str],
        head: str,
        source: str,
        value: float,
        pending: dict[str, dict[str, float]],
    ) -> None:
        for end in [ends] if isinstance(ends, str) else ends:
            block, _, variable = (end + source.removeprefix(head)).partition(".")
            if variable in self.blocks[block].variables:
                pending[block][variable] = value


def measurements(rng: np.random.Generator, k: int) -> dict[str, Any]:
    """A vehicle that climbs, hovers near its deck and comes down on it, shaken by noise."""
    altitude = float(np.interp(k, [0, 40, 200, 600, 900], [0.53, 0.53, 2.0, 1.0, 0.32]))
    noise = dict(zip(("roll", "pitch", "yaw"), rng.normal(0, 0.05, 3).tolist(), strict=True))
    vehicle = {f"vehicle.attitude.{axis}": value for axis, value in noise.items()}
    vehicle |= {f"vehicle.velocity.{axis}": float(rng.normal(0, 0.1)) for axis in "xy"}
    vehicle |= {f"vehicle.position.{axis}": float(rng.normal(0, 0.01)) for axis in "xy"}
    deck = {
        "target.position.x": 0.0,
        "target.position.y": 0.0,
        "target.position.z": 0.2689,
        "target.velocity.x": 0.3,
    }
    return (
        vehicle
        | deck
        | {
            "vehicle.position.z": altitude,
            "vehicle.contact.vessel": k > 890,
            "altitude_command": 1.9,
        }
    )


def test_one_fmu_equals_the_nested_system_bit_for_bit(controller: Any) -> None:
    rng, whole, wired = np.random.default_rng(0), controller("ar_drone_cascaded"), Wired(controller)
    for k in range(1000):
        inputs = measurements(rng, k)
        one, five = whole.step(inputs), wired.step(inputs)
        assert one == {name: five[name] for name in one}, f"tick {k}"
    assert one["mode"] == 6
    assert [one[f"rotor_speed[{n}]"] for n in range(1, 5)] == [0.0] * 4


def test_parameters_have_equal_names_in_both(controller: Any) -> None:
    whole = controller("ar_drone_cascaded").variables
    for name, block in Wired(controller).blocks.items():
        parameters = {v.name for v in block.variables.values() if v.causality == "parameter"}
        assert {f"{name}.{parameter}" for parameter in parameters} <= set(whole)
