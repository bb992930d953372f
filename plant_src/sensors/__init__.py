"""Sensors, state estimators and signal faults: components between the plant and its controllers."""
