"""Execution of the runs of a study: worker processes, the store of finished runs, cluster workers."""
