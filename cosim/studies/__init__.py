"""Many runs of one scenario.

Parameter studies, Monte Carlo and tuning, on this machine or a cluster.
"""
