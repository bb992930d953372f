"""Operating-system processes: supervision, journal, containment of foreign code, sandbox, files of a run."""
