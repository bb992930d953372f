"""docs/variables.md lists the variables of all vehicles; its tables are generated."""

from vehicle_variables import DOCUMENT, replace_tables


def test_the_tables_are_up_to_date() -> None:
    text = DOCUMENT.read_text()
    assert replace_tables(text) == text, "run `python tests/plant_src/vehicle_variables.py`"
