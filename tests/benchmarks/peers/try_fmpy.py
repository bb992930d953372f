"""FMPy: simulates an FMU with all defaults, without its own validation of the model description.

python try_fmpy.py FMU START STOP STEP
"""

import sys

import fmpy

path, start, stop, step = sys.argv[1], *map(float, sys.argv[2:])
result = fmpy.simulate_fmu(
    path, validate=False, start_time=start, stop_time=stop, output_interval=step
)
print(len(result))
