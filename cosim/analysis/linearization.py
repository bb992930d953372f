"""Linearisation of a scenario or of some of its components at a point in time.

An FMU that offers directional derivatives gives the continuous model of itself. For all other
models, impulse responses from a saved state are measured and realized, so components need no access
to their states. The model then holds the states that the inputs reach and the outputs show.
"""

from collections.abc import Mapping, Sequence, Set
from itertools import chain
from typing import Any

import numpy as np

from ..core.errors import InputError
from .experiment import Channels, Experiment, Scenario
from .impulse_response import (
    Realization,
    measure_impulse_responses,
    misfit,
    realize,
    validity_notes,
)
from .linear_model import LinearModel

#: part of an output's row in C that no other output has, as a fraction of the row, from which it
#: counts as a state
_INDEPENDENT = 1e-6
#: feedthrough, as a fraction of the peak of the impulse response, that is rounding
_NO_FEEDTHROUGH = 1e-7
#: feedthrough, as a fraction of the peak of all impulse responses of an output, that is rounding
_ROUNDING = 1e-12


def linearize(
    scenario: Scenario,
    inputs: Sequence[str],
    outputs: Sequence[str],
    at: float | str | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    components: Sequence[str] = (),
    continuous: bool = False,
    duration: float | None = None,
    order: int | None = None,
) -> LinearModel:
    """Linearise a scenario, or some of its components, at a point in time.

    A discrete model has the common step of all components. Its outputs are those at the
    communication points, before the inputs of the following step act; an output with feedthrough is
    therefore a state. A continuous model is the one whose sampling with held inputs gives the
    discrete model.

    Args:
        scenario: Path of a scenario file, name of a shipped scenario, or the content of a scenario
            file as a dict.
        inputs: Names of inputs, tunable parameters or connected outputs. A value is added to a
            connected input after its connection; the loop remains closed.
        outputs: Names or patterns of outputs. If they are enough, the states of the model are
            outputs, in the given order.
        at: Point in time (s); None: the start time.
        parameters: Values that replace those of the scenario, see `cosim.load`.
        components: Components that step; the others hold their outputs, which opens the loops
            through them. None: all.
        continuous: Return a continuous model, by directional derivatives of a single component,
            else by the matrix logarithm.
        duration: Duration of the impulse responses (s); None: 256 samples.
        order: Largest number of states; None: as many as the responses show.

    Raises:
        InputError: The scenario cannot be run, a name is unknown, a component cannot return to a
            state, or there is no continuous model.
        ComponentError: A component failed.
    """
    with Experiment(scenario, parameters, at, duration) as experiment:
        channels, names = experiment.find_inputs(inputs), experiment.find_outputs(outputs)
        active = experiment.find_components(components) if components else None
        if continuous and (
            exact := by_directional_derivatives(experiment, channels, names, active)
        ):
            return exact
        experiment.choose(channels, names, active)
        responses = measure_impulse_responses(experiment, len(channels))
    held = responses.outputs[1:]
    realization = realize(held if continuous else responses.outputs, order, responses.variation)
    error = misfit(realization, held if continuous else responses.outputs)
    text = f"the model reproduces the measured responses only to {error:.2g} of their peak"
    notes = validity_notes(responses.nonlinearity, error, text)
    if continuous:
        realization = to_continuous(realization, experiment.step)
        peaks = np.abs(held).max(0)
        realization.d[
            np.abs(realization.d)
            < np.maximum(_NO_FEEDTHROUGH * peaks, _ROUNDING * peaks.max(1)[:, None])
        ] = 0
    realization, states = _with_outputs_as_states(realization, names)
    step = None if continuous else experiment.step
    return LinearModel(*realization, list(channels), names, states, step, experiment.time, notes)


def by_directional_derivatives(
    experiment: Experiment, channels: Channels, outputs: Sequence[str], active: Set[str] | None
) -> LinearModel | None:
    """Return the continuous model of one component whose FMU offers directional derivatives.

    None for any other.

    Args:
        experiment: The scenario at its operating point.
        channels: Targets of the inputs, by their names.
        outputs: Names of the outputs.
        active: Names of the components; None: all.
    """
    names = set(experiment.prepared.system.components) if active is None else active
    component = next(iter(names))
    states = dict(experiment.prepared.system.components[component].continuous_states)
    targets = list(chain.from_iterable(channels.values()))
    own_outputs = [
        each.removeprefix(f"{component}.") for each in outputs if each.startswith(f"{component}.")
    ]
    is_own = len(targets) == len(channels) and all(
        each.endpoint.component == component for each in targets
    )
    if len(names) > 1 or not states or not is_own or len(own_outputs) < len(outputs):
        return None
    unknowns, knowns = (
        [*states.values(), *own_outputs],
        [*states, *(each.endpoint.scalar for each in targets)],
    )
    found = experiment.directional_derivatives(component, unknowns, knowns)
    if found is None:
        return None
    n = len(states)
    matrices = found[:n, :n], found[:n, n:], found[n:, :n], found[n:, n:]
    state_names = [f"{component}.{name}" for name in states]
    return LinearModel(*matrices, list(channels), list(outputs), state_names, None, experiment.time)


def to_continuous(realization: Realization, step: float) -> Realization:
    """Return the continuous model of a sampled one.

    Sampled with inputs held for a step, it has outputs at the end of each step.

    Args:
        realization: Its outputs belong to the end of the step in which its inputs act.
        step: Step (s).

    Raises:
        InputError: The model has a pole at 0 or on the negative real axis.
    """
    from scipy.linalg import logm

    poles = np.linalg.eigvals(realization.a)
    if bad := [
        pole for pole in poles if abs(pole) < 1e-8 or (pole.real < 0 and abs(pole.imag) < 1e-8)
    ]:
        found = f"the discrete model has a pole at {bad[0].real:.3g}"
        raise InputError(
            f"no continuous model: {found}, as those of discrete controllers and of delays do; "
            "expected the discrete one"
        )
    states, inputs = realization.b.shape
    held = np.block([[realization.a, realization.b], [np.zeros((inputs, states)), np.eye(inputs)]])
    rates = np.real(logm(held)) / step
    c = np.linalg.solve(realization.a.T, realization.c.T).T
    return Realization(
        rates[:states, :states], rates[:states, states:], c, realization.d - c @ realization.b
    )


def _with_outputs_as_states(
    realization: Realization, names: Sequence[str]
) -> tuple[Realization, list[str]]:
    """Return the realization with outputs as states if there are enough, and their names."""
    # Rows of C are taken in their order while they are linearly independent of those before
    # (Gram-Schmidt process, done twice against rounding). Together they are the change of basis.
    order = len(realization.a)
    chosen: list[int] = []
    basis = np.zeros((0, order))
    for i, row in enumerate(realization.c):
        length = float(np.linalg.norm(row))
        rest = row - basis.T @ (basis @ row)
        rest -= basis.T @ (basis @ rest)
        if (
            len(chosen) < order
            and length
            and np.linalg.norm(rest) > _INDEPENDENT * length
            and not realization.d[i].any()
        ):
            chosen.append(i)
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
    if len(chosen) < order:
        return realization, [f"x{i + 1}" for i in range(order)]
    a, b, c, d = realization
    change = c[chosen]
    back = np.linalg.inv(change)
    states = Realization(change @ a @ back, change @ b, c @ back, d)
    states.c[chosen] = np.eye(order)
    return states, [names[i] for i in chosen]
