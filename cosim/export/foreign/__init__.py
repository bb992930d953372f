"""Export of sources that implement FMI themselves: PythonFMU classes and C controllers."""
