"""Quadcopter and vessel as bodies that Bullet integrates.

Loads are constant in the world frame over a step.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..catalogue import MODELS
from ..json_reader import Numbers
from ..physics.bullet import create_compound_shape, pybullet, set_dynamics
from ..vehicles.common.shapes import principal_axes, quaternion_from_matrix
from ..vehicles.strider import parameters as strider
from ..vehicles.strider.parameters import RUDDER_ARM

#: mass of each of the two links of the published joint rig (kg); 4.31 kg move in x, 4.21 kg in y
LINK_MASS = 0.1

#: rotation between forward-right-down and forward-left-up axes
_FRD_TO_FLU = np.diag([1.0, -1.0, -1.0])

_UP = np.array([0.0, 0.0, 1.0])

_QUADCOPTER = MODELS["ar_drone"]
assert _QUADCOPTER.airframe is not None
_ROTORS = np.array([rotor.position for rotor in _QUADCOPTER.airframe.rotors])
_TORQUE_SIGNS = [rotor.torque_sign for rotor in _QUADCOPTER.airframe.rotors]
_PRINCIPAL_AXES = principal_axes(_QUADCOPTER.airframe.inertia)[1]

#: centre of mass in the body frame of the published model (m)
CENTRE_OF_MASS = np.array([-0.003329, 0.001981, -0.000577])

#: maps four thrusts (N) and four propeller torques (N m) to the torque about the centre of mass,
#: forward-left-up, (3, 8)
_TORQUE_MATRIX = np.hstack((np.cross(_ROTORS, _UP).T, np.outer(_UP, _TORQUE_SIGNS)))

#: maps the angular velocity to the velocity of the centre of mass relative to the origin of the
#: model frame, (3, 3)
_LEVER_MATRIX = np.cross(np.eye(3), CENTRE_OF_MASS).T


class Quadcopter:
    """Rigid body under rotor thrusts and propeller torques.

    Its frame in Bullet has the principal axes of inertia.

    Args:
        client: Bullet client.
        initial: Position (m, 3) of the origin of the model frame, yaw (rad), velocity (m/s, 3) and
            rates (rad/s, 3) in forward-left-up body axes.
    """

    def __init__(self, client: int, initial: Numbers):
        self._client, self._axes = client, _PRINCIPAL_AXES
        rotation = _rotation_about_z(initial[3])
        centre = np.array(initial[0:3]) + rotation @ CENTRE_OF_MASS
        yaw = pybullet.getQuaternionFromEuler([0.0, 0.0, initial[3]])
        _, orientation = pybullet.multiplyTransforms(
            [0, 0, 0], yaw, [0, 0, 0], quaternion_from_matrix(self._axes)
        )
        self.body = pybullet.createMultiBody(
            _QUADCOPTER.body.mass,
            create_compound_shape(_QUADCOPTER.body.boxes, client),
            -1,
            centre.tolist(),
            orientation,
            physicsClientId=client,
        )
        set_dynamics(client, self.body, -1, body=_QUADCOPTER.body)
        linear, angular = (
            rotation @ (initial[4:7] + _LEVER_MATRIX @ initial[7:10]),
            rotation @ initial[7:10],
        )
        pybullet.resetBaseVelocity(
            self.body, linear.tolist(), angular.tolist(), physicsClientId=client
        )

    def apply(self, loads: np.ndarray) -> None:
        """Apply four thrusts (N) and propeller torques (N m) in the next step of Bullet.

        They are fixed in the world frame.
        """
        centre, to_world = self._pose()
        force, torque = to_world[:, 2] * loads[0:4].sum(), to_world @ (_TORQUE_MATRIX @ loads)
        options = {"flags": pybullet.WORLD_FRAME, "physicsClientId": self._client}
        pybullet.applyExternalForce(self.body, -1, force.tolist(), centre.tolist(), **options)
        pybullet.applyExternalTorque(self.body, -1, torque.tolist(), **options)

    def measure(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the published quantities.

        Returns:
            Position (m), attitude phi, theta, psi (rad) and velocity (m/s), shape (9,); and R v +
            position, shape (3,), whose difference quotient was published as acceleration.
        """
        centre, to_world = self._pose()
        linear, angular = pybullet.getBaseVelocity(self.body, self._client)
        position, from_original = centre - to_world @ CENTRE_OF_MASS, to_world @ _FRD_TO_FLU
        velocity = linear - to_world @ (_LEVER_MATRIX @ (to_world.T @ angular))
        return np.concatenate(
            (position, attitude(from_original), velocity)
        ), from_original @ velocity + position

    def _pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the centre of mass (m) and the rotation from the body frame to the world.

        The body frame is forward-left-up.
        """
        centre, orientation = pybullet.getBasePositionAndOrientation(self.body, self._client)
        principal = np.array(pybullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        return np.array(centre), principal @ self._axes.T


class Vessel:
    """Hull on prismatic joints along x and y and a revolute joint about z.

    Args:
        client: Bullet client.
        initial: x, y (m), yaw (rad), surge and sway velocity (m/s), yaw rate (rad/s).
    """

    _JOINTS = (0, 1, 2)

    def __init__(self, client: int, initial: Numbers):
        self._client, self.body = client, _create_jointed_hull(client)
        velocity = (_rotation_about_z(initial[2])[:2, :2] @ np.array(initial[3:5])).tolist()
        for joint, rate in zip(self._JOINTS, (*velocity, initial[5]), strict=True):
            pybullet.setJointMotorControl2(
                self.body, joint, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client
            )
            pybullet.resetJointState(self.body, joint, initial[joint], rate, physicsClientId=client)
            pybullet.changeDynamics(self.body, joint, jointDamping=0, physicsClientId=client)
        for link in (-1, 0, 1):
            set_dynamics(client, self.body, link)
        set_dynamics(client, self.body, 2, body=strider.BODY)

    def apply(self, loads: np.ndarray) -> None:
        """Apply propeller thrust, rudder X, Y, water X, Y (N) and N (N m) in the next step."""
        thrust, rudder_x, rudder_y, water_x, water_y, moment = loads
        yaw = self._joints()[0][2]
        force = _rotation_about_z(yaw)[:2, :2] @ [thrust + rudder_x + water_x, rudder_y + water_y]
        efforts = [*force.tolist(), float(moment - RUDDER_ARM * rudder_y)]
        pybullet.setJointMotorControlArray(
            self.body,
            self._JOINTS,
            pybullet.TORQUE_CONTROL,
            forces=efforts,
            physicsClientId=self._client,
        )

    def measure(self) -> np.ndarray:
        """Return position, velocity, angular velocity and yaw as published, shape (10,).

        The units are m, m/s, rad/s and rad.
        """
        (x, y, yaw), (vx, vy, rate) = self._joints()
        wrapped = math.pi - (math.pi - yaw) % (2 * math.pi)
        return np.array([x, y, strider.BODY.height, vx, vy, 0.0, 0.0, 0.0, rate, wrapped])

    def _joints(self) -> tuple[Sequence[float], Sequence[float]]:
        states = pybullet.getJointStates(self.body, self._JOINTS, self._client)
        return [state[0] for state in states], [state[1] for state in states]


def _create_jointed_hull(client: int) -> int:
    """Create the hull on its three joints and return its body number."""
    hull, origin, upright = strider.BODY, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
    body: int = pybullet.createMultiBody(
        0,
        -1,
        -1,
        [0.0, 0.0, hull.height],
        upright,
        linkMasses=[LINK_MASS, LINK_MASS, hull.mass],
        linkCollisionShapeIndices=[-1, -1, create_compound_shape(hull.boxes, client)],
        linkVisualShapeIndices=[-1] * 3,
        linkPositions=[origin] * 3,
        linkOrientations=[upright] * 3,
        linkInertialFramePositions=[origin] * 3,
        linkInertialFrameOrientations=[upright] * 3,
        linkParentIndices=[0, 1, 2],
        linkJointTypes=[
            pybullet.JOINT_PRISMATIC,
            pybullet.JOINT_PRISMATIC,
            pybullet.JOINT_REVOLUTE,
        ],
        linkJointAxis=[[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        physicsClientId=client,
    )
    return body


def attitude(to_world: np.ndarray) -> np.ndarray:
    """Return phi, theta, psi (rad) of a rotation matrix (3, 3), body to world.

    The body frame is forward-right-down.
    """
    r = to_world
    theta = math.asin(max(-1.0, min(1.0, r[2, 0])))
    return np.array([math.atan2(-r[2, 1], -r[2, 2]), theta, math.atan2(-r[1, 0], r[0, 0])])


def _rotation_about_z(angle: float) -> np.ndarray:
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
