"""Force models between controllers and plant, the paper's "output processing".

Each folder becomes an FMU.

The models have no state and tunable parameters. They are stepped before the plant, with the delayed
signals of the bus.
"""
