"""Operating-system processes: supervision, journal, restoring of process state, sandbox, files of a run."""
