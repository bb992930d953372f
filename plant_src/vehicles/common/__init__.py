"""Modules that all vehicles share: interface, kinematics, shapes, contact functions."""
