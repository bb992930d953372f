"""Replica of the published simulator with its conventions: signal interface, plant, force models and controllers."""
