"""`bench.html` of many controllers: limits, legend and meanings of KPIs; it fits wide and narrow
screens.
"""

import pytest

from cosim.core import resources
from cosim.studies.controller_bench.page import (
    BenchedController,
    describe_kpis,
    kpi_description,
    write_bench_page,
)
from cosim.studies.controller_bench.ranking import RunKpis, ScenarioKpis, rank

FOLDER = resources.root() / "scenarios"
KPIS = [
    {
        "name": "landing",
        "python": "../plant_src/kpis.py:landing",
        "arguments": {"vehicle": "plant.uav", "deck": "plant.usv.deck"},
    },
    {
        "name": "waypoints",
        "python": "../plant_src/kpis.py:waypoints",
        "arguments": {"vehicle": "plant.usv"},
    },
    {
        "name": "height",
        "python": "../plant_src/kpis.py:final",
        "arguments": {"signal": "plant.uav.position.z"},
    },
    {"name": "gone", "python": "missing.py:function"},
]
CHECKS = [
    {"kpi": "landing.lateral_error", "max": 0.1},
    {"kpi": "height.value", "min": 0.95, "max": 1.05},
]
NAMES = [f"a_controller_with_a_long_name_{i}" for i in range(9)]


def test_descriptions_are_those_of_the_values_else_that_of_the_function():
    found = describe_kpis(KPIS, FOLDER)
    assert kpi_description("landing.landed_at_end", found).startswith(
        "true if there was a touchdown"
    )
    assert (
        kpi_description("waypoints.time[2]", found)
        == "time at which each waypoint was reached (s); NaN if it was not"
    )
    height = "value, the last value of a signal in its own unit (signal plant.uav.position.z)"
    assert kpi_description("height.value", found) == height
    assert kpi_description("gone.value", found) == ""


@pytest.fixture(scope="module")
def bench_page(tmp_path_factory):
    """Page of nine controllers, of which the last lacks a KPI, in a scenario in which the check of
    the height fails.
    """
    path = tmp_path_factory.mktemp("bench") / "bench.html"
    descriptions = describe_kpis(KPIS, FOLDER)

    def benched(name):
        kpis = {
            "landing.lateral_error": float("nan"),
            "height.value": 2.0,
            "landing.time": 8.123456,
        }
        if name == NAMES[-1]:
            del kpis["landing.lateral_error"]
        run = ScenarioKpis(
            RunKpis(kpis, {"height.value": "m"}, {}), None, CHECKS, descriptions=descriptions
        )
        return BenchedController(
            name,
            rank([run], ["landing.time"]),
            {"hover": run},
            ["landing.time"],
            ["left out: a note"],
        )

    write_bench_page("uav_controller", [benched(name) for name in NAMES], path, NAMES[0], 1e-6)
    return path


@pytest.mark.parametrize("width", [1500, 360])
def test_a_page_of_many_controllers_scrolls_only_inside_its_tables(chromium, bench_page, width):
    context = chromium.new_context(viewport={"width": width, "height": 800})
    page = context.new_page()
    page.goto(bench_page.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") == width
    context.close()


def test_tables_have_limits_and_meanings_and_the_legend_explains_their_cells(chromium, bench_page):
    context = chromium.new_context(viewport={"width": 1500, "height": 800})
    page = context.new_page()
    page.goto(bench_page.as_uri())
    rows = {
        row.locator("td").first.inner_text(): row.locator("td")
        for row in page.locator("table").nth(1).locator("tbody tr").all()
    }
    assert {name: cells.nth(2).inner_text() for name, cells in rows.items()} == {
        "landing.lateral_error": "max 0.1",
        "height.value": "min 0.95, max 1.05",
        "landing.time": "",
    }
    error = rows["landing.lateral_error"]
    assert [error.nth(i).inner_text() for i in (3, 4, -1)] == ["failed", "-", ""]
    assert (
        error.nth(0)
        .get_attribute("title")
        .startswith("horizontal distance of the vehicle's centre of mass")
    )
    assert rows["height.value"].nth(4).get_attribute("class") == "number missed"
    legend = page.locator(".legend").first
    assert legend.bounding_box()["y"] < page.locator("table").nth(1).bounding_box()["y"]
    for text in ("-: no value", "An empty cell: ", "n/a: not applicable", "Red: "):
        assert text in legend.inner_text()
    listed = page.locator(".meanings").inner_text().split("\n")
    assert "height.value" in listed
    assert (
        "value, the last value of a signal in its own unit (signal plant.uav.position.z)" in listed
    )
    context.close()
