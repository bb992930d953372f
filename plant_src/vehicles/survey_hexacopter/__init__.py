"""A survey hexacopter of the Tarot FY680 class."""
