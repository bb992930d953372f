"""Size of the constants of the Otter of MSS; its variables are those of `../otter/interface.py`."""

#: number of constants that the equations derive from the parameters
CONSTANT_COUNT = 610
