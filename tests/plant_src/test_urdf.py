"""Import from URDF: a quadcopter of links and joints becomes a vehicle file that flies."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation
from world_harness import WorldHarness

from cosim.cli.commands.new_vehicle import command
from cosim.core.errors import InputError
from plant_src.catalogue import model_from_data
from plant_src.urdf import vehicle_from_urdf

ARM = 0.2
ANGLES = {"front_left": 45, "rear_left": 135, "rear_right": 225, "front_right": 315}
#: the example of the documentation
PAGE = Path(__file__).parents[2] / "plant_src/vehicles/data/README.md"
(EXAMPLE,) = re.findall(r'^```json\n(\{"family": "multirotor".*?)^```$', PAGE.read_text(), re.MULTILINE | re.DOTALL)
DATA: dict[str, Any] = json.loads(EXAMPLE)
BODY = """<link name="base"><inertial><origin xyz="0 0 0.02" rpy="0 0 0.5"/><mass value="0.8"/>
  <inertia ixx="0.004" iyy="0.005" izz="0.008" ixy="0.0002" ixz="0" iyz="0"/></inertial>
  <collision><origin rpy="0 0 0.3"/><geometry><box size="0.2 0.1 0.06"/></geometry></collision></link>"""


def robot(body: str = BODY, shape: str = '<cylinder radius="0.01" length="0.04"/>') -> str:
    """A quadcopter: four motors of 50 g at the ends of the arms, tilted by 0.1 rad about their radius."""
    parts = [body]
    for name, angle in ANGLES.items():
        x, y = ARM * np.cos(np.deg2rad(angle)), ARM * np.sin(np.deg2rad(angle))
        parts.append(
            f'<joint name="to_{name}" type="fixed"><parent link="base"/><child link="{name}"/>'
            f'<origin xyz="{x} {y} 0.03" rpy="0.1 0 {np.deg2rad(angle)}"/></joint>'
            f'<link name="{name}"><inertial><mass value="0.05"/><inertia ixx="1e-6" iyy="2e-6" izz="3e-6"/></inertial>'
            f"<collision><geometry>{shape}</geometry></collision></link>"
        )
    return f'<robot name="quad">{"".join(parts)}</robot>'


def imported(folder: Path, text: str, data: dict[str, Any] = DATA) -> dict[str, Any]:
    (file := folder / "quad.urdf").write_text(text)
    return vehicle_from_urdf(file, data)


def test_mass_and_inertia_are_those_of_all_links(tmp_path: Path) -> None:
    data = imported(tmp_path, robot())
    centre = np.array([0, 0, (0.8 * 0.02 + 4 * 0.05 * 0.03) / 1.0])
    turn = Rotation.from_euler("z", 0.5).as_matrix()
    expected = turn @ [[0.004, 0.0002, 0], [0.0002, 0.005, 0], [0, 0, 0.008]] @ turn.T
    arm = np.array([0, 0, 0.02]) - centre
    expected = expected + 0.8 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    for angle in ANGLES.values():
        turn = Rotation.from_euler("xyz", [0.1, 0, np.deg2rad(angle)]).as_matrix()
        arm = np.array([ARM * np.cos(np.deg2rad(angle)), ARM * np.sin(np.deg2rad(angle)), 0.03]) - centre
        expected = expected + turn @ np.diag([1e-6, 2e-6, 3e-6]) @ turn.T + 0.05 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    assert data["mass"]["value"] == pytest.approx(1.0, rel=1e-15)
    assert np.array(data["inertia"]["value"]) == pytest.approx(expected, rel=1e-12, abs=1e-15)


def test_rotors_are_at_their_links_relative_to_the_centre_of_mass(tmp_path: Path) -> None:
    model = model_from_data(imported(tmp_path, robot()), "quad")
    assert model.airframe is not None
    first = model.airframe.rotors[0]
    assert first.position == pytest.approx((ARM * np.sqrt(0.5), ARM * np.sqrt(0.5), 0.03 - 0.022))
    assert first.axis == pytest.approx(Rotation.from_euler("xyz", [0.1, 0, np.pi / 4]).as_matrix()[:, 2])
    assert first.label == "front_left"


def test_collision_shapes_become_boxes(tmp_path: Path) -> None:
    boxes = imported(tmp_path, robot())["boxes"]
    assert len(boxes) == 5
    assert boxes[0]["size"] == [0.2, 0.1, 0.06]
    assert boxes[0]["yaw"] == pytest.approx(0.3)
    height = 0.04 * np.cos(0.1) + 0.02 * np.sin(0.1)  # of the level box around the tilted cylinder
    assert boxes[1]["size"][2] == pytest.approx(height)


def test_the_vehicle_hovers(tmp_path: Path) -> None:
    data = json.loads(json.dumps(imported(tmp_path, robot())))
    trial = WorldHarness({"uav": {"model": data, "position": [0, 0, 5]}})
    trial["uav.rotor_speed"] = [float(np.sqrt(9.81 / (4 * 1e-5 * np.cos(0.1))))] * 4
    trial.step(100)
    assert trial["uav.position.z"] == pytest.approx(5.0, abs=1e-3)


FAULTS = [
    ("<robot", "cannot be read"),
    (robot(shape='<capsule radius="1"/>'), 'link "front_left": found the collision geometry capsule, expected box'),
    (robot(BODY.replace('<mass value="0.8"/>', "")), 'link "base": <inertial> needs <mass>'),
    (
        robot().replace('<parent link="base"/><child link="rear_left"/>', '<parent link="x"/><child link="rear_left"/>'),
        "no joints connect",
    ),
    ("<robot name='x'><link name='a'/><link name='b'/></robot>", r"found the root links \['a', 'b'\], expected one"),
    ("<robot name='x'><link name='a'/></robot>", "found the mass 0"),
]


@pytest.mark.parametrize(("text", "message"), FAULTS)
def test_what_is_no_rigid_body_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        imported(tmp_path, text)


def test_an_unknown_link_is_refused_with_the_nearest_name(tmp_path: Path) -> None:
    data = {**DATA, "rotors": [{"link": "front_lft", "turns": "clockwise"}]}
    with pytest.raises(InputError, match='rotors: no link "front_lft"; did you mean "front_left"'):
        imported(tmp_path, robot(), data)


def test_the_command_writes_the_vehicle_file(tmp_path: Path) -> None:
    (tmp_path / "quad.urdf").write_text(robot())
    (tmp_path / "parts.json").write_text(json.dumps(DATA))
    arguments = ["my_quad", "--from", str(tmp_path / "parts.json"), "--urdf", str(tmp_path / "quad.urdf")]
    outcome = CliRunner().invoke(command, [*arguments, "--directory", str(tmp_path)])
    assert outcome.exit_code == 0, outcome.output
    written = json.loads((tmp_path / "my_quad.json").read_text())
    assert model_from_data(written, "my_quad").body.mass == pytest.approx(1.0)
