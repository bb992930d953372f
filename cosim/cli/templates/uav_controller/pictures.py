"""Figure of a run: the track of the quadcopter and of the deck it follows."""

from __future__ import annotations

from matplotlib.figure import Figure

from cosim.results import Result


def track(result: Result, followed: str, vehicle: str) -> Figure:
    """Draw the tracks seen from above (m), and the altitude of `vehicle` (m) over time (s)."""
    figure = Figure(layout="constrained", figsize=(8, 4))
    plan, height = figure.subplots(1, 2)
    for name, style in ((followed, "--"), (vehicle, "-")):
        plan.plot(result[f"{name}.position.x"], result[f"{name}.position.y"], style, label=name)
    plan.set(xlabel="east / m", ylabel="north / m", aspect="equal")
    figure.legend(loc="outside upper center", ncols=2)
    height.plot(result.time, result[f"{vehicle}.position.z"])
    height.set(xlabel="time / s", ylabel="altitude / m")
    return figure
