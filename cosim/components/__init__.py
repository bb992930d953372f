"""Sources of components: FMUs, Python classes, input tables."""
