"""Shipped sweep of the landing envelope, reduced to two by two landings."""

import json

import pytest
from click.testing import CliRunner

from cosim.cli.commands.sweep import command
from cosim.core import resources

SEA = "/components/plant/arguments/environment/waves"
RIPPLES = {f"{SEA}/significant_height": 0.05, f"{SEA}/peak_period": 1.27}
SWEEPS = resources.root() / "scenarios" / "sweeps"


def write_small_sweep(folder):
    """Write the sweep with two controllers in light and in strong wind and with a short mission."""
    content = json.loads((SWEEPS / "landing_envelope.json").read_text())
    controller, speed, wind, _ = content["factors"]
    controllers = {name: controller["levels"][name] for name in ("cascaded", "geometric")}
    factors = [controller | {"levels": controllers}, wind | {"values": [1.0, 12.0]}]
    calm = {
        **content["settings"],
        speed["set"]: 0.8,
        **RIPPLES,
        "uav.vtol.landing_time": 3.0,
        "/stop_time": 14.0,
    }
    content |= {
        "scenario": str(SWEEPS / content["scenario"]),
        "factors": factors,
        "settings": calm,
        "by": [],
    }
    content |= {
        "seeds": content["seeds"] | {"count": 1},
        "maps": [{"x": "wind", "y": "controller"}],
    }
    (folder / "small.json").write_text(json.dumps(content))
    return folder / "small.json"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("envelope")
    done = CliRunner().invoke(
        command,
        [
            str(write_small_sweep(folder)),
            "--output-dir",
            str(folder),
            "--workers",
            "1",
            "--replays",
        ],
    )
    assert done.exit_code == 0, done.output
    return folder


def test_both_controllers_land_in_light_wind_and_none_in_strong_wind(folder):
    table = [line.split(",") for line in (folder / "table.csv").read_text().splitlines()]
    passed = table[0].index("passed")
    assert [row[passed] for row in table[1:]] == ["1", "0", "1", "0"]


def test_every_cell_opens_a_replay_of_both_vehicles(folder):
    pages = list((folder / "replays").iterdir())
    assert len(pages) == 4
    text = (folder / "sweep.html").read_text()
    assert all(f'xlink:href="replays/{page.name}"' in text for page in pages)
    assert all("plant.usv.deck.position.x" in page.read_text() for page in pages)
