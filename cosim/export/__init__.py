"""Export of FMUs from Modelica models, CasADi equations, Python classes and C sources (`cosim build`)."""
