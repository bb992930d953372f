"""Numbers, times, units, errors and the Component contract: no files, no JSON, no physics."""
