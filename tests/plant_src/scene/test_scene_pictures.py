"""The rendered scene: solids are where the mission has them, water and sky follow geometry."""

import math

import numpy as np
import pytest
from scene_recording import scene_mission

from cosim.core.errors import InputError
from plant_src.catalogue import VEHICLE_MODELS
from plant_src.physics.bullet import pybullet
from plant_src.scene.landscape import add_land, bank, pixel_rays, water_distance
from plant_src.scene.mission import CAMERAS, mission_of_result
from plant_src.scene.parts import Part, vehicle_parts
from plant_src.scene.render import Layer, Scene
from plant_src.scene.solid_renderer import NEAR, Picture, SolidRenderer, View

SIZE = (160, 80)
AHEAD = View(np.array([0.0, 0.0, 2.0]), np.array([10.0, 0.0, 2.0]))
RED = Part("box", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def test_a_box_has_its_distance():
    with SolidRenderer([RED]) as stage:
        stage.set_pose(0, [5.5, 0.0, 2.0], UPRIGHT)
        depth = stage.render(AHEAD, *SIZE).depth
    assert depth[40, 80] == pytest.approx(5.0, abs=0.01)
    assert np.isinf(depth[0, 0])


@pytest.mark.parametrize("place", [(6.0, 0.0, 2.0), (8.0, 2.0, 1.4), (8.0, -2.5, 2.6)])
def test_a_ball_appears_where_the_camera_projects_it(place):
    with SolidRenderer([Part("sphere", (0.3,), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))]) as stage:
        stage.set_pose(0, place, UPRIGHT)
        y, x = np.nonzero(np.isfinite(stage.render(AHEAD, *SIZE).depth))
    assert AHEAD.pixels(np.array([place]), *SIZE)[0] == pytest.approx(
        (x.mean() + 0.5, y.mean() + 0.5), abs=1.0
    )


