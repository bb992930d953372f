"""Tables, statistics, figures and pages of the runs of a study."""
