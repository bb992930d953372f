"""From sources to FMUs: Modelica, CasADi equations and Python classes; used by `cosim build` only."""
