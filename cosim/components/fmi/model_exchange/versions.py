"""Model Exchange instances of each FMI version."""

from __future__ import annotations

from ....core.errors import ComponentError
from ....core.size_limits import MAX_SCALARS
from ..fmi1 import Fmi1Instance
from ..fmi2 import Fmi2Instance
from ..fmi3 import Fmi3Instance
from .instance import ModelExchangeInstance

_COMMON_NAMES = {
    "set_time": "SetTime",
    "set_states": "SetContinuousStates",
    "get_states": "GetContinuousStates",
    "get_indicators": "GetEventIndicators",
    "get_nominals": "GetNominalsOfContinuousStates",
    "complete_step": "CompletedIntegratorStep",
    "set_inputs": "SetReal",
}


class Fmi1Model(ModelExchangeInstance, Fmi1Instance):
    """Model Exchange instance of an FMI 1.0 FMU, which has no modes."""

    _instantiate_function, _free_function = "fmi1InstantiateModel", "fmi1FreeModelInstance"
    _function_names = {
        **_COMMON_NAMES,
        "get_derivatives": "GetDerivatives",
        "get_nominals": "GetNominalContinuousStates",
    }
    _update_method = "eventUpdate"

    def _fmpy_class(self) -> type:
        from fmpy.fmi1 import FMU1Model

        model_class: type = FMU1Model
        return model_class

    def enter_initialization_mode(self, start_time: float, _stop_time: float) -> None:
        """Call fmiSetTime and fmiInitialize."""
        self._current_time.value = start_time
        self.call_function("setTime", start_time)
        self.call_function("initialize", self.tolerance is not None, self.tolerance or 0.0)

    def _update_discrete_states(self) -> tuple[bool, bool, bool, float]:
        converged, _, _, terminate, has_next, next_time = self.call_function("eventUpdate")
        return not converged, terminate, has_next, next_time

    def _enter_mode(self, method: str) -> None:
        """Do nothing: FMI 1.0 has no modes."""


class Fmi2Model(ModelExchangeInstance, Fmi2Instance):
    """Model Exchange instance of an FMI 2.0 FMU."""

    _function_names = {**_COMMON_NAMES, "get_derivatives": "GetDerivatives"}
    _update_method = "newDiscreteStates"

    def _fmpy_class(self) -> type:
        from fmpy.fmi2 import FMU2Model

        model_class: type = FMU2Model
        return model_class


class Fmi3Model(ModelExchangeInstance, Fmi3Instance):
    """Model Exchange instance of an FMI 3.0 FMU."""

    _instantiate_function = "fmi3InstantiateModelExchange"
    _function_names = {
        **_COMMON_NAMES,
        "get_derivatives": "GetContinuousStateDerivatives",
        "set_inputs": "SetFloat64",
    }
    _update_method = "updateDiscreteStates"

    def _fmpy_class(self) -> type:
        from fmpy.fmi3 import FMU3Model

        model_class: type = FMU3Model
        return model_class

    def _count_states(self) -> tuple[int, int]:
        return self._count("getNumberOfContinuousStates"), self._count("getNumberOfEventIndicators")

    def _count(self, method: str) -> int:
        """Return a number of the FMU.

        Raises:
            ComponentError: The call failed, or the number is too large.
        """
        found: int = self.call_function(method)
        if found > MAX_SCALARS:
            reason = f"found {found}, expected at most {MAX_SCALARS}"
            raise ComponentError(
                self.name, self._full_name(method), reason, self._current_time.value
            )
        return found
