"""Prepared calls of fmi*Get... and fmi*Set..., which transfer the bound variables."""

import ctypes
from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import groupby
from typing import Any, Literal, NamedTuple

import numpy as np

from ...core.component import SUCCESS_STATUSES, NativeGetSet, Ports, PreparedCall, Variable
from ...core.errors import InputError
from .library import FunctionTable, as_pointer, as_size, function_address

#: ends of the names of the functions for slopes, by direction and by whether the FMI version is
#: 3.0, which has none for inputs
_SLOPE_FUNCTIONS = {
    ("Get", False): "RealOutputDerivatives",
    ("Set", False): "RealInputDerivatives",
    ("Get", True): "OutputDerivatives",
}


class AccessorCallFactory(NamedTuple):
    """Factory of the prepared get and set calls of one FMU instance.

    Slopes are set by fmi*SetRealInputDerivatives, and got by fmi*GetRealOutputDerivatives or
    fmi3GetOutputDerivatives.

    Attributes:
        fmi_major: FMI major version.
        prefix: Prefix of the C functions.
        functions: C functions of the FMU's library.
        instance: Address of the FMU instance (fmi2Component, fmi3Instance).
        value_references: Value references by variable name.
        accessors: FMI 3.0 type names -> the part of the function name after Get or Set.
    """

    fmi_major: int
    prefix: str
    functions: FunctionTable
    instance: int
    value_references: Mapping[str, int]
    accessors: Mapping[str, str]

    def prepare(
        self,
        verb: Literal["Get", "Set"],
        ports: Ports,
        transfer_object: Callable[[str, np.ndarray, int], int],
        is_selected: Callable[[Variable], bool] = lambda _: True,
    ) -> list[PreparedCall]:
        """Prepare calls for the selected bound variables.

        One for adjacent variables of the same accessor.

        Args:
            verb: Direction of the transfer.
            ports: Bound variables and their arrays.
            transfer_object: Transfers one String or Binary variable, given its name, its array and
                its index in the array.
            is_selected: Returns whether a variable is transferred.
        """
        calls: list[PreparedCall] = []
        for dtype, array in ports.arrays.items():
            begin = 0
            same_dtype = [variable for variable in ports.variables if variable.dtype == dtype]
            for (accessor, _, selected), group in groupby(
                same_dtype,
                lambda v: (self.accessors[v.type], bool(v.derivative_of), is_selected(v)),
            ):
                variables, function = list(group), f"{self.prefix}{verb}{accessor}"
                end = begin + sum(len(variable.scalar_names) for variable in variables)
                if not selected:
                    pass
                elif variables[0].derivative_of:
                    calls.append(self._prepare_slopes(verb, variables, array[begin:end]))
                elif dtype.hasobject:
                    indexed = enumerate(variables, begin)
                    calls += [
                        PreparedCall(transfer_object, (v.name, array, index), function)
                        for index, v in indexed
                    ]
                else:
                    calls.append(self._prepare_numeric(function, variables, array[begin:end]))
                begin = end
        return calls

    def _prepare_slopes(
        self, verb: Literal["Get", "Set"], variables: Sequence[Variable], slopes: np.ndarray
    ) -> PreparedCall:
        """Prepare the call that gets the slopes of outputs, or sets those of inputs.

        For the native executor it is a call with the arguments of FMI 3.0, whose last one has the
        size of a pointer. The function of FMI 3.0 has one more argument, and is called from Python.
        """
        count = len(variables)
        name = f"{self.prefix}{verb}{_SLOPE_FUNCTIONS[verb, self.fmi_major > 2]}"
        references = (ctypes.c_uint32 * count)(
            *(self.value_references[variable.derivative_of] for variable in variables)
        )
        orders = (ctypes.c_int32 * count)(*[1] * count)
        if name not in self.functions:
            raise InputError(
                f"the library does not export {name}, which the capabilities of the FMU promise"
            )
        function = self.functions[name]
        addresses = [ctypes.addressof(references), ctypes.addressof(orders), slopes.ctypes.data]
        pointers = [as_pointer(address) for address in addresses]
        arguments = (as_pointer(self.instance), pointers[0], as_size(count), *pointers[1:])
        if self.fmi_major > 2:
            return PreparedCall(
                function,
                (*arguments, as_size(len(slopes))),
                name,
                None,
                (references, orders, slopes),
            )
        native = NativeGetSet(
            3, function_address(function), self.instance, addresses[0], count, *addresses[1:]
        )
        return PreparedCall(function, arguments, name, native, (references, orders, slopes))

    def _prepare_numeric(
        self, name: str, variables: Sequence[Variable], values: np.ndarray
    ) -> PreparedCall:
        references = (ctypes.c_uint32 * len(variables))(
            *(self.value_references[variable.name] for variable in variables)
        )
        function = self.functions[name]
        references_address, values_address = ctypes.addressof(references), values.ctypes.data
        arguments: tuple[Any, ...] = (
            as_pointer(self.instance),
            as_pointer(references_address),
            as_size(len(variables)),
            as_pointer(values_address),
        )
        if self.fmi_major > 2:
            arguments += (as_size(len(values)),)
        native = NativeGetSet(
            max(self.fmi_major, 2),  # the functions of FMI 1.0 have the arguments of FMI 2.0
            function_address(function),
            self.instance,
            references_address,
            len(variables),
            values_address,
            len(values),
        )
        return PreparedCall(function, arguments, name, native, (references, values))


def prepare_negations(outputs: Ports, negated: Collection[str]) -> list[PreparedCall]:
    """Prepare the calls that change the signs of negated aliases after they have been got.

    Args:
        outputs: Bound variables and their arrays.
        negated: Names of the negated aliases, which only FMI 1.0 has and which are scalars.
    """
    return [
        PreparedCall(_negate_element, (array, part.start), "negated alias")
        for variable, array, part in outputs.elements()
        if variable.name in negated
    ]


def _negate_element(array: np.ndarray, index: int) -> int:
    array[index] = not array[index] if array.dtype == np.bool_ else -array[index]
    return SUCCESS_STATUSES[0]
