"""Execution of the runs of a study: worker processes, run store, cluster workers."""
