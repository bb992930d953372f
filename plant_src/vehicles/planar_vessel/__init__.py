"""Modules of planar vessels that are given by data: vessel, interface, equations, reader of vehicle files."""
