"""Every variable of a shipped role has what the reference of the roles shows: a unit and a meaning."""

import pytest

from cosim.studies.controller_bench.role import OutputsSpec, VariableSpec, read_role_file, role_names


@pytest.mark.parametrize("name", role_names())
def test_every_single_variable_of_a_role_has_a_meaning(name):
    role = read_role_file(name)[1]
    for variable, source in (role.inputs | role.outputs | role.parameters).items():
        assert isinstance(source, OutputsSpec | VariableSpec), variable
        assert isinstance(source, OutputsSpec) or len(source.description) >= 8, variable
