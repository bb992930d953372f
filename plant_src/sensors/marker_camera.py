"""Camera that measures the pose of a fiducial marker on a landing deck relative to the vehicle.

Camera axes: x to the right of the picture, y down, z along the view. A camera with tilt 0 looks
straight down, the nose of the vehicle at the top of the picture; with tilt pi/2 it looks ahead.
"""

import math
from collections.abc import Sequence

from cosim.core.component import Variable

from .counter_based_noise import normal_to_uniform
from .rotations import (
    Quaternion,
    Vector,
    add_scaled,
    difference,
    euler_angles,
    inverse_quaternion,
    quaternion_product,
    to_body,
    to_world,
)
from .signal_component import Measurement, SampledSensor, timing_variables
from .variable_declarations import (
    EULER_ANGLES,
    array_parameter,
    boolean_variable,
    pose_inputs,
    real_parameter,
    seed_parameter,
    share_parameter,
    vector_variables,
)

#: quaternion of a camera that looks straight down: half a turn about the axis between forward and
#: right
_DOWNWARD_ATTITUDE = (0.0, math.sqrt(0.5), -math.sqrt(0.5), 0.0)

#: inputs by quantity
_VEHICLE_ORIENTATION, _DECK_POSITION, _DECK_ORIENTATION = slice(3, 7), slice(7, 10), slice(10, 14)


