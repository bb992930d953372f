"""Sensors and signal faults: components between the plant and its controllers."""
