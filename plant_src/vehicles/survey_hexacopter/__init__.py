"""A hexacopter for survey flights, of the class of the Tarot FY680."""
