"""Operating-system processes.

Supervision, journal, restoring of process state, sandbox, files of a run.
"""
