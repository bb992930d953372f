"""Import of meshes: mass properties, convex pieces that collide, triangles that are shown."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from world_harness import WorldHarness

from cosim.cli.commands.new_vehicle import vehicle as command
from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.catalogue import model_from_data
from plant_src.scene.parts import vehicle_parts
from plant_src.vehicle_files import mesh_import
from plant_src.vehicle_files.mesh_import import vehicle_from_mesh
from plant_src.vehicle_files.urdf import vehicle_from_urdf
from plant_src.vehicles.common.shapes import MAX_POINTS

trimesh = pytest.importorskip("trimesh")

QUADCOPTER = json.loads((resources.root() / "plant_src/vehicles/data/x500.json").read_text())
OTTER = json.loads((resources.root() / "plant_src/vehicles/otter/otter.json").read_text())


def without(data: dict[str, Any], *keys: str) -> dict[str, Any]:
    return {key: value for key, value in copy.deepcopy(data).items() if key not in keys}


def catamaran(folder: Path, suffix: str, scale: float = 1.0) -> Path:
    """Two pontoons of 2 x 0.25 x 0.345 m with a deck that touches neither."""
    pontoons = [
        trimesh.creation.box(
            (2, 0.25, 0.345), trimesh.transformations.translation_matrix((0, y, 0.07))
        )
        for y in (-0.395, 0.395)
    ]
    deck = trimesh.creation.box(
        (1.2, 1.0, 0.02), trimesh.transformations.translation_matrix((0, 0, 0.39))
    )
    mesh = trimesh.util.concatenate([*pontoons, deck])
    mesh.apply_scale(scale)
    mesh.export(file := folder / f"hull.{suffix}")
    return file


@pytest.mark.parametrize("suffix", ["stl", "obj", "glb"])
def test_a_mesh_gives_inertia_pieces_and_appearance(tmp_path: Path, suffix: str) -> None:
    data = vehicle_from_mesh(
        catamaran(tmp_path, suffix, 1000.0),
        without(OTTER, "inertia", "boxes", "centre_of_mass"),
        0.001,
    ).data
    volumes, places = (
        np.array([0.1725, 0.1725, 0.024]),
        np.array([[0, -0.395, 0.07], [0, 0.395, 0.07], [0, 0, 0.39]]),
    )
    edges = np.array([[2, 0.25, 0.345], [2, 0.25, 0.345], [1.2, 1, 0.02]])
    centre = volumes @ places / volumes.sum()
    inertia = np.zeros((3, 3))
    for mass, place, size in zip(80 * volumes / volumes.sum(), places, edges, strict=True):
        arm = place - centre
        inertia += mass * (
            np.diag((size @ size - size**2) / 12) + arm @ arm * np.eye(3) - np.outer(arm, arm)
        )
    assert data["centre_of_mass"]["value"] == pytest.approx(centre, abs=1e-6)
    assert np.array(data["inertia"]["value"]) == pytest.approx(inertia, rel=1e-5, abs=1e-5)
    assert [len(piece["points"]) for piece in data["boxes"]] == [8, 8, 8]
    model = model_from_data(json.loads(json.dumps(data)), "boat")
    assert model.visual is not None
    assert model.visual.shape == (36, 3, 3)
    (part,) = vehicle_parts(json.loads(json.dumps(data)))
    assert part.shape == "mesh"
    highest = np.reshape(part.size, (-1, 3))[:, 2].max() + part.position[2]
    assert highest == pytest.approx(
        0.4 - centre[2], abs=1e-5
    )  # pictures are relative to the centre of mass
    assert max(box.position[2] + box.half_extents[2] for box in model.body.boxes) == pytest.approx(
        0.4
    )


def test_a_vehicle_stands_on_its_convex_pieces(tmp_path: Path) -> None:
    """A cone on its base: the box around it would stand as high, but a wall beside its tip meets
    the box only.
    """
    mesh = trimesh.creation.cone(0.3, 0.6)
    mesh.export(tmp_path / "cone.stl")
    data = vehicle_from_mesh(tmp_path / "cone.stl", without(QUADCOPTER, "inertia", "boxes")).data
    start = {"uav": {"model": data, "position": [0, 0, 0.2]}}
    wall = {"size": [0.1, 1, 0.1], "position": [0.25, 0, 0.55]}
    trial = WorldHarness(
        start, {"ground": {"size": [4, 4, 0.1], "position": [0, 0, -0.05]}, "wall": wall}
    )
    trial.step(100)
    assert trial["uav.position.z"] == pytest.approx(
        0.15, abs=2e-3
    )  # the centre of mass of a cone is at a quarter of its height
    assert trial["uav.contact.touching"]
    assert trial.vector("uav.attitude", ("roll", "pitch")) == pytest.approx([0, 0], abs=1e-2)


def test_a_round_piece_keeps_its_extent() -> None:
    (points,) = mesh_import.convex_pieces(trimesh.creation.icosphere(4, 0.5))
    assert len(points) <= MAX_POINTS
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.full(len(points), 0.5))
    assert np.ptp(points, axis=0).min() > 0.9


def test_meshes_of_a_urdf_file_collide_and_are_shown(tmp_path: Path) -> None:
    catamaran(tmp_path, "stl")
    inertial = (
        '<inertial><origin xyz="0 0 0.1"/><mass value="80"/><inertia ixx="11" iyy="15" '
        'izz="14"/></inertial>'
    )
    geometry = (
        '<origin xyz="0.1 0 0" rpy="0 0 0"/><geometry><mesh filename="package://boat/hull.stl" '
        'scale="1 1 1"/></geometry>'
    )
    (tmp_path / "boat.urdf").write_text(
        f'<robot name="boat"><link name="hull">{inertial}<visual>{geometry}</visual>'
        f"<collision>{geometry}</collision></link>"
        '<link name="port"/><joint name="shaft" type="fixed"><parent link="hull"/><child '
        'link="port"/>'
        '<origin xyz="-0.9 0.395 -0.1"/></joint>'
        "</robot>"
    )
    parts = without(OTTER, "mass", "inertia", "centre_of_mass", "boxes")
    parts["propellers"] = [{"link": "port"}]
    data = vehicle_from_urdf(tmp_path / "boat.urdf", parts).data
    assert data["centre_of_mass"]["value"] == [0, 0, 0.1]
    assert data["propellers"][0]["position"] == pytest.approx([-0.9, 0.395, -0.1])
    assert np.array(data["boxes"][0]["points"])[:, 0].max() == pytest.approx(1.1)
    assert np.array(data["visual"]["vertices"])[:, 0].min() == pytest.approx(-0.9)
    trial = WorldHarness({"usv": {"model": data, "position": [0, 0]}})
    trial["usv.propeller_speed"] = [50.0]
    assert trial.step(200)["usv.rates.r"] < 0


def test_faults_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing\.stl: the file does not exist"):
        vehicle_from_mesh(tmp_path / "missing.stl", QUADCOPTER)
    file = catamaran(tmp_path, "stl")
    with pytest.raises(InputError, match='"mass" is missing in the accompanying file'):
        vehicle_from_mesh(file, without(QUADCOPTER, "mass"))
    trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).export(tmp_path / "flat.stl")
    with pytest.raises(InputError, match="encloses no volume"):
        vehicle_from_mesh(tmp_path / "flat.stl", QUADCOPTER)
    with pytest.raises(
        InputError,
        match=r"boxes\.0\.points: found 3 points, expected at least 4 that do not lie in a plane",
    ):
        model_from_data({**QUADCOPTER, "boxes": [{"points": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}]})
    with pytest.raises(InputError, match="visual: expected vertices"):
        model_from_data({**QUADCOPTER, "visual": {"vertices": [[0, 0, 0]], "faces": [[0, 1, 2]]}})


def test_the_command_writes_the_vehicle_file(tmp_path: Path) -> None:
    (tmp_path / "parts.json").write_text(json.dumps(without(QUADCOPTER, "inertia", "boxes")))
    file = catamaran(tmp_path, "stl")
    arguments = [
        "shape",
        "--from",
        str(tmp_path / "parts.json"),
        "--mesh",
        str(file),
        "--mesh-scale",
        "0.1",
    ]
    outcome = CliRunner().invoke(command, [*arguments, "--directory", str(tmp_path)])
    assert outcome.exit_code == 0, outcome.output
    written = json.loads((tmp_path / "shape.json").read_text())
    assert model_from_data(written, "shape").body.mass == pytest.approx(2.0643)


def test_the_command_says_that_the_mesh_of_a_vessel_does_not_float(tmp_path: Path) -> None:
    boat = json.loads((resources.root() / "plant_src/vehicles/data/blueboat.json").read_text())
    (tmp_path / "parts.json").write_text(json.dumps(without(boat, "boxes")))
    arguments = [
        "boat",
        "--from",
        str(tmp_path / "parts.json"),
        "--directory",
        str(tmp_path),
        "--mesh",
    ]
    outcome = CliRunner().invoke(command, [*arguments, str(catamaran(tmp_path, "stl"))])
    assert outcome.exit_code == 0, outcome.output
    assert 'Buoyancy, waves and drag act on the dimensions in "hull".' in outcome.output
    assert (
        "hull"
        not in CliRunner()
        .invoke(command, ["copy", "--from", "blueboat", "--directory", str(tmp_path)])
        .output
    )
