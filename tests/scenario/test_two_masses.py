"""Two coupled masses, each solved exactly for linear inputs: only the error of the coupling
remains.

The errors of each coupling were computed by two programs independent of cosim; the reference
solution is the exponential of the matrix of the whole system.
"""

import numpy as np
import pytest
from probe_fmus import build_probe_fmu
from scipy.linalg import expm
from systems import connection

import cosim
from cosim.engine import EXECUTORS

STEPS = [0.02, 0.01, 0.005, 0.0025, 0.00125]
#: largest difference of a displacement (m) to the exact solution within 10 s, for each of the
#: steps, and the order
ERRORS = {
    "Jacobi, hold": ([3.89e-1, 2.05e-1, 1.11e-1, 5.83e-2, 3.00e-2], 1),
    "Jacobi, linear": ([3.25e-2, 8.15e-3, 2.04e-3, 5.09e-4, 1.27e-4], 2),
    "Gauss-Seidel, hold": ([8.12e-2, 4.07e-2, 2.04e-2, 1.02e-2, 5.09e-3], 1),
    "Gauss-Seidel, linear": ([1.30e-2, 3.26e-3, 8.17e-4, 2.04e-4, 5.11e-5], 2),
    "iterated, linear": ([6.51e-3, 1.63e-3, 4.07e-4, 1.02e-4, 2.54e-5], 2),
}
#: the first steps of Jacobi's scheme with held inputs have the order 0.92
ORDER_TOLERANCE = 0.12


@pytest.fixture(scope="session")
def mass(tmp_path_factory):
    return build_probe_fmu(2, tmp_path_factory.mktemp("mass"), name="mass")


def algorithm(scheme):
    stages = [["one"], ["two"]] if scheme == "Gauss-Seidel" else [["one", "two"]]
    return {
        "stages": stages,
        **({"iteration": {"tolerance": 1e-8}} if scheme == "iterated" else {}),
    }


def displacements(folder, mass, coupling, step, stop_time=10, **more):
    scheme, interpolation = coupling.split(", ")
    pairs = [("one", "two"), ("two", "one")]
    wires = [
        connection(f"{a}.{y}", f"{b}.{u}", interpolation=interpolation)
        for a, b in pairs
        for y, u in ("xu", "vw")
    ]
    parts = {
        "one": {"fmu": str(mass), "parameters": {"x_start": 1.0, **more}},
        "two": {"fmu": str(mass), "parameters": more},
    }
    file = folder.scenario(
        parts, wires, stop_time=stop_time, step_size=step, algorithm=algorithm(scheme)
    )
    result = cosim.run(file, isolation="none")
    return np.column_stack(
        [result[f"{name}.{signal}"] for name in ("one", "two") for signal in "xv"]
    )


def exact(step, count):
    matrix = np.array([[0, 1, 0, 0], [-40, -0.3, 30, 0.2], [0, 0, 0, 1], [30, 0.2, -40, -0.3]])
    values, vectors = np.linalg.eig(matrix)
    transition = (vectors @ np.diag(np.exp(values * step)) @ np.linalg.inv(vectors)).real
    rows = [np.array([1.0, 0, 0, 0])]
    for _ in range(count):
        rows.append(transition @ rows[-1])
    return np.array(rows)


def error(folder, mass, coupling, step):
    found = displacements(folder, mass, coupling, step)
    return np.abs(found - exact(step, len(found) - 1))[:, ::2].max()


@pytest.mark.parametrize("count", [2, pytest.param(len(STEPS), marks=pytest.mark.long)])
@pytest.mark.parametrize("coupling", ERRORS)
def test_the_errors_and_orders_are_those_of_the_coupling(folder, mass, coupling, count):
    expected, order = ERRORS[coupling]
    found = [error(folder, mass, coupling, step) for step in STEPS[:count]]
    np.testing.assert_allclose(found, expected[:count], rtol=0.05)
    np.testing.assert_allclose(
        np.log2(np.divide(found[:-1], found[1:])), order, atol=ORDER_TOLERANCE
    )


@pytest.mark.parametrize("coupling", ERRORS)
def test_both_executors_couple_alike(folder, mass, sloped_mass, coupling, monkeypatch):
    found = []
    for kind in EXECUTORS.values():
        monkeypatch.setattr("cosim.engine.plan_run.executor_class", lambda _, kind=kind: kind)
        found.append(
            [
                displacements(folder, fmu, coupling, 0.02, stop_time=1).tolist()
                for fmu in (mass, sloped_mass)
            ]
        )
    assert found[0] == found[1]


@pytest.fixture(scope="session")
def sloped_mass(tmp_path_factory):
    return build_probe_fmu(
        2, tmp_path_factory.mktemp("slopes"), name="mass", flags='maxOutputDerivativeOrder="1"'
    )


