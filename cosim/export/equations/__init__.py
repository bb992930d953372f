"""CasADi equations exported as FMUs."""
