"""Drag of the air on the vessel."""
