"""The force models between controllers and plant, the paper's "output processing": each folder becomes an FMU.

They hold no state, are stepped before the plant and see what the bus says about the vehicles. Parameters are tunable.
"""
