"""Modules of multirotors: airframe, interface, equations, loads, ground effect."""
