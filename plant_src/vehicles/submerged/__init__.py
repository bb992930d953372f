"""Modules of submerged vehicles: craft, interface, equations, reader of vehicle files."""
