"""Basic types: component interface, system, time grid, units, recording, errors.

pyproject.toml reads the version of cosim from here.
"""

__version__ = "0.3.0"