class MarkerCamera(SampledSensor):
    """Marker camera whose visibility follows from pinhole geometry.

    The marker is a square with the edge `marker_size` (m) in the middle of the deck. A sample is
    valid under these conditions:

    - all four corners are in the picture (`width` by `height` pixels, pinhole of `focal_length`
      pixels)
    - the marker is seen from above, at most `incidence` (rad) from its normal
    - its edge appears at least `smallest` pixels long
    - no random drop-out occurs (probability `drop_out` per picture)

    Otherwise `valid` is false and the outputs keep the last pose. Occlusion of the marker is not
    modelled.

    Error model by first-order error propagation (linearised pinhole projection): for corners with
    the standard deviation s (`pixel_noise`), focal length f, marker size m and depth z, the
    standard deviations are s z / f across the view, s z^2 / (f m) along it, s z / (f m) in yaw and
    `tilt_ratio` times that in roll and pitch. Default values: downward camera of an AR.Drone (320
    by 240 pixels, 64 degrees across the diagonal); rate, latency and drop-outs are typical of ArUco
    markers on small computers.

    Inputs: `vehicle` and `deck`, each with `position` (m, world) and `orientation` (unit
    quaternion, body to world); connect `deck.position` to "plant.usv.deck.position" and
    `deck.orientation` to "plant.usv.orientation". Outputs: `position.x|y|z` (m, body axes, from the
    vehicle's centre of mass to the deck centre), `attitude.roll|pitch|yaw` (rad, ZYX, of the deck
    relative to the vehicle), `time` of the picture (s), `valid`. The camera is at `mounting` (m,
    body axes), tilted by `tilt` (rad) from straight down to ahead.

    Args:
        instance_name: Name of the component.
        seed: Seed of all random numbers, together with the name of the component.

    Raises:
        InputError: `seed` is not an integer of at least 0.
    """

    random_number_count = 7

    def __init__(self, instance_name: str, seed: int = 0):
        super().__init__(
            instance_name,
            [
                *pose_inputs("vehicle"),
                *pose_inputs("deck"),
                real_parameter("marker_size", "m", 0.4, "edge of the marker", 1e-3),
                real_parameter("focal_length", "1", 320.0, "pixels", 1.0),
                real_parameter("width", "1", 320.0, "pixels of a picture from left to right", 1.0),
                real_parameter("height", "1", 240.0, "pixels of a picture from top to bottom", 1.0),
                real_parameter(
                    "smallest",
                    "1",
                    12.0,
                    "pixels along an edge of the marker that can still be read",
                ),
                real_parameter(
                    "incidence",
                    "rad",
                    1.2,
                    "largest angle between view and normal of the marker",
                    0.0,
                    math.pi / 2,
                ),
                share_parameter(
                    "drop_out", 0.02, "share of pictures in which the marker is overlooked"
                ),
                real_parameter("pixel_noise", "1", 0.3, "standard deviation of a corner, pixels"),
                real_parameter(
                    "tilt_ratio", "1", 3.0, "how much worse roll and pitch are seen than yaw"
                ),
                *mounting_parameters(),
                seed_parameter(seed),
                *vector_variables(
                    "position", "xyz", "m", "output", "centre of the deck, body axes"
                ),
                *vector_variables("attitude", EULER_ANGLES, "rad", "output"),
                *timing_variables(30.0, 0.05),
                boolean_variable("valid", "output", "the marker was found"),
            ],
        )

    def apply_parameters(self) -> None:
        """Update the attitude of the camera from the parameter `tilt`."""
        self._camera = camera_attitude(self.parameters["tilt"])

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Return the pose of the deck, or no values if the marker is not found.

        See `SampledSensor.measure`.
        """
        row, attitude = self.noise[number], self.inputs[_VEHICLE_ORIENTATION]
        eye = add_scaled(self.inputs, 1.0, to_world(attitude, self.parameters["mounting"]))
        camera = quaternion_product(attitude, self._camera)
        overlooked = normal_to_uniform(row[6]) < self.parameters["drop_out"]
        if overlooked or not self._marker_visible(eye, camera):
            return (), (False,)
        deck = to_camera_axes(eye, camera, self.inputs[_DECK_POSITION])
        return (*self._position(deck, row), *self._attitude(deck[2], row[3:])), (True,)

    def _marker_visible(self, eye: Vector, camera: Sequence[float]) -> bool:
        """Return True if a camera at `eye` (m, world) with this attitude finds the marker."""
        p, deck = self.parameters, self.inputs[_DECK_POSITION]
        attitude = self.inputs[_DECK_ORIENTATION]
        x, y, z = to_body(attitude, difference(eye, deck))
        if z <= 0 or z < math.cos(p["incidence"]) * math.sqrt(x * x + y * y + z * z):
            return False
        half = p["marker_size"] / 2
        for side in ((half, half), (half, -half), (-half, -half), (-half, half)):
            place = add_scaled(deck, 1.0, to_world(attitude, (*side, 0.0)))
            corner = to_camera_axes(eye, camera, place)
            if corner[2] <= 0:
                return False
            right, down = project(corner, p["focal_length"])
            if not (abs(right) <= p["width"] / 2 and abs(down) <= p["height"] / 2):
                return False
        depth = to_camera_axes(eye, camera, deck)[2]
        return bool(p["focal_length"] * p["marker_size"] >= p["smallest"] * depth)

    def _position(self, deck: Vector, row: Sequence[float]) -> Vector:
        """Return the measured position (m, body axes) from the true one in camera axes."""
        p, (x, y, z) = self.parameters, deck
        across = p["pixel_noise"] * z / p["focal_length"]
        along = across * z / p["marker_size"]
        measured = (x + across * row[0], y + across * row[1], z + along * row[2])
        return add_scaled(to_world(self._camera, measured), 1.0, p["mounting"])

    def _attitude(self, depth: float, row: Sequence[float]) -> Vector:
        """Return the measured roll, pitch and yaw (rad) of the deck relative to the vehicle."""
        p = self.parameters
        sigma = p["pixel_noise"] * depth / (p["focal_length"] * p["marker_size"])
        to_vehicle = inverse_quaternion(self.inputs[_VEHICLE_ORIENTATION])
        relative = quaternion_product(to_vehicle, self.inputs[_DECK_ORIENTATION])
        roll, pitch, yaw = euler_angles(relative)
        tilted = p["tilt_ratio"] * sigma
        return roll + tilted * row[0], pitch + tilted * row[1], yaw + sigma * row[2]


def mounting_parameters() -> list[Variable]:
    """Declare the parameters `tilt` (rad) and `mounting` (m, body axes) of a camera."""
    return [
        real_parameter(
            "tilt", "rad", 0.0, "of the camera, from straight down to ahead", -math.pi, math.pi
        ),
        array_parameter("mounting", "m", (0.0, 0.0, 0.0), "place of the camera, body axes"),
    ]


def camera_attitude(tilt: float) -> Quaternion:
    """Return the quaternion from camera axes to body axes for a tilt (rad)."""
    return quaternion_product(
        (math.cos(tilt / 2), 0.0, -math.sin(tilt / 2), 0.0), _DOWNWARD_ATTITUDE
    )


def to_camera_axes(
    eye: Sequence[float], attitude: Sequence[float], point: Sequence[float]
) -> Vector:
    """Transform a point (m, world) to the axes of a camera.

    Args:
        eye: Position of the camera (m, world).
        attitude: Unit quaternion from camera axes to world axes.
        point: Position of the point (m, world).

    Returns:
        Position of the point relative to the camera (m, camera axes).
    """
    return to_body(attitude, difference(point, eye))


def project(point: Sequence[float], focal_length: float) -> tuple[float, float]:
    """Return the image of a point in camera axes.

    Pixels to the right of and below the centre of the picture.
    """
    return focal_length * point[0] / point[2], focal_length * point[1] / point[2]
