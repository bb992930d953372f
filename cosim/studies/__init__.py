"""Many runs of one scenario: parameter studies, Monte Carlo and tuning, on this machine or a cluster."""
