"""Loads of the water on the hulls."""
