"""External C functions of Modelica models.

Their sources, the calls from C code, and their evaluation in Python.
"""
