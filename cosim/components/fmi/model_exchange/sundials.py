"""CVODE of SUNDIALS, from the libraries that FMPy contains.

An initial value problem with root finding.

FMPy's own wrapper passes over internal steps, leaves memory behind, and prints errors of callbacks
instead of raising them.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from ctypes import CFUNCTYPE, POINTER, byref, c_char_p, c_double, c_int, c_int64, c_void_p
from typing import Any

import numpy as np

from ....core.errors import InputError

#: `CV_BDF`, `CV_ONE_STEP`, and the results of CVode
_BDF, _ONE_STEP = 2, 2
SUCCESS, STOP_TIME_REACHED, ROOT_FOUND = range(3)
#: results of the right-hand side and the root function: the solver ends, or tries a smaller step
FAILED, RECOVERABLE = -1, 1

#: right-hand side (time, address of the states, address of the derivatives) and roots (time,
#: states, values)
Evaluation = Callable[[float, int, int], int]
_RIGHT_HAND_SIDE = CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_void_p)
_ERROR_HANDLER = CFUNCTYPE(None, c_int, c_char_p, c_char_p, c_char_p, c_int, c_void_p, c_void_p)


class SolverError(Exception):
    """Reason why CVODE cannot continue."""


class Cvode:
    """One initial value problem, solved by variable-order BDF with a dense linear solver.

    Args:
        states: States, float64, shape (n,) with n > 0; the solver reads and writes them in place.
        derivatives: Right-hand side.
        roots: Root function.
        root_count: Number of roots.

    Raises:
        InputError: FMPy has no SUNDIALS libraries for this platform.
    """

    def __init__(
        self, states: np.ndarray, derivatives: Evaluation, roots: Evaluation, root_count: int
    ):
        self._states, self._message = states, ""
        self._absolute_tolerances = np.zeros_like(states)
        self._time = c_double()
        self._free = ExitStack()
        self._load_libraries()
        address = self._function("N_VGetArrayPointer_Serial", c_void_p, c_void_p)
        self._callbacks = (
            _RIGHT_HAND_SIDE(lambda time, x, dx, _: derivatives(time, address(x), address(dx))),
            _RIGHT_HAND_SIDE(lambda time, x, values, _: roots(time, address(x), values)),
            _ERROR_HANDLER(self._store_message),
        )
        self._create(root_count)

    def _load_libraries(self) -> None:
        try:
            from fmpy.sundials.libraries import sundials_core, sundials_cvode
        except (ImportError, OSError):
            raise InputError(
                'the method "cvode" is not available on this platform; use "euler" or "rk4"'
            ) from None
        self._core, self._cvode = sundials_core, sundials_cvode

    def _function(self, name: str, result: Any, *arguments: Any) -> Any:
        function: Any = (
            self._core if name.startswith(("SUNContext", "SUNLogger")) else self._cvode
        )[name]
        function.restype, function.argtypes = result, arguments
        return function

    def _create(self, root_count: int) -> None:
        context, size = c_void_p(), len(self._states)
        self._function("SUNContext_Create", c_int, c_int, POINTER(c_void_p))(0, byref(context))
        self._free.callback(
            self._function("SUNContext_Free", c_int, POINTER(c_void_p)), byref(context)
        )
        self._function("SUNContext_ClearErrHandlers", c_int, c_void_p)(context)
        self._function("SUNContext_PushErrHandler", c_int, c_void_p, _ERROR_HANDLER, c_void_p)(
            context, self._callbacks[2], None
        )
        logger = c_void_p()
        self._function("SUNContext_GetLogger", c_int, c_void_p, POINTER(c_void_p))(
            context, byref(logger)
        )
        self._function("SUNLogger_SetWarningFilename", c_int, c_void_p, c_char_p)(
            logger, os.devnull.encode()
        )
        make_vector = self._function("N_VMake_Serial", c_void_p, c_int64, c_void_p, c_void_p)
        self._x = self._owned(
            make_vector(size, self._states.ctypes.data, context), "N_VDestroy_Serial"
        )
        self._tolerances = self._owned(
            make_vector(size, self._absolute_tolerances.ctypes.data, context), "N_VDestroy_Serial"
        )
        make_matrix = self._function("SUNDenseMatrix", c_void_p, c_int64, c_int64, c_void_p)
        matrix = self._owned(make_matrix(size, size, context), "SUNMatDestroy_Dense")
        make_solver = self._function("SUNLinSol_Dense", c_void_p, c_void_p, c_void_p, c_void_p)
        solver = self._owned(make_solver(self._x, matrix, context), "SUNLinSolFree_Dense")
        self._memory = c_void_p(
            self._function("CVodeCreate", c_void_p, c_int, c_void_p)(_BDF, context)
        )
        self._free.callback(
            self._function("CVodeFree", None, POINTER(c_void_p)), byref(self._memory)
        )
        self._call(
            "CVodeInit", (_RIGHT_HAND_SIDE, c_double, c_void_p), self._callbacks[0], 0.0, self._x
        )
        self._call("CVodeSVtolerances", (c_double, c_void_p), 1.0, self._tolerances)
        self._call("CVodeRootInit", (c_int, _RIGHT_HAND_SIDE), root_count, self._callbacks[1])
        self._call("CVodeSetNoInactiveRootWarn", ())
        self._call("CVodeSetLinearSolver", (c_void_p, c_void_p), solver, matrix)
        self._run = self._function(
            "CVode", c_int, c_void_p, c_double, c_void_p, POINTER(c_double), c_int
        )
        self._set_stop_time = self._function("CVodeSetStopTime", c_int, c_void_p, c_double)

    def _owned(self, address: int, destructor: str) -> int:
        self._free.callback(self._function(destructor, None, c_void_p), address)
        return address

    def _call(self, name: str, kinds: tuple[Any, ...], *arguments: Any) -> None:
        if self._function(name, c_int, c_void_p, *kinds)(self._memory, *arguments) < 0:
            raise SolverError(self._message)

    def _store_message(
        self, _line: int, _function: bytes, _file: bytes, text: bytes, *_: Any
    ) -> None:
        self._message = (text or b"").decode("utf-8", "replace").strip()

    def restart(self, time: float, tolerance: float, absolute_tolerances: np.ndarray) -> None:
        """Forget the history and continue from the present states.

        Args:
            time: Present time (s).
            tolerance: Relative tolerance.
            absolute_tolerances: Absolute tolerances of the states, shape (n,).
        """
        self._absolute_tolerances[:] = absolute_tolerances
        self._call("CVodeReInit", (c_double, c_void_p), time, self._x)
        self._call("CVodeSVtolerances", (c_double, c_void_p), tolerance, self._tolerances)

    def step(self, stop_time: float) -> tuple[int, float]:
        """Make one internal step, not beyond `stop_time` (s).

        Returns:
            SUCCESS, STOP_TIME_REACHED or ROOT_FOUND, and the time reached (s), to which the states
            belong.

        Raises:
            SolverError: The step failed.
            BaseException: An evaluation raised this exception, or a signal arrived during it.
        """
        self._message = ""
        self._set_stop_time(self._memory, stop_time)
        with self._raising_exceptions_of_callbacks():
            flag = self._run(self._memory, stop_time, self._x, byref(self._time), _ONE_STEP)
        if flag < 0:
            raise SolverError(self._message)
        return flag, self._time.value

    @contextmanager
    def _raising_exceptions_of_callbacks(self) -> Iterator[None]:
        """Raise the first exception of a callback after the block, where ctypes would print it and continue."""
        hook, exceptions = sys.unraisablehook, []
        sys.unraisablehook = lambda failure: exceptions.append(failure.exc_value)
        try:
            yield
        finally:
            sys.unraisablehook = hook
        if exceptions:
            raise exceptions[0] or SolverError("a callback failed")

    def close(self) -> None:
        """Free the memory of the solver."""
        self._free.close()
