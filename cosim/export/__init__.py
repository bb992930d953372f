"""Export of FMUs from Modelica, CasADi equations, Python classes and C (`cosim build`)."""
