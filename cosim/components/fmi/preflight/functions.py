"""C functions of FMI: those that a library has to export, and those that the importer calls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from .model_description import Interface, ModelDescription

#: FMI 3.0 type names -> the part of fmi*Get..., fmi*Set... after Get and Set, by FMI major version
_FMI2_ACCESSORS = {
    "Float64": "Real",
    "Int32": "Integer",
    "Enumeration": "Integer",
    "Boolean": "Boolean",
    "String": "String",
}
_FMI3_TYPES = ("Binary", "Boolean", "Clock", "Float32", "Float64", "String")
_FMI3_INTEGERS = tuple(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))
ACCESSORS: Mapping[int, Mapping[str, str]] = {
    1: _FMI2_ACCESSORS,
    2: _FMI2_ACCESSORS,
    3: {name: name for name in (*_FMI3_TYPES, *_FMI3_INTEGERS)} | {"Enumeration": "Int64"},
}

_COMMON = (
    *(
        "EnterInitializationMode",
        "ExitInitializationMode",
        "FreeInstance",
        "GetDirectionalDerivative",
        "GetVersion",
        "Reset",
    ),
    *("SetDebugLogging", "Terminate"),
)
_STATE = {
    2: (
        "DeSerializeFMUstate",
        "FreeFMUstate",
        "GetFMUstate",
        "SerializeFMUstate",
        "SerializedFMUstateSize",
        "SetFMUstate",
    ),
    3: (
        "DeserializeFMUState",
        "FreeFMUState",
        "GetFMUState",
        "SerializeFMUState",
        "SerializedFMUStateSize",
        "SetFMUState",
    ),
}
_FMI2_INTERFACES: Mapping[Interface, Sequence[str]] = {
    "co-simulation": (
        *(
            "CancelStep",
            "DoStep",
            "GetBooleanStatus",
            "GetIntegerStatus",
            "GetRealOutputDerivatives",
            "GetRealStatus",
        ),
        *("GetStatus", "GetStringStatus", "SetRealInputDerivatives"),
    ),
    "model-exchange": (
        *(
            "CompletedIntegratorStep",
            "EnterContinuousTimeMode",
            "EnterEventMode",
            "GetContinuousStates",
            "GetDerivatives",
        ),
        *(
            "GetEventIndicators",
            "GetNominalsOfContinuousStates",
            "NewDiscreteStates",
            "SetContinuousStates",
            "SetTime",
        ),
    ),
}
_FMI1_INTERFACES: Mapping[Interface, Sequence[str]] = {
    "co-simulation": (
        *(
            "CancelStep",
            "DoStep",
            "FreeSlaveInstance",
            "GetBooleanStatus",
            "GetIntegerStatus",
            "GetRealOutputDerivatives",
        ),
        *(
            "GetRealStatus",
            "GetStatus",
            "GetStringStatus",
            "GetTypesPlatform",
            "InitializeSlave",
            "InstantiateSlave",
        ),
        *("ResetSlave", "SetRealInputDerivatives", "TerminateSlave"),
    ),
    "model-exchange": (
        *(
            "CompletedIntegratorStep",
            "EventUpdate",
            "FreeModelInstance",
            "GetContinuousStates",
            "GetDerivatives",
        ),
        *(
            "GetEventIndicators",
            "GetModelTypesPlatform",
            "GetNominalContinuousStates",
            "GetStateValueReferences",
        ),
        *("Initialize", "InstantiateModel", "SetContinuousStates", "SetTime", "Terminate"),
    ),
}
_FMI3_ONLY = (
    *(
        "ActivateModelPartition",
        "CompletedIntegratorStep",
        "DoStep",
        "EnterConfigurationMode",
        "EnterContinuousTimeMode",
    ),
    *(
        "EnterEventMode",
        "EnterStepMode",
        "EvaluateDiscreteStates",
        "ExitConfigurationMode",
        "GetAdjointDerivative",
    ),
    *(
        "GetContinuousStateDerivatives",
        "GetContinuousStates",
        "GetEventIndicators",
        "GetIntervalDecimal",
        "GetIntervalFraction",
    ),
    *("GetNominalsOfContinuousStates", "GetNumberOfContinuousStates", "GetNumberOfEventIndicators"),
    *(
        "GetNumberOfVariableDependencies",
        "GetOutputDerivatives",
        "GetShiftDecimal",
        "GetShiftFraction",
    ),
    *(
        "GetVariableDependencies",
        "InstantiateCoSimulation",
        "InstantiateModelExchange",
        "InstantiateScheduledExecution",
    ),
    *(
        "SetContinuousStates",
        "SetIntervalDecimal",
        "SetIntervalFraction",
        "SetShiftDecimal",
        "SetShiftFraction",
        "SetTime",
    ),
    "UpdateDiscreteStates",
)
_INITIALIZATION = ("EnterInitializationMode", "ExitInitializationMode", "FreeInstance", "Terminate")
_INTEGRATION = (
    *(
        "CompletedIntegratorStep",
        "EnterContinuousTimeMode",
        "EnterEventMode",
        "GetContinuousStates",
        "GetEventIndicators",
    ),
    *("SetContinuousStates", "SetTime"),
)
#: functions that the importer calls, without those of variables and states
_CALLED: Mapping[tuple[int, Interface], Sequence[str]] = {
    (1, "co-simulation"): (
        "DoStep",
        "FreeSlaveInstance",
        "InitializeSlave",
        "InstantiateSlave",
        "TerminateSlave",
    ),
    (1, "model-exchange"): (
        *(
            "CompletedIntegratorStep",
            "EventUpdate",
            "FreeModelInstance",
            "GetContinuousStates",
            "GetDerivatives",
        ),
        *(
            "GetEventIndicators",
            "Initialize",
            "InstantiateModel",
            "SetContinuousStates",
            "SetTime",
            "Terminate",
        ),
    ),
    (2, "co-simulation"): ("Instantiate", "SetupExperiment", *_INITIALIZATION, "DoStep"),
    (3, "co-simulation"): ("InstantiateCoSimulation", *_INITIALIZATION, "DoStep"),
    (2, "model-exchange"): (
        *("Instantiate", "SetupExperiment", *_INITIALIZATION, *_INTEGRATION),
        *("GetDerivatives", "NewDiscreteStates"),
    ),
    (3, "model-exchange"): (
        *("InstantiateModelExchange", *_INITIALIZATION, *_INTEGRATION),
        *("GetContinuousStateDerivatives", "UpdateDiscreteStates"),
    ),
}


def function_prefix(major: int, identifier: str) -> str:
    """Return the prefix of the C functions.

    Only those of FMI 1.0 begin with the model identifier.
    """
    return f"{identifier}_fmi" if major == 1 else f"fmi{major}"


def standard_functions(major: int, interface: Interface, identifier: str = "") -> frozenset[str]:
    """Return the functions that the standard requires a library to export.

    Args:
        major: FMI major version.
        interface: Interface of the FMU.
        identifier: `modelIdentifier` of the FMU.
    """
    accessors = (verb + name for verb in ("Get", "Set") for name in ACCESSORS[major].values())
    prefix = function_prefix(major, identifier)
    if major == 1:
        return frozenset(
            prefix + name
            for name in ("GetVersion", "SetDebugLogging", *_FMI1_INTERFACES[interface], *accessors)
        )
    if major == 2:
        specific: Sequence[str] = (
            "GetTypesPlatform",
            "Instantiate",
            "SetupExperiment",
            *_FMI2_INTERFACES[interface],
        )
    else:
        specific = _FMI3_ONLY
    return frozenset(prefix + name for name in (*_COMMON, *_STATE[major], *specific, *accessors))


def called_functions(model: ModelDescription, interface: Interface) -> frozenset[str]:
    """Return the functions without which the importer cannot simulate an FMU.

    Args:
        model: Model description of the FMU.
        interface: Interface through which it is simulated.
    """
    names = {*_CALLED[model.major, interface], *_accessors_of_variables(model)}
    attributes = model.interfaces[interface]
    if any(
        attributes.get(flag) in ("true", "1")
        for flag in ("canGetAndSetFMUstate", "canGetAndSetFMUState")
    ):
        names.update(name for name in _STATE[model.major] if "erialize" not in name)
    prefix = function_prefix(model.major, attributes["modelIdentifier"])
    return frozenset(prefix + name for name in names)


def _accessors_of_variables(model: ModelDescription) -> Iterator[str]:
    accessors = ACCESSORS[model.major]
    for kind, causality in {(variable.kind, variable.causality) for variable in model.variables}:
        yield f"Get{accessors[kind]}"
        if causality in ("input", "parameter", "structuralParameter"):
            yield f"Set{accessors[kind]}"
