"""Pictures and videos of a mission on a lake, rendered in software without a display."""
