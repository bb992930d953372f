"""Controllers in Python: one PythonFMU class per file, run in process or exported as an FMU."""
