"""Modules of planar vessels that are given by data.

Vessel, interface, equations, reader of vehicle files.
"""
