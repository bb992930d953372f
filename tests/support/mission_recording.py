"""Synthetic mission whose KPIs are known: take-off, pursuit of a vessel and landing on it."""

from dataclasses import replace

import numpy as np

from cosim.core.recording import Recording
from cosim.results import Result

REST_HEIGHT, CRUISE_HEIGHT, DESCENT_RATE = 0.325, 2.0, 0.3  # m, m, m/s
TAKE_OFF, TOUCHDOWN, STOP = 1.0, 12.0, 20.0  # s
MODES = [(0.0, 1), (1.0, 2), (3.0, 3), (6.0, 4), (9.0, 5), (12.0, 6)]  # s, mode


def mission_result(offset=(0.03, 0.04), yaw=0.0, **columns):
    """The quadcopter leaves a platform at 1 s and is on the vessel from 12 s on, `offset` (m) from
    the deck's centre.

    The vessel sails along x at 1 m/s. `columns` replaces signals, with "." in their names written
    "__".
    """
    time = np.arange(round(100 * STOP) + 1) / 100
    share = np.interp(
        time, [TAKE_OFF, 9.0], [0.0, 1.0]
    )  # of the way from the platform to the vessel
    height = np.minimum(
        np.interp(time, [TAKE_OFF, 3.0], [0.53, CRUISE_HEIGHT]),
        REST_HEIGHT + DESCENT_RATE * np.maximum(0.0, TOUCHDOWN - time),
    )
    zero, landed = np.zeros_like(time), time >= TOUCHDOWN
    signals = {
        "plant.uav.position.x": (1 - share) * -5.0 + share * (time + offset[0]),
        "plant.uav.position.y": (1 - share) * 1.0 + share * offset[1],
        "plant.uav.position.z": height,
        "plant.uav.velocity.x": np.where(landed, 1.0, 1.1),
        "plant.uav.velocity.y": zero,
        "plant.uav.velocity.z": np.where(
            (height < CRUISE_HEIGHT) & (time > 3) & ~landed, -DESCENT_RATE, 0.0
        ),
        **{f"plant.uav.attitude.{angle}": zero for angle in ("roll", "pitch", "yaw")},
        "plant.uav.contact.force": np.where(landed, 4.1, 0.0),
        "plant.uav.contact.touching": (time < TAKE_OFF) | landed,
        "plant.uav.contact.vessel": landed,
        "plant.usv.position.x": time,
        "plant.usv.position.y": zero,
        "plant.usv.attitude.roll": zero,
        "plant.usv.attitude.pitch": zero,
        "plant.usv.attitude.yaw": zero + yaw,
        **{f"plant.usv.rates.{axis}": zero for axis in "pqr"},
        "plant.usv.deck.position.x": time,
        "plant.usv.deck.position.y": zero,
        "plant.usv.deck.position.z": zero + 0.27,
        "plant.usv.deck.velocity.x": zero + 1.0,
        "plant.usv.deck.velocity.y": zero,
        "plant.usv.deck.velocity.z": zero,
        "uav.vtol.altitude_reference": np.minimum(height, CRUISE_HEIGHT) + 0.05,
        "uav.vtol.mode": np.array([_mode_at(t) for t in time], np.int32),
        **{f"uav.rotor_speed[{i}]": np.where(time < 12.3, 340.0 + i, 0.0) for i in range(1, 5)},
    }
    return with_signals(Result(Recording(time, signals, dict.fromkeys(signals, ""))), **columns)


def _mode_at(time):
    return max(mode for start, mode in MODES if start <= time)


def with_signals(result, **columns):
    """The same result with other values of some signals."""
    signals = {name.replace("__", "."): values for name, values in columns.items()}
    assert signals.keys() <= result.recording.columns.keys()
    return replace(
        result, recording=replace(result.recording, columns={**result.recording.columns, **signals})
    )
