"""A control loop of your own around the plant: without its autopilot, the vessel turns to 0.5 rad and keeps this course."""

import cosim

SCENARIO = {
    "extends": "demo1_box", "name": "own_loop", "stop_time": 20.0, "kpis": [], "checks": [], "figures": [],
    "components": {"usv": None}, "algorithm": {"stages": [["uav"], ["plant"]]}, "record": {"signals": ["*"]},
    "connections": {"usv.vehicle": None, "plant.usv.thrust": None, "plant.usv.rudder_angle": None},
}  # fmt: skip

with cosim.load(SCENARIO) as simulation:
    simulation.set("plant.usv.thrust", 4.0)
    while simulation.step():
        yaw, yaw_rate = simulation.get("plant.usv.attitude.yaw"), simulation.get("plant.usv.rates.r")
        rudder_angle = 0.8 * (yaw - 0.5) + 0.5 * yaw_rate
        simulation.set("plant.usv.rudder_angle", max(-0.5, min(0.5, rudder_angle)))
    print(f"course after {simulation.time:g} s: {simulation.get('plant.usv.attitude.yaw'):.2f} rad")
