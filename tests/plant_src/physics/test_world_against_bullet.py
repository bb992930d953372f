"""The world against plain Bullet, which integrates the forces of the reference equations itself."""

from __future__ import annotations

import numpy as np
import original_system_reference as reference
import pybullet
import pytest
from world_harness import PLATFORM, PLATFORM_TOP, REST_HEIGHT, WorldHarness, quadcopter_settings

SUB_STEPS = 40


def plain_drop(height: float, duration: float) -> float:
    """Height of the quadcopter's box after a drop on the platform, by Bullet with gravity and steps
    of 0.25 ms.
    """
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setPhysicsEngineParameter(fixedTimeStep=0.01 / SUB_STEPS, physicsClientId=client)
    pybullet.setGravity(0, 0, -reference.GRAVITY, physicsClientId=client)
    for mass, half, centre in (
        (0, np.array(PLATFORM["size"]) / 2, PLATFORM["position"]),
        (0.4439, [0.114, 0.114, 0.0433], [0, 0, height]),
    ):
        box = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=list(half), physicsClientId=client
        )
        body = pybullet.createMultiBody(mass, box, -1, list(centre), physicsClientId=client)
        pybullet.changeDynamics(
            body, -1, linearDamping=0, angularDamping=0, lateralFriction=1, physicsClientId=client
        )
    for _ in range(round(duration / 0.01) * SUB_STEPS):
        pybullet.stepSimulation(client)
    position, _ = pybullet.getBasePositionAndOrientation(body, client)
    pybullet.disconnect(client)
    return position[2]


@pytest.mark.parametrize("duration", [0.2, 1.0])
def test_a_drop_agrees_with_plain_bullet(duration: float) -> None:
    """In the air and at rest; the centre of the box lies 0.0433 m above the feet, the centre of
    mass 0.056 m.
    """
    drop = 0.2
    trial = WorldHarness(
        {"uav": quadcopter_settings([0.0, 0.0, PLATFORM_TOP + REST_HEIGHT + drop])},
        {"start": PLATFORM},
    ).step(round(duration / 0.01))
    plain = plain_drop(PLATFORM_TOP + 0.0433 + drop, duration)
    assert trial["uav.position.z"] - REST_HEIGHT == pytest.approx(plain - 0.0433, abs=1e-3)
