"""Flight modes of the quadcopter with a vehicle that follows its references exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi
from typing import Any

import controller_reference
import numpy as np
import pytest

IDLE, TAKE_OFF, FOLLOW, APPROACH, DESCEND, LANDED = range(1, 7)
DECK = 0.2689
RESTING = DECK + 0.056
APPROACH_ALTITUDE = RESTING + 0.675


@dataclass
class Flight:
    """Vehicle at its reference position, `offset` (m) east of the deck centre from the mode follow
    on.
    """

    vtol: Any
    offset: float = 0.0
    contact: bool = False
    altitude: float = 0.532
    deck: list[float] = field(default_factory=lambda: [5.0, 1.0, DECK])
    position: list[float] = field(default_factory=lambda: [-5.0, 1.0])
    out: dict[str, Any] = field(default_factory=dict)
    tick: int = 0

    def fly(self, seconds: float) -> dict[str, Any]:
        for _ in range(round(seconds / 0.01)):
            self._step()
        return self.out

    def until(self, mode: int, patience: float = 20.0) -> dict[str, Any]:
        for _ in range(round(patience / 0.01)):
            if self._step()["mode"] == mode:
                return self.out
        raise AssertionError(f"mode {mode} is not reached within {patience} s; now {self.out}")

    def _step(self) -> dict[str, Any]:
        inputs = dict(zip((f"target.position.{axis}" for axis in "xyz"), self.deck, strict=True))
        inputs |= {"vehicle.position.x": self.position[0], "vehicle.position.y": self.position[1]}
        inputs |= {"vehicle.position.z": self.altitude, "vehicle.contact.vessel": self.contact}
        inputs |= {"target.velocity.x": 0.8, "target.velocity.y": -0.6}
        self.out = self.vtol.step(
            inputs | {"vehicle.attitude.yaw": pi / 2, "altitude_command": 2.0, "yaw_command": 0.1}
        )
        self.tick += 1
        self.altitude = max(
            self.out["altitude_reference"], RESTING if self.out["mode"] >= DESCEND else 0.0
        )
        if self.out["mode"] >= FOLLOW:
            self.position = [self.deck[0] + self.offset, self.deck[1]]
        return self.out


@pytest.fixture
def flight(controller: Any) -> Callable[..., Flight]:
    return lambda **parameters: Flight(controller("vtol", parameters))


def test_waits_for_the_take_off_time_with_stopped_motors(flight: Any) -> None:
    waiting = flight(take_off_time=1.0)
    out = waiting.fly(1.0)
    assert (out["mode"], out["motor_share"], out["motors_on"], out["reset"]) == (
        IDLE,
        0.0,
        False,
        True,
    )
    assert waiting.fly(0.01)["mode"] == TAKE_OFF


def test_motors_spin_up_evenly_before_the_climb(flight: Any) -> None:
    taking_off = flight()
    shares = [taking_off.fly(0.01)["motor_share"] for _ in range(29)]
    assert shares == pytest.approx([k / 30 for k in range(1, 30)])
    assert taking_off.out["reset"]
    assert taking_off.out["motors_on"]
    assert taking_off.out["altitude_reference"] == 0.532
    out = taking_off.fly(0.02)
    assert (out["motor_share"], out["reset"]) == (1.0, False)


def test_climbs_over_its_starting_point_until_it_is_clear(flight: Any) -> None:
    climb = flight()
    while climb.altitude <= 0.532 + 0.4:
        out = climb.fly(0.01)
        assert out["mode"] == TAKE_OFF
        assert (out["position_reference.x"], out["position_reference.y"], out["yaw_reference"]) == (
            -5.0,
            1.0,
            pi / 2,
        )
        assert (out["velocity_reference.x"], out["velocity_reference.y"]) == (0.0, 0.0)
    assert climb.fly(0.01)["mode"] == FOLLOW


def test_gets_clear_even_when_commanded_lower(controller: Any) -> None:
    vtol, altitude = controller("vtol"), 0.5
    for _ in range(150):
        out = vtol.step({"vehicle.position.z": altitude, "altitude_command": 0.3})
        altitude = out["altitude_reference"]
    assert out["mode"] == FOLLOW


def test_follows_the_deck_with_feed_forward_and_the_commanded_yaw(flight: Any) -> None:
    out = flight().until(FOLLOW)
    assert (out["position_reference.x"], out["position_reference.y"]) == (5.0, 1.0)
    assert (out["velocity_reference.x"], out["velocity_reference.y"]) == (0.8, -0.6)
    assert out["yaw_reference"] == 0.1


def test_feed_forward_can_be_switched_off(flight: Any) -> None:
    out = flight(velocity_feed_forward=False).until(FOLLOW)
    assert (out["velocity_reference.x"], out["velocity_reference.y"]) == (0.0, 0.0)


def test_altitude_reference_climbs_no_faster_than_allowed(flight: Any) -> None:
    climb = flight(climb_rate=0.5)
    climb.fly(0.5)
    before = climb.out["altitude_reference"]
    assert climb.fly(1.0)["altitude_reference"] - before == pytest.approx(0.5)
    assert climb.fly(3.0)["altitude_reference"] == 2.0


def test_horizontal_error_is_the_distance_to_the_deck(flight: Any) -> None:
    start = flight()
    assert start.fly(0.01)["horizontal_error"] == 10.0


def test_approach_starts_at_the_landing_time(flight: Any) -> None:
    following = flight(landing_time=5.0)
    assert following.fly(5.0)["mode"] == FOLLOW
    assert following.fly(0.01)["mode"] == APPROACH


def test_never_approaches_when_landing_is_disabled(flight: Any) -> None:
    assert flight(landing_enabled=False).fly(20.0)["mode"] == FOLLOW


@pytest.mark.parametrize("raised", [0.0, 1.0])
def test_approach_height_counts_from_the_deck(flight: Any, raised: float) -> None:
    approach = flight(landing_time=3.0)
    approach.deck[2] += raised
    approach.offset = 0.1
    assert approach.fly(10.0)["mode"] == APPROACH
    assert approach.out["altitude_reference"] == pytest.approx(APPROACH_ALTITUDE + raised)


def test_descent_waits_until_both_errors_were_small_for_a_while(flight: Any) -> None:
    approach = flight(landing_time=3.0, hold_time=0.5)
    approach.offset = 0.1
    approach.fly(10.0)
    approach.offset = 0.04
    assert approach.fly(0.4)["mode"] == APPROACH
    approach.offset = 0.06
    approach.fly(0.1)
    approach.offset = 0.04
    assert approach.fly(0.5)["mode"] == APPROACH
    assert approach.fly(0.01)["mode"] == DESCEND


def test_descends_at_the_limited_rate(flight: Any) -> None:
    descent = flight()
    before = descent.until(DESCEND)["altitude_reference"]
    assert before - descent.fly(1.0)["altitude_reference"] == pytest.approx(0.3)


def test_stops_sinking_while_off_centre(flight: Any) -> None:
    descent = flight()
    descent.until(DESCEND)
    descent.offset = 0.1
    held = descent.fly(0.5)["altitude_reference"]
    assert descent.fly(1.0)["altitude_reference"] == held
    assert (descent.out["mode"], descent.out["aborts"]) == (DESCEND, 0)
    descent.offset = 0.0
    assert descent.fly(0.5)["altitude_reference"] < held


def test_aborts_when_the_error_grows_and_tries_again(flight: Any) -> None:
    descent = flight()
    descent.until(DESCEND)
    descent.fly(1.0)
    descent.offset = 0.2
    out = descent.fly(0.03)
    assert (out["mode"], out["aborts"]) == (APPROACH, 1)
    assert descent.fly(2.0)["altitude_reference"] == pytest.approx(APPROACH_ALTITUDE)
    descent.offset = 0.0
    assert descent.until(DESCEND)["aborts"] == 1


@pytest.mark.parametrize("mode", [APPROACH, DESCEND])
def test_landing_can_be_called_off(flight: Any, mode: int) -> None:
    landing = flight()
    landing.until(mode)
    landing.vtol.set({"landing_enabled": False})
    assert landing.fly(0.01)["mode"] == FOLLOW
    assert landing.fly(3.0)["altitude_reference"] == 2.0


def test_a_short_contact_is_not_a_touchdown(flight: Any) -> None:
    descent = flight()
    descent.until(DESCEND)
    for contact in (True, True, False, True, True, False):
        descent.contact = contact
        assert descent.fly(0.01)["mode"] == DESCEND


def test_touchdown_resets_the_controllers_and_stops_the_motors(flight: Any) -> None:
    touchdown = flight()
    touchdown.until(DESCEND)
    touchdown.contact = True
    out = touchdown.fly(0.03)
    assert (out["mode"], out["reset"]) == (LANDED, True)
    shares = [out["motor_share"], *(touchdown.fly(0.01)["motor_share"] for _ in range(30))]
    assert shares[:-1] == pytest.approx([1 - k / 30 for k in range(1, 31)], abs=1e-12)
    assert shares[-1] == 0.0
    assert not touchdown.out["motors_on"]


def test_contact_above_the_deck_does_not_stop_the_motors(flight: Any) -> None:
    following = flight()
    following.until(FOLLOW)
    following.contact = True
    assert following.fly(1.0)["motor_share"] == 1.0


def test_stays_landed_whatever_the_deck_does(flight: Any) -> None:
    landed = flight()
    landed.until(DESCEND)
    landed.contact = True
    landed.until(LANDED)
    landed.contact, landed.offset = False, 1.0
    out = landed.fly(5.0)
    assert (out["mode"], out["motor_share"], out["aborts"]) == (LANDED, 0.0, 0)


DEFAULTS: dict[str, Any] = {
    "take_off_time": 0.0,
    "landing_enabled": True,
    "landing_time": 5.0,
    "velocity_feed_forward": True,
    "ramp_time": 0.3,
    "clearance": 0.4,
    "resting_height": 0.056,
    "approach_height": 0.675,
    "press_depth": 0.1,
    "approach_band": 0.1,
    "landing_error": 0.05,
    "abort_error": 0.15,
    "hold_time": 0.3,
    "contact_time": 0.03,
    "climb_rate": 1.0,
    "descent_rate": 0.3,
}
TIMES = {"take_off_time", "landing_time", "hold_time", "contact_time"}


def random_parameters(rng: np.random.Generator) -> dict[str, Any]:
    """Every number scaled; times stay on the grid of ticks, so that rounding decides nothing."""
    scaled = {
        n: v * float(rng.uniform(0.7, 1.4)) for n, v in DEFAULTS.items() if not isinstance(v, bool)
    }
    scaled |= {name: round(scaled[name], 2) for name in TIMES}
    return DEFAULTS | scaled | {"velocity_feed_forward": bool(rng.integers(2))}


def erratic(
    rng: np.random.Generator, k: int, altitude: float, offset: np.ndarray
) -> dict[str, Any]:
    """Inputs of tick k: a circling, heaving deck and a vehicle `offset` beside its centre, with
    flickering contact.
    """
    deck = np.array([np.cos(k / 300), np.sin(k / 300), DECK + 0.02 * np.sin(k / 40)])
    position = [*(deck[:2] + offset).tolist(), altitude]
    inputs: dict[str, Any] = dict(
        zip((f"target.position.{axis}" for axis in "xyz"), deck.tolist(), strict=True)
    )
    inputs |= dict(zip((f"vehicle.position.{axis}" for axis in "xyz"), position, strict=True))
    inputs |= {
        "vehicle.attitude.yaw": float(rng.uniform(-3, 3)),
        "yaw_command": 0.4,
        "altitude_command": 1.7,
    }
    inputs |= {"target.velocity.x": float(deck[1]), "target.velocity.y": float(-deck[0])}
    return inputs | {"vehicle.contact.vessel": bool(altitude < DECK + 0.07 and rng.uniform() < 0.8)}


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_its_restatement_on_erratic_flights(controller: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    parameters = random_parameters(rng) if seed else DEFAULTS
    vtol, reference = (
        controller("vtol", parameters if seed else {}),
        controller_reference.Vtol(parameters),
    )
    altitude, offset, seen = 0.532, np.zeros(2), [IDLE]
    for k in range(2500):
        inputs = erratic(rng, k, altitude, offset)
        found = vtol.step(inputs)
        assert found == pytest.approx(reference(inputs), rel=1e-12, abs=1e-12), f"tick {k}"
        altitude = max(found["altitude_reference"] + float(rng.normal(0, 0.01)), DECK + 0.05)
        offset = 0.97 * offset + rng.normal(0, 0.008, 2)
        if found["mode"] != seen[-1]:
            seen.append(found["mode"])
            offset += 0.2 * (found["mode"] == DESCEND and DESCEND not in seen[:-1])
    assert seen[1:5] == [TAKE_OFF, FOLLOW, APPROACH, DESCEND]
    assert (seen[-2:], found["aborts"] > 0) == ([DESCEND, LANDED], True)