def along_tangents(step, count):
    """Return x and v of both masses if each sees the tangents of the other's displacement and
    velocity, without cosim.
    """
    one = np.zeros((6, 6))  # x, v, and of the other mass: x, v and their slopes
    one[0, 1] = one[2, 4] = one[3, 5] = 1
    one[1, :4] = -40, -0.3, 30, 0.2
    transition = expm(one * step)
    rows = [np.array([[1.0, 0.0], [0.0, 0.0]])]
    seen = rows[0][::-1]  # the values of the other mass that belong to the forces
    for _ in range(count):
        slopes = np.column_stack([rows[-1][:, 1], (np.hstack([rows[-1], seen]) @ one[1, :4])])
        inputs = np.hstack([rows[-1][::-1], slopes[::-1]])
        rows.append((np.hstack([rows[-1], inputs]) @ transition.T)[:, :2])
        seen = inputs[:, :2] + step * inputs[:, 2:]
    return np.array(rows).reshape(-1, 4)


@pytest.mark.parametrize("step", STEPS[:2])
def test_outputs_with_derivatives_are_extrapolated_along_their_tangents(
    folder, mass, sloped_mass, step
):
    found = displacements(folder, sloped_mass, "Jacobi, linear", step)
    np.testing.assert_allclose(found, along_tangents(step, len(found) - 1), rtol=0, atol=1e-12)
    tangents, secants = (error(folder, fmu, "Jacobi, linear", step) for fmu in (sloped_mass, mass))
    assert tangents / secants == pytest.approx(0.4, abs=0.1)  # of the cubic terms 1/6 and 5/12


@pytest.mark.parametrize("coupling", ["Gauss-Seidel, linear", "iterated, linear"])
def test_known_values_at_both_ends_are_better_than_tangents(folder, mass, sloped_mass, coupling):
    """Inputs whose source has stepped before pass through both values."""
    second = [
        displacements(folder, fmu, coupling, 0.02, stop_time=1) for fmu in (sloped_mass, mass)
    ]
    if coupling.startswith("iterated"):
        assert second[0].tolist() == second[1].tolist()
    else:
        assert np.abs(second[0] - exact(0.02, 50)).max() < np.abs(second[1] - exact(0.02, 50)).max()


def test_gauss_seidel_with_hold_conserves_the_energy(folder, mass):
    """Without dampers, each half step conserves the energy with the other mass at rest."""
    x1, v1, x2, v2 = displacements(folder, mass, "Gauss-Seidel, hold", 0.01, d=0.0, dk=0.0).T
    energy = (v1**2 + v2**2 + 10 * x1**2 + 10 * x2**2 + 30 * (x1 - x2) ** 2) / 2
    assert energy[0] == pytest.approx(20.0)
    assert energy[-1] / energy[0] - 1 == pytest.approx(0.0, abs=2e-12)


def test_an_isolated_fmu_interpolates_alike(folder, mass):
    parts = {
        name: {"fmu": str(mass), "isolation": "fmu", "parameters": {"x_start": x}}
        for name, x in (("one", 1.0), ("two", 0.0))
    }
    wires = [
        connection(f"{a}.{y}", f"{b}.{u}", interpolation="linear")
        for a, b in (("one", "two"), ("two", "one"))
        for y, u in ("xu", "vw")
    ]
    file = folder.scenario(
        parts, wires, stop_time=1, step_size=0.02, algorithm={"stages": [["one"], ["two"]]}
    )
    isolated = cosim.run(file)["one.x"]
    for part in parts.values():
        del part["isolation"]
    file = folder.scenario(
        parts, wires, stop_time=1, step_size=0.02, algorithm={"stages": [["one"], ["two"]]}
    )
    assert isolated.tolist() == cosim.run(file)["one.x"].tolist()


def test_linear_inputs_need_a_component_that_interpolates(folder, mass):
    parts = {"m": {"fmu": str(mass)}, "g": folder.block("Gain")}
    wires = [
        connection("m.x", "g.u", interpolation="linear"),
        connection("g.y", "m.u", interpolation="linear", delay=1),
    ]
    first, second = folder.problems(parts, wires)
    assert first.endswith(
        'm.x cannot feed g.u: "interpolation" is "linear", but "g" does not interpolate its inputs '
        "(FMI: canInterpolateInputs)"
    )
    assert second.endswith(
        '"interpolation" is "linear", so it cannot have a delay or be part of a sum'
    )
    parts["g"]["period"] = 2
    (line,) = folder.problems(
        parts, [connection("g.y", "m.u", interpolation="linear")], stop_time=4
    )
    assert line.endswith(
        '"interpolation" is "linear", so both components must step in every macro step'
    )
