"""Files on disk of a run in progress."""
