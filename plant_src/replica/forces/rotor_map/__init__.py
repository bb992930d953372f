"""Thrusts and torques of the four rotors."""
