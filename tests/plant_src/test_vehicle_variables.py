"""docs/variables.md lists the variables of all vehicles; its tables are generated."""

import subprocess
import sys

from vehicle_variables import DOCUMENT, replace_tables

COMMAND = "python -m tests.plant_src.vehicle_variables"


def test_the_tables_are_up_to_date() -> None:
    text = DOCUMENT.read_text()
    assert replace_tables(text) == text, f"run `{COMMAND}`"


def test_the_command_of_the_document_finds_the_models() -> None:
    """It is executed without writing the document."""
    assert f"`{COMMAND}`" in DOCUMENT.read_text()
    module = COMMAND.split()[-1]
    code = f"from {module} import make_tables; print(make_tables())"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=DOCUMENT.parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.strip() in DOCUMENT.read_text(), done.stderr
    assert done.stdout
