"""Component types: FMUs, Python classes and input tables."""
