"""Tables of generated pages keep every cell in its column."""

import pytest

from docs.generator.markdown_parts import code, table

markdown = pytest.importorskip("markdown")


def test_a_bar_in_a_cell_does_not_end_it():
    text = table(
        ("name", "meaning"),
        [("damping", "load over |u| times velocity"), (code(r"x\|y"), r"escaped \| before")],
    )
    assert text.splitlines()[2] == r"| damping | load over \|u\| times velocity |"
    page = markdown.markdown(text, extensions=["tables"])
    assert "<td>load over |u| times velocity</td>" in page
    assert "<td>escaped | before</td>" in page
