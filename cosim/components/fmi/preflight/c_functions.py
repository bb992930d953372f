"""C functions of FMI: those that a library has to export, and those that the importer calls."""

from collections.abc import Mapping

from ....core.component import DTYPES
from .model_description import Interface, ModelDescription, is_true

#: FMI 3.0 type names -> the part of fmi*Get..., fmi*Set... after Get and Set, by FMI major version
_FMI2_ACCESSORS = {
    "Float64": "Real",
    "Int32": "Integer",
    "Enumeration": "Integer",
    "Boolean": "Boolean",
    "String": "String",
}
ACCESSORS: Mapping[int, Mapping[str, str]] = {
    1: _FMI2_ACCESSORS,
    2: _FMI2_ACCESSORS,
    3: {name: name for name in DTYPES} | {"Enumeration": "Int64"},
}

#: functions of FMI 2.0 and 3.0
_COMMON = """
    EnterInitializationMode ExitInitializationMode FreeInstance GetDirectionalDerivative
    GetVersion Reset SetDebugLogging Terminate
"""
#: functions that save and restore states, and those that serialize them
_STATE = {2: "FreeFMUstate GetFMUstate SetFMUstate", 3: "FreeFMUState GetFMUState SetFMUState"}
_SERIALIZATION = {
    2: "DeSerializeFMUstate SerializeFMUstate SerializedFMUstateSize",
    3: "DeserializeFMUState SerializeFMUState SerializedFMUStateSize",
}
#: further functions of an interface, those of variables excepted
_SPECIFIC: Mapping[tuple[int, Interface], str] = {
    (1, "co-simulation"): """
        CancelStep DoStep FreeSlaveInstance GetBooleanStatus GetIntegerStatus
        GetRealOutputDerivatives GetRealStatus GetStatus GetStringStatus GetTypesPlatform
        InitializeSlave InstantiateSlave ResetSlave SetRealInputDerivatives TerminateSlave
    """,
    (1, "model-exchange"): """
        CompletedIntegratorStep EventUpdate FreeModelInstance GetContinuousStates GetDerivatives
        GetEventIndicators GetModelTypesPlatform GetNominalContinuousStates
        GetStateValueReferences Initialize InstantiateModel SetContinuousStates SetTime Terminate
    """,
    (2, "co-simulation"): """
        GetTypesPlatform Instantiate SetupExperiment
        CancelStep DoStep GetBooleanStatus GetIntegerStatus GetRealOutputDerivatives
        GetRealStatus GetStatus GetStringStatus SetRealInputDerivatives
    """,
    (2, "model-exchange"): """
        GetTypesPlatform Instantiate SetupExperiment
        CompletedIntegratorStep EnterContinuousTimeMode EnterEventMode GetContinuousStates
        GetDerivatives GetEventIndicators GetNominalsOfContinuousStates NewDiscreteStates
        SetContinuousStates SetTime
    """,
}
#: FMI 3.0 requires the functions of all interfaces
_FMI3_SPECIFIC = """
    ActivateModelPartition CompletedIntegratorStep DoStep EnterConfigurationMode
    EnterContinuousTimeMode EnterEventMode EnterStepMode EvaluateDiscreteStates
    ExitConfigurationMode GetAdjointDerivative GetContinuousStateDerivatives
    GetContinuousStates GetEventIndicators GetIntervalDecimal GetIntervalFraction
    GetNominalsOfContinuousStates GetNumberOfContinuousStates GetNumberOfEventIndicators
    GetNumberOfVariableDependencies GetOutputDerivatives GetShiftDecimal GetShiftFraction
    GetVariableDependencies InstantiateCoSimulation InstantiateModelExchange
    InstantiateScheduledExecution SetContinuousStates SetIntervalDecimal SetIntervalFraction
    SetShiftDecimal SetShiftFraction SetTime UpdateDiscreteStates
"""
#: functions that the importer calls, without those of variables and states
_INITIALIZATION = "EnterInitializationMode ExitInitializationMode FreeInstance Terminate "
_INTEGRATION = (
    "CompletedIntegratorStep EnterContinuousTimeMode EnterEventMode GetContinuousStates "
    "GetEventIndicators SetContinuousStates SetTime "
)
_CALLED: Mapping[tuple[int, Interface], str] = {
    (1, "co-simulation"): """
        DoStep FreeSlaveInstance InitializeSlave InstantiateSlave TerminateSlave
    """,
    (1, "model-exchange"): """
        CompletedIntegratorStep EventUpdate FreeModelInstance GetContinuousStates GetDerivatives
        GetEventIndicators Initialize InstantiateModel SetContinuousStates SetTime Terminate
    """,
    (2, "co-simulation"): _INITIALIZATION + "Instantiate SetupExperiment DoStep",
    (3, "co-simulation"): _INITIALIZATION + "InstantiateCoSimulation DoStep",
    (2, "model-exchange"): _INITIALIZATION
    + _INTEGRATION
    + "Instantiate SetupExperiment GetDerivatives NewDiscreteStates",
    (3, "model-exchange"): _INITIALIZATION
    + _INTEGRATION
    + "InstantiateModelExchange GetContinuousStateDerivatives UpdateDiscreteStates",
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
    names = [
        *(f"Get{name}" for name in ACCESSORS[major].values()),
        *(f"Set{name}" for name in ACCESSORS[major].values()),
        *_SPECIFIC.get((major, interface), _FMI3_SPECIFIC).split(),
    ]
    if major == 1:
        names += ["GetVersion", "SetDebugLogging"]
    else:
        names += [*_COMMON.split(), *_STATE[major].split(), *_SERIALIZATION[major].split()]
    prefix = function_prefix(major, identifier)
    return frozenset(prefix + name for name in names)


def called_functions(model: ModelDescription, interface: Interface) -> frozenset[str]:
    """Return the functions without which the importer cannot simulate an FMU.

    Args:
        model: Model description of the FMU.
        interface: Interface through which it is simulated.
    """
    attributes = model.interfaces[interface]
    names = set(_CALLED[model.major, interface].split())
    for kind, causality in {(variable.kind, variable.causality) for variable in model.variables}:
        accessor = ACCESSORS[model.major][kind]
        names.add(f"Get{accessor}")
        if causality in ("input", "parameter", "structuralParameter"):
            names.add(f"Set{accessor}")
    if is_true(attributes, "canGetAndSetFMUstate", "canGetAndSetFMUState"):
        names.update(_STATE[model.major].split())
    prefix = function_prefix(model.major, attributes["modelIdentifier"])
    return frozenset(prefix + name for name in names)
