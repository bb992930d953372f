"""Tables, statistics, figures and pages about the runs of a study."""
