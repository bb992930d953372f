"""External C functions of Modelica models: their sources, the calls from C code, and their evaluation in Python."""
