"""Basic types: component interface, system, time grid, units, recording, errors."""
