"""Import from URDF: a quadcopter of links and joints becomes a vehicle file that flies."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from scipy.spatial.transform import Rotation
from world_harness import WorldHarness

from cosim.cli.commands.new_vehicle import vehicle as command
from cosim.core.errors import InputError
from plant_src.catalogue import model_from_data
from plant_src.vehicle_files.urdf import vehicle_from_urdf

ARM = 0.2
ANGLES = {"front_left": 45, "rear_left": 135, "rear_right": 225, "front_right": 315}
#: the example of the documentation
PAGE = Path(__file__).parents[3] / "plant_src/vehicles/data/README.md"
(EXAMPLE,) = re.findall(
    r'^```json\n(\{"family": "multirotor".*?)^```$', PAGE.read_text(), re.MULTILINE | re.DOTALL
)
DATA: dict[str, Any] = json.loads(EXAMPLE)
BODY = """<link name="base"><inertial><origin xyz="0 0 0.02" rpy="0 0 0.5"/><mass value="0.8"/>
  <inertia ixx="0.004" iyy="0.005" izz="0.008" ixy="0.0002" ixz="0" iyz="0"/></inertial>
  <collision><origin rpy="0 0 0.3"/><geometry><box size="0.2 0.1 0.06"/></geometry></collision>\
</link>"""


def robot(body: str = BODY, shape: str = '<cylinder radius="0.01" length="0.04"/>') -> str:
    """A quadcopter: four motors of 50 g at the ends of the arms, tilted by 0.1 rad about their
    radius.
    """
    parts = [body]
    for name, angle in ANGLES.items():
        x, y = ARM * np.cos(np.deg2rad(angle)), ARM * np.sin(np.deg2rad(angle))
        parts.append(
            f'<joint name="to_{name}" type="fixed"><parent link="base"/><child link="{name}"/>'
            f'<origin xyz="{x} {y} 0.03" rpy="0.1 0 {np.deg2rad(angle)}"/></joint>'
            f'<link name="{name}"><inertial><mass value="0.05"/><inertia ixx="1e-6" iyy="2e-6" '
            'izz="3e-6"/></inertial>'
            f"<collision><geometry>{shape}</geometry></collision></link>"
        )
    return f'<robot name="quad">{"".join(parts)}</robot>'


def imported(folder: Path, text: str, data: dict[str, Any] = DATA) -> dict[str, Any]:
    (file := folder / "quad.urdf").write_text(text)
    return vehicle_from_urdf(file, data).data


def test_mass_and_inertia_are_those_of_all_links(tmp_path: Path) -> None:
    data = imported(tmp_path, robot())
    centre = np.array([0, 0, (0.8 * 0.02 + 4 * 0.05 * 0.03) / 1.0])
    turn = Rotation.from_euler("z", 0.5).as_matrix()
    expected = turn @ [[0.004, 0.0002, 0], [0.0002, 0.005, 0], [0, 0, 0.008]] @ turn.T
    arm = np.array([0, 0, 0.02]) - centre
    expected = expected + 0.8 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    for angle in ANGLES.values():
        turn = Rotation.from_euler("xyz", [0.1, 0, np.deg2rad(angle)]).as_matrix()
        arm = (
            np.array([ARM * np.cos(np.deg2rad(angle)), ARM * np.sin(np.deg2rad(angle)), 0.03])
            - centre
        )
        expected = (
            expected
            + turn @ np.diag([1e-6, 2e-6, 3e-6]) @ turn.T
            + 0.05 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        )
    assert data["mass"]["value"] == pytest.approx(1.0, rel=1e-15)
    assert np.array(data["inertia"]["value"]) == pytest.approx(expected, rel=1e-12, abs=1e-15)


def test_a_mass_of_the_accompanying_file_does_not_scale_the_inertia(tmp_path: Path) -> None:
    data = imported(tmp_path, robot(), {**DATA, "mass": 2.0})
    assert data["mass"] == 2.0
    assert data["inertia"] == imported(tmp_path, robot())["inertia"]


def test_rotors_are_at_their_links_relative_to_the_centre_of_mass(tmp_path: Path) -> None:
    model = model_from_data(imported(tmp_path, robot()), "quad")
    assert model.airframe is not None
    first = model.airframe.rotors[0]
    assert first.position == pytest.approx((ARM * np.sqrt(0.5), ARM * np.sqrt(0.5), 0.03 - 0.022))
    assert first.axis == pytest.approx(
        Rotation.from_euler("xyz", [0.1, 0, np.pi / 4]).as_matrix()[:, 2]
    )
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
    ("<robot", "cannot be read as XML"),
    ("<xml/>", ":1: found <xml>, expected <robot>"),
    (
        "<robot>\n<xacro:include/></robot>",
        ":2: found <xacro:include>; expand the file with xacro first",
    ),
    (
        robot(shape='<capsule radius="1"/>'),
        ':3: link "front_left", capsule: found the geometry capsule, expected box',
    ),
    (
        robot(shape='<mesh filename="arm.stl"/>'),
        ':3: link "front_left", mesh: .*arm.stl: the file does not exist',
    ),
    (
        robot(shape='<sphere radius="0"/>'),
        ':3: link "front_left", sphere: found the edges .* expected all greater than 0',
    ),
    (
        robot(BODY.replace('<mass value="0.8"/>', "")),
        ':1: link "base", inertial: <mass> is missing',
    ),
    (
        robot(BODY.replace('value="0.8"', 'value="0,8"')),
        ":1: link \"base\", mass: found '0,8', expected a number$",
    ),
    (
        robot(BODY.replace('value="0.8"', 'value="${m}"')),
        r"mass: found '\${m}', expected a number; expand it with xacro first",
    ),
    (
        robot(BODY.replace('value="0.8"', 'value="-0.8"')),
        ':1: link "base", mass: found -0.8, expected at least 0',
    ),
    (robot(BODY.replace('iyy="0.005"', "")), ':2: link "base", inertia: "iyy" is missing'),
    (
        robot(BODY.replace('izz="0.008"', 'izz="0.08"')),
        r'"base", inertia: found .* about \[0.98, -0.19, 0\], .* 0.08 about z',
    ),
    (
        robot().replace('<link name="rear_left">', '<link name="front_left">'),
        '"front_left": the name is used twice, first in line 3',
    ),
    (
        robot().replace('name="to_rear_left"', 'name="to_front_left"'),
        'joint "to_front_left": the name is used twice',
    ),
    (
        robot().replace('"base"/><child link="rear_left"', '"bas"/><child link="rear_left"'),
        'no link "bas"; did you mean "base"',
    ),
    (
        robot().replace('<child link="rear_left"', '<child link="front_left"'),
        'is the child of the joint "to_front_left" too',
    ),
    (
        "<robot name='x'><link name='a'/><link name='b'/></robot>",
        r"found the root links \['a', 'b'\], expected one",
    ),
    ("<robot name='x'><link name='a'/></robot>", "found the mass 0"),
]


@pytest.mark.parametrize(("text", "message"), FAULTS)
def test_a_fault_names_file_line_and_link(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=f"quad.urdf.*{message}"):
        imported(tmp_path, text)


def test_a_mesh_of_another_format_is_refused(tmp_path: Path) -> None:
    (tmp_path / "arm.dae").touch()
    with pytest.raises(
        InputError,
        match=r'link "front_left", mesh: .* the format ".dae" is not read; .* STL, OBJ, GLB, PLY',
    ):
        imported(tmp_path, robot(shape='<mesh filename="arm.dae"/>'))


def test_a_link_without_mass_is_a_warning(tmp_path: Path) -> None:
    (file := tmp_path / "quad.urdf").write_text(
        robot(re.sub("<inertial>.*</inertial>", "", BODY, flags=re.DOTALL))
    )
    assert vehicle_from_urdf(file, DATA).warnings == [
        f'{file}:1: link "base" has a shape but no <inertial>: its mass is 0'
    ]


def test_angles_in_degrees_are_a_warning(tmp_path: Path) -> None:
    """The joints of three motors have yaw angles of more than a turn if they are written in
    degrees.
    """
    text = robot().replace(f'rpy="0.1 0 {np.pi / 4}"', 'rpy="0 0 6.2"')
    for angle in (135, 225, 315):
        text = text.replace(f'rpy="0.1 0 {np.deg2rad(angle)}"', f'rpy="0 0 {angle}"')
    (file := tmp_path / "quad.urdf").write_text(text)
    expected = (
        'joint "to_rear_left", origin: rpy: found 0 0 135, radians expected; in degrees? A right '
        "angle is 1.5708"
    )
    assert vehicle_from_urdf(file, DATA).warnings == [f"{file}:3: {expected} (2 more such origins)"]


def test_a_link_without_visual_is_drawn_as_it_collides(tmp_path: Path) -> None:
    """The base has a visual shape, the motors have only cylinders that collide; without any visual
    shape the boxes are drawn.
    """
    assert "visual" not in imported(tmp_path, robot())
    visual = "<visual><geometry><box size='0.1 0.1 0.02'/></geometry></visual><collision>"
    mesh = imported(tmp_path, robot(BODY.replace("<collision>", visual)))["visual"]
    x, y, _ = np.array(mesh["vertices"]).T
    assert np.hypot(x, y).max() == pytest.approx(ARM + 0.01, abs=1e-3)


def test_primitive_visual_shapes_are_drawn(tmp_path: Path) -> None:
    """The volume inside the triangles (divergence theorem) is that of the shape: its faces point
    outwards.
    """
    shapes = '<box size="1 2 3"/>', '<cylinder radius="0.5" length="2"/>', '<sphere radius="0.5"/>'
    exact = 6.0, np.pi / 2, np.pi / 6
    for shape, volume in zip(shapes, exact, strict=True):
        visual = f"<visual><origin xyz='0 0 7'/><geometry>{shape}</geometry></visual>"
        shapeless = re.sub(
            "<collision>.*?</collision>",
            "",
            robot(BODY.replace("<collision>", f"{visual}<collision>")),
        )
        mesh = imported(tmp_path, shapeless, {**DATA, "boxes": [{"size": [0.1, 0.1, 0.1]}]})[
            "visual"
        ]
        a, b, c = np.moveaxis(np.array(mesh["vertices"])[np.array(mesh["faces"])], 1, 0)
        assert np.einsum("ij,ij", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=0.04)
        assert np.mean(mesh["vertices"], axis=0) == pytest.approx([0, 0, 7 - 0.022], abs=1e-6)


LINK_FAULTS: list[tuple[dict[str, Any], str]] = [
    ({"link": "rear_lft"}, r'rotors\[1\].link: no link "rear_lft"; did you mean "rear_left"'),
    ({"link": "front_left"}, r'rotors\[1\].link: found the link "front_left" of rotors\[0\] again'),
    (
        {"position": [0, 0, 0]},
        r'rotors\[1\].position: found "link" and "position", expected one of them',
    ),
]


@pytest.mark.parametrize(("change", "message"), LINK_FAULTS)
def test_a_fault_of_a_rotor_names_the_accompanying_file(
    tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    data = json.loads(EXAMPLE)
    data["rotors"][1] |= change
    outcome = new_vehicle(tmp_path, robot(), data)
    assert re.search(rf"parts.json:1:\d+: \$.{message}", str(outcome.exception))
    assert not (tmp_path / "my_quad.json").exists()


def test_what_a_scenario_refuses_is_not_written(tmp_path: Path) -> None:
    """Links without --urdf, a missing family, rotors that push downwards."""
    (tmp_path / "parts.json").write_text(EXAMPLE)
    arguments = ["my_quad", "--from", str(tmp_path / "parts.json"), "--directory", str(tmp_path)]
    outcome = CliRunner().invoke(command, arguments)
    assert (
        "rotors[0].link: found the link 'front_left': `cosim new vehicle --urdf FILE` replaces it"
        in str(outcome.exception)
    )
    outcome = new_vehicle(
        tmp_path, robot(), {key: value for key, value in DATA.items() if key != "family"}
    )
    assert 'parts.json:1:1: $.family: "family" is missing, expected one of: multirotor' in str(
        outcome.exception
    )
    outcome = new_vehicle(tmp_path, robot().replace('rpy="0.1 ', 'rpy="3.1 '), DATA)
    assert "it cannot fly: the thrust of all rotors at full speed is -32.37 N" in str(
        outcome.exception
    )
    assert not (tmp_path / "my_quad.json").exists()


def new_vehicle(folder: Path, text: str, data: dict[str, Any]) -> Result:
    """Run `cosim new vehicle my_quad --from parts.json --urdf quad.urdf`."""
    (folder / "quad.urdf").write_text(text)
    (folder / "parts.json").write_text(json.dumps(data))
    arguments = [
        "my_quad",
        "--from",
        str(folder / "parts.json"),
        "--urdf",
        str(folder / "quad.urdf"),
    ]
    return CliRunner().invoke(command, [*arguments, "--directory", str(folder)])


def test_the_command_writes_the_vehicle_file(tmp_path: Path) -> None:
    outcome = new_vehicle(tmp_path, robot(), DATA)
    assert outcome.exit_code == 0, outcome.output
    assert "my_quad.json: mass 1 kg, inertia [[0.0" in outcome.output
    assert "] kg.m2, centre of mass [0, 0, 0.022] m in quad.urdf" in outcome.output
    assert (
        '    "rotor_x": [0.141421, -0.141421, -0.141421, 0.141421, 0, 0, 0, 0],\n' in outcome.output
    )
    written = json.loads((tmp_path / "my_quad.json").read_text())
    assert model_from_data(written, "my_quad").body.mass == pytest.approx(1.0)
