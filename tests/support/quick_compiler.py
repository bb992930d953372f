"""Compilation without optimization, which takes a third of the time.

`cosim build --check` compiles all shipped FMUs with the usual options and compares their behaviour.
The committed FMUs, which most tests of controllers and missions load, were compiled with them too.
"""

from cosim.export.fmu import compiler


def compile_without_optimization() -> None:
    """Let the exporters of this process compile with -O0."""
    compiler.COMPILER_OPTIONS = tuple(
        "-O0" if option == "-O2" else option for option in compiler.COMPILER_OPTIONS
    )