def test_parts_rotate_with_their_object():
    with SolidRenderer([RED._replace(position=(1.0, 0.0, 0.0))]) as stage:
        stage.set_pose(0, [6.0, 0.0, 2.0], (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
        _, x = np.nonzero(np.isfinite(stage.render(AHEAD, *SIZE).depth))
    assert x.max() < 80  # the part is at (6, 1): left of the middle


def test_the_mirrored_view_shows_the_mirror_image_upside_down():
    below, place, (width, height) = (
        View(AHEAD.eye, np.array([10.0, 0.0, 1.0])),
        np.array([[8.0, 1.0, 1.2]]),
        SIZE,
    )
    x, y = below.pixels(place, width, height)[0]
    assert below.mirrored().pixels(place * (1, 1, -1), width, height)[0] == pytest.approx(
        (x, height - y)
    )


def test_water_is_where_rays_meet_it():
    down = View(np.array([0.0, 0.0, 2.0]), np.array([2.0, 0.0, 0.0]))
    distance = water_distance(down, pixel_rays(down, 161, 81))
    assert distance[40, 80] == pytest.approx(2.0 * math.sqrt(2), rel=1e-5)
    level = water_distance(AHEAD, pixel_rays(AHEAD, 160, 80))
    assert np.isinf(level[:40]).all()
    assert np.isfinite(level[40:]).all()


ONE_BANK = bank(7.0, -3.0, 200.0, 50.0, beach=0.5)


@pytest.mark.parametrize("eye", [(0.0, 0.0, 3.0), (0.0, 3.0, 1.5), (3.0, -6.0, 2.0)])
def test_banks_look_like_boxes_of_their_size(eye, monkeypatch):
    """Rays against TinyRenderer, which draws half a pixel elsewhere: its depth is one of those
    around.
    """
    view = View(np.array(eye), np.array([9.0, 0.5, 0.1]))
    monkeypatch.setattr("plant_src.scene.landscape.BANKS", [ONE_BANK])
    found = Picture(np.zeros((80, 160, 3), np.uint8), np.full((80, 160), np.inf, np.float32))
    add_land(found, view, pixel_rays(view, *SIZE))
    with SolidRenderer([as_part(step) for step in ONE_BANK]) as stage:
        drawn = stage.render(view, *SIZE)
    seen = np.isfinite(found.depth)
    assert seen.sum() > 1000
    assert (seen != np.isfinite(drawn.depth)).sum() < 0.08 * seen.sum()
    both = seen & np.isfinite(drawn.depth)
    around = np.stack([np.roll(found.depth, shift, (0, 1)) for shift in np.ndindex(3, 3)])
    around = np.roll(around, (-1, -1), (1, 2))[:, both]
    hit = (drawn.depth[both] > 0.999 * around.min(axis=0)) & (
        drawn.depth[both] < 1.001 * around.max(axis=0)
    )
    assert hit.mean() > 0.98
    assert (
        np.mean(np.abs(found.colour[both].astype(int) - drawn.colour[both]).max(axis=1) > 20) < 0.08
    )


def test_the_mirror_image_of_a_bank_shows_its_shore(monkeypatch):
    """Seen from below the water, in the picture upside down, land ends where it ends seen from
    above.
    """
    monkeypatch.setattr("plant_src.scene.landscape.BANKS", [ONE_BANK])
    view, pictures = View(np.array([0.0, 0.0, 3.0]), np.array([9.0, 0.5, 0.1])), []
    for one in (view, view.mirrored()):
        pictures.append(
            Picture(np.zeros((80, 160, 3), np.uint8), np.full((80, 160), np.inf, np.float32))
        )
        add_land(pictures[-1], one, pixel_rays(one, *SIZE))
    upright, mirrored = (np.isfinite(picture.depth) for picture in pictures)
    assert np.abs(upright.sum(axis=0) - mirrored[::-1].sum(axis=0)).max() <= 6


def test_land_hides_only_what_is_behind_it(monkeypatch):
    monkeypatch.setattr("plant_src.scene.landscape.BANKS", [ONE_BANK])
    view = View(np.array([0.0, 0.0, 3.0]), np.array([9.0, 0.5, 0.1]))
    near, far = (
        Picture(np.zeros((80, 160, 3), np.uint8), np.full((80, 160), depth, np.float32))
        for depth in (2.0, 50.0)
    )
    for picture in (near, far):
        add_land(picture, view, pixel_rays(view, *SIZE))
    assert not near.colour.any()
    assert far.colour.any()


def test_the_shore_is_sand_and_the_land_behind_it_is_green(monkeypatch):
    monkeypatch.setattr("plant_src.scene.landscape.BANKS", [ONE_BANK])
    view = View(np.array([0.0, 0.0, 3.0]), np.array([9.0, 0.5, 0.1]))
    picture = Picture(np.zeros((80, 160, 3), np.uint8), np.full((80, 160), np.inf, np.float32))
    add_land(picture, view, pixel_rays(view, *SIZE))
    land = np.isfinite(picture.depth)
    depths, colours = picture.depth[land], picture.colour[land]
    red, green, blue = colours[depths.argmin()]
    assert red > green > blue
    red, green, blue = colours[depths.argmax()]
    assert green > red > blue


def as_part(step):
    low, high = np.array(step.low), np.array(step.high)
    return Part("box", tuple(high - low), tuple((low + high) / 2), step.colour)


@pytest.mark.parametrize(
    "place", [(6.0, 0.0, 2.0), (8.0, 2.6, 1.4), (3.0, -1.3, 2.4), (0.2, 0.2, 2.0), (-5.0, 0.0, 2.0)]
)
def test_a_window_holds_all_of_a_ball(place):
    """All points of it that are in the picture."""
    window = AHEAD.bounding_window(np.array([place]), np.array([0.3]), *SIZE)
    turns = np.random.default_rng(1).standard_normal((5000, 3))
    points = place + 0.3 * turns / np.linalg.norm(turns, axis=1)[:, None]
    x, y = AHEAD.pixels(points[points[:, 0] > NEAR], *SIZE).T
    inside = (x > 0) & (x < 160) & (y > 0) & (y < 80)
    assert ((x >= window.left) & (x <= window.right) & (y >= window.top) & (y <= window.bottom))[
        inside
    ].all()


def test_a_window_is_not_much_larger_than_its_ball():
    left, right, top, bottom = AHEAD.bounding_window(
        np.array([[6.0, 0.0, 2.0]]), np.array([0.3]), *SIZE
    )
    width = 2 * 0.3 / 6.0 * 80 / (2 * math.tan(0.3))
    assert width <= right - left <= width + 6
    assert width <= bottom - top <= width + 6


def test_a_reused_background_gives_the_same_pictures():
    mission = mission_of_result(scene_mission())
    with Scene(mission) as scene:
        scene.render("landing", [900], [1.0], *SIZE)
        kept = scene.render("landing", [1100], [1.0], *SIZE)
    with Scene(mission) as scene:
        assert np.array_equal(scene.render("landing", [1100], [1.0], *SIZE), kept)


def test_a_moved_camera_gets_a_new_background():
    mission = mission_of_result(scene_mission())
    with Scene(mission) as scene:
        scene.render("chase", [600], [0.0], *SIZE)
        after = scene.render("chase", [1100], [0.0], *SIZE)
    with Scene(mission) as scene:
        assert np.array_equal(scene.render("chase", [1100], [0.0], *SIZE), after)


def layer_and_ghost(ghost_depth):
    grey, white = np.full((1, 1, 3), 51, np.uint8), np.full((1, 1, 3), 255, np.uint8)
    layer = Layer.from_solids(Picture(grey, np.full((1, 1), 5.0, np.float32)))
    before = float(layer.colour[0, 0, 0])
    layer.blend(Picture(white, np.full((1, 1), ghost_depth, np.float32)), 0.25)
    return before, float(layer.colour[0, 0, 0])


def test_a_vehicle_is_blended_over_farther_pixels():
    before, after = layer_and_ghost(3.0)
    assert after == pytest.approx(0.75 * before + 0.25)


def test_a_vehicle_behind_a_solid_is_hidden():
    before, after = layer_and_ghost(7.0)
    assert after == before


def test_a_vehicle_covers_the_sky_by_its_opacity():
    layer = Layer.from_solids(
        Picture(np.zeros((1, 1, 3), np.uint8), np.full((1, 1), np.inf, np.float32))
    )
    for share in (0.5, 0.5):
        layer.blend(
            Picture(np.full((1, 1, 3), 255, np.uint8), np.full((1, 1), 4.0, np.float32)), share
        )
    assert layer.alpha[0, 0] == pytest.approx(0.75)
    assert layer.colour[0, 0].tolist() == pytest.approx([0.75] * 3)


@pytest.mark.parametrize("name", CAMERAS)
def test_every_camera_has_the_landing_in_its_picture(name):
    mission = mission_of_result(scene_mission())
    for row in (mission.landing_rows()[-200], mission.landing_rows()[-1]):
        view = CAMERAS[name](mission, row)
        for x, y in view.pixels(mission.positions()[:, row], 200, 100):
            assert 0 < x < 200
            assert 0 < y < 100
        assert all((mission.positions()[:, row] - view.eye) @ view.axes()[2] > 0)


@pytest.mark.parametrize("name", CAMERAS)
def test_cameras_stay_above_the_water(name):
    mission = mission_of_result(scene_mission())
    assert all(CAMERAS[name](mission, row).eye[2] > 0.3 for row in range(0, 2001, 250))


def test_the_quadcopter_changes_the_picture():
    result = scene_mission()
    row = 1100
    with Scene(mission_of_result(result)) as scene:
        with_vehicles = scene.render("chase", [row], [1.0], *SIZE).astype(int)
        without = scene.render("chase", [row], [0.0], *SIZE).astype(int)
        changed = np.abs(with_vehicles - without).sum(axis=2) > 60
    x, y = CAMERAS["chase"](mission_of_result(result), row).pixels(
        np.array([mission_of_result(result).position("plant.uav", row)]), *SIZE
    )[0]
    assert changed[round(y) - 2 : round(y) + 3, round(x) - 2 : round(x) + 3].any()
    assert not changed[:10].any()


def test_pictures_are_the_same_every_time():
    def picture():
        with Scene(mission_of_result(scene_mission())) as scene:
            return scene.render("landing", [1000, 1200], [0.5, 1.0], *SIZE)

    assert np.array_equal(picture(), picture())


def test_all_clients_are_disconnected():
    with Scene(mission_of_result(scene_mission())) as scene:
        clients = [scene.static.client, scene.vehicles.client]
        assert all(pybullet.getConnectionInfo(client)["isConnected"] for client in clients)
    assert not any(pybullet.getConnectionInfo(client)["isConnected"] for client in clients)


@pytest.mark.parametrize("vehicle", VEHICLE_MODELS)
def test_visual_parts_have_about_the_size_of_the_collision_boxes(vehicle):
    parts = vehicle_parts(vehicle)
    seen = max(math.hypot(*part.position) for part in parts)
    solid = max(
        np.linalg.norm(box.corners(), axis=1).max()
        for box in next(iter(VEHICLE_MODELS[vehicle].values())).body.boxes
    )
    assert 0.5 * solid < seen < 2.5 * solid


def test_an_unknown_camera_is_refused():
    with (
        Scene(mission_of_result(scene_mission())) as scene,
        pytest.raises(InputError, match='no camera "dek"; did you mean "deck"'),
    ):
        scene.render("dek", [0], [1.0], *SIZE)
