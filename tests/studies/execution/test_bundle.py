"""Bundles: the files that runs need."""

import pytest

from cosim.studies.execution.bundle import collect_bundle


def files(lag, settings):
    return set(collect_bundle(lag.folder / "lag.json", [settings]).files)


@pytest.mark.parametrize(
    "settings", [{"/components/lag/parameters": {"fault": "table.txt"}}, {"lag.fault": "table.txt"}]
)
def test_a_file_named_by_a_parameter_is_in_the_bundle(lag, settings):
    (lag.folder / "table.txt").write_text("1")
    assert files(lag, settings) == {"lag.json", "lag.fmu", "table.txt"}


@pytest.mark.parametrize("text", ["word " * 200, "..", "x" * 5000, "loop"])
def test_other_strings_add_no_files(lag, text):
    (lag.folder / "loop").symlink_to("loop")
    assert files(lag, {"lag.fault": text}) == {"lag.json", "lag.fmu"}
