"""Controllers in Python: one PythonFMU class per file, which runs in process or becomes an FMU."""
