"""Analysis of a scenario as a control loop: trim, linearisation, margins."""
