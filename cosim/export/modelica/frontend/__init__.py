"""Reading of Modelica files into a flat model."""
