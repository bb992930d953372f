"""CasADi vectors addressed by the names of the variables that they hold."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import casadi as ca
from casadi import SX

from cosim.core.component import Variable


class NamedValues(Mapping[str, SX]):
    """Expressions by name, in a fixed order.

    The name of a group, for example "wind", returns its scalars "wind.x", "wind.y" and "wind.z" as
    one vector. Iteration yields the single names only.
    """

    def __init__(self, values: Mapping[str, SX]):
        self._values = dict(values)

    def __getitem__(self, name: str) -> SX:
        if name in self._values:
            return self._values[name]
        group = [
            value
            for key, value in self._values.items()
            if key.rpartition(".")[0] == name and value.is_scalar()
        ]
        if not group:
            raise KeyError(name)
        return ca.vertcat(*group)

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def vector(self) -> SX:
        """Return all values as one column vector, matrices column by column."""
        return ca.vertcat(*(ca.vec(value) for value in self._values.values()))


def variables_of(variables: Sequence[Variable], causality: str) -> list[Variable]:
    """Return the variables of one causality, in order."""
    return [variable for variable in variables if variable.causality == causality]


def values_by_name(vector: SX, variables: Sequence[Variable]) -> NamedValues:
    """Return the parts of `vector` by name; it holds the values of `variables` in order."""
    return _split(
        vector, {variable.name: (len(variable.scalar_names), 1) for variable in variables}
    )


def vector_rows(values: NamedValues, group: str) -> SX:
    """Return the vectors `group.x|y|z` of several parts, shape (parts, 3)."""
    return ca.horzcat(*(values[f"{group}.{axis}"] for axis in "xyz"))


def square_matrix(elements: SX) -> SX:
    """Return the matrix whose rows follow each other in `elements`."""
    size = round(elements.numel() ** 0.5)
    return ca.reshape(elements, size, size).T


def initial_parameters(parameters: NamedValues) -> dict[str, SX]:
    """Return the parameters `initial.*`."""
    return {name: value for name, value in parameters.items() if name.startswith("initial.")}


def _split(vector: SX, shapes: Mapping[str, tuple[int, int]]) -> NamedValues:
    """Cut a vector into consecutive matrices of these shapes."""
    parts = ca.vertsplit(
        vector, [0, *accumulate(rows * columns for rows, columns in shapes.values())]
    )
    return NamedValues(
        {
            name: ca.reshape(part, *shape)
            for (name, shape), part in zip(shapes.items(), parts, strict=True)
        }
    )


@dataclass(frozen=True)
class ConstantsMap:
    """Constants that a model derives once from its parameters, as one vector and by name.

    Attributes:
        variables: Variables of the model; those with the causality "parameter" are used.
        derive: Function from parameters by name to constants by name.
    """

    variables: Sequence[Variable]
    derive: Callable[[NamedValues], Mapping[str, SX]]

    def vector(self, parameters: SX) -> SX:
        """Return the constants of a vector of parameters."""
        return NamedValues(self.derive(values_by_name(parameters, self._parameters))).vector()

    def by_name(self, constants: SX) -> NamedValues:
        """Return the parts of a vector that `vector` made."""
        return _split(constants, self.shapes)

    @cached_property
    def shapes(self) -> dict[str, tuple[int, int]]:
        """Rows and columns of each constant."""
        symbols = SX.sym(
            "parameters", sum(len(variable.scalar_names) for variable in self._parameters)
        )
        return {
            name: value.shape
            for name, value in self.derive(values_by_name(symbols, self._parameters)).items()
        }

    @property
    def _parameters(self) -> list[Variable]:
        return variables_of(self.variables, "parameter")
