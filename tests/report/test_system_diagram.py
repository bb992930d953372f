"""Layout of components and connections in the system diagram."""

import re
from itertools import combinations

import pytest

from cosim.report.diagram import HEIGHT, WIDTH, build_diagram


def component(name, period=None):
    return {
        "name": name,
        "origin": f"../fmus/{name}.fmu",
        "inputs": 2,
        "outputs": 3,
        "period": period,
    }


SYSTEM = {
    "components": [component(name) for name in ("plant", "uav.path", "uav.mixer", "usv")],
    "stages": [["usv", {"name": "uav", "stages": [["uav.path"], ["uav.mixer"]]}], ["plant"]],
    "connections": [
        ["plant.uav.position.x", "uav.path.x", "m", ""],
        ["plant.uav.position.y", "uav.path.y", "m", "delay 1"],
        ["uav.path.roll", "uav.mixer.roll", "rad", ""],
        ["uav.mixer.speed[1]", "plant.uav.rotor_speed[1]", "rad/s", ""],
        ["usv.thrust", "plant.usv.thrust", "N", ""],
    ],
}


def boxes(drawn):
    return {box.name: box for box in drawn.boxes}


def test_stages_run_from_left_to_right():
    box = boxes(build_diagram(SYSTEM))
    assert box["uav.path"].x == box["usv"].x < box["uav.mixer"].x < box["plant"].x


def test_no_boxes_overlap_and_all_lie_inside():
    drawn = build_diagram(SYSTEM)
    for one, other in combinations(drawn.boxes, 2):
        assert abs(one.x - other.x) >= WIDTH or abs(one.y - other.y) >= HEIGHT
    for box in drawn.boxes:
        assert min(box.x, box.y) > 0
        assert box.x + WIDTH < drawn.width
        assert box.y + HEIGHT < drawn.height


def test_the_frame_of_a_nested_system_contains_only_its_components():
    drawn = build_diagram(SYSTEM)
    (frame,) = drawn.frames
    inside = {
        b.name
        for b in drawn.boxes
        if frame.x < b.x < frame.x + frame.width and frame.y < b.y < frame.y + frame.height
    }
    assert (frame.name, inside) == ("uav", {"uav.path", "uav.mixer"})


def test_all_connections_of_two_components_are_one_wire_with_a_list():
    wires = build_diagram(SYSTEM).wires
    assert sorted(wire.connections for wire in wires) == [1, 1, 1, 2]
    (feedback,) = (wire for wire in wires if wire.connections == 2)
    assert feedback.tooltip.splitlines() == [
        "plant.uav.position.x → uav.path.x  [m]",
        "plant.uav.position.y → uav.path.y  [m]  (delay 1)",
    ]


def test_a_wire_begins_and_ends_at_its_boxes():
    drawn = build_diagram(SYSTEM)
    box = boxes(drawn)
    (path,) = (wire.path for wire in drawn.wires if wire.tooltip.startswith("usv"))
    numbers = [float(number) for number in re.findall(r"-?[\d.]+", path)]
    assert numbers[:2] == pytest.approx([box["usv"].x + WIDTH, box["usv"].y + HEIGHT / 2])
    assert numbers[-2:] == pytest.approx([box["plant"].x, box["plant"].y + HEIGHT / 2])


def test_the_tooltip_contains_the_period():
    system = {
        **SYSTEM,
        "components": [component("usv", 0.05)],
        "stages": [["usv"]],
        "connections": [],
    }
    assert (
        build_diagram(system).boxes[0].tooltip
        == "usv\n../fmus/usv.fmu\n2 inputs, 3 outputs, every 0.05 s"
    )


def test_an_empty_system_is_an_empty_diagram():
    assert build_diagram({"components": [], "stages": [], "connections": []}).boxes == []
