"""Modules of vessels: hull, wave loads, equations, contact functions."""
