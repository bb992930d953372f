"""Replica of the published simulator with its conventions.

Signal interface, plant, force models and controllers.
"""
