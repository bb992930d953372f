"""Complete missions of scenarios with waves and fleets: touchdown of the quadcopters."""

from __future__ import annotations

from plant_validation import MeasurementCheck

import cosim


def test_demo1_lands_on_a_vessel_in_irregular_waves(measured: MeasurementCheck) -> None:
    """Hs 0.05 m, Tp 2 s."""
    kpis = cosim.run("demo1_waves").kpis
    assert kpis["landing.landed_at_end"]
    assert kpis["waypoints.all_reached"]
    error = kpis["landing.lateral_error"]
    measured(
        "Contact",
        "Demo 1 in waves: touchdown from the deck's centre",
        error,
        0.0,
        "m",
        "middle of the deck",
        within=0.15,
    )


def test_three_pairs_survey_and_land(measured: MeasurementCheck) -> None:
    kpis = cosim.run("fleet_survey").kpis
    for pair in ("1", "2", "3"):
        assert kpis[f"landing{pair}.landed_at_end"]
        assert kpis[f"lanes{pair}.all_reached"]
        error, case = kpis[f"landing{pair}.lateral_error"], f"pair {pair}"
        measured(
            "Fleets",
            "survey: touchdown from the deck's centre",
            error,
            0.0,
            "m",
            "middle of the deck",
            within=0.1,
            case=case,
        )
