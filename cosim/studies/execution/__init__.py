"""Execution of the runs of a study.

Worker processes, the store of finished runs, cluster workers.
"""
