"""Python classes and C sources packed as FMUs."""
