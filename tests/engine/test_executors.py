"""The two executors run the same plan, and every row is bit-identical."""

import random
import struct
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from fakes import FakeComponent, inputs
from systems import endpoint, make_system

from cosim.components.fmi import FmuFile, Isolation, create_component
from cosim.core.component import DTYPES, Variable
from cosim.core.errors import ComponentError
from cosim.core.system import FLOAT_TYPES, Connection, Endpoint, Group, System, incompatibility
from cosim.core.time_grid import TimeGrid, exact_fraction
from cosim.core.units import parse_unit
from cosim.engine import EXECUTORS, native_available, parallel
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.engine.thread_pool import ThreadPool
from cosim.process import journal

if native_available():
    from cosim.engine import _native

pytestmark = pytest.mark.skipif(not native_available(), reason="the native executor was not built")

NUMBERS = [name for name in DTYPES if name not in ("String", "Binary", "Clock")]
UNITS = {"rad": parse_unit("rad"), "deg": parse_unit("deg")}


def random_component(seed):
    """Return a component with an input and an output of every type; the outputs mix inputs and
    random numbers.
    """
    draw = random.Random(seed)  # noqa: S311
    variables = [
        Variable(
            f"{side}_{name}",
            name,
            causality,
            unit=UNITS[draw.choice(["rad", "deg"])] if name == "Float64" else None,
        )
        for name in [*NUMBERS, "String"]
        for side, causality in (("u", "input"), ("y", "output"))
    ]

    def step(values, _t, _h):
        for name in NUMBERS:
            values[f"y_{name}"] = _mixed(name, values[f"u_{name}"], draw)
        values["y_String"] = values["u_String"][-6:] + draw.choice("abc")

    return FakeComponent(variables, step)


def _mixed(name, value, draw):
    if name.startswith("Float"):
        return (
            float(np.float32(draw.uniform(-1, 1) + 0.5 * value))
            if name == "Float32"
            else draw.uniform(-1, 1) + 0.5 * value
        )
    if name == "Boolean":
        return bool(value) != (draw.random() < 0.5)
    if name == "Enumeration":
        return draw.randrange(-100, 100)
    bits = 8 * DTYPES[name].itemsize
    return draw.randrange(2**bits) - (0 if name.startswith("U") else 2 ** (bits - 1))


def random_system(seed, extra=()):
    """Return a system with random connections of all types, delays, gains, periods, stages and
    groups; and its output names.
    """
    draw = random.Random(seed)  # noqa: S311
    components = {f"m{i}": random_component(100 * seed + i) for i in range(5)} | dict(extra)
    ends: dict[str, list[Endpoint]] = {"input": [], "output": []}
    for name, component in components.items():
        for variable in component.variables:
            own = [Endpoint(name, scalar) for scalar in variable.scalar_names]
            ends.setdefault(variable.causality, []).extend(own)
    find_element = System(components).find_element
    connections = []
    for target in ends["input"]:
        sources = [
            e
            for e in ends["output"]
            if not incompatibility(find_element(e).variable, find_element(target).variable)
        ]
        if sources and draw.random() < 0.9:
            mapping = draw.choice(
                [{}, {"gain": -0.3}, {"offset": 0.7}, {"gain": 0.1, "offset": -0.2}]
            )
            is_float = find_element(target).variable.type in FLOAT_TYPES
            connections.append(
                Connection(
                    draw.choice(sources),
                    target,
                    draw.choice([0, 0, 0, 1, 3]),
                    **(mapping if is_float else {}),
                )
            )
    names = draw.sample(list(components), len(components))
    stages = ((names[0], Group("g", ((names[1],), (names[2], names[3])))), tuple(names[4:]))
    periods = {names[1]: exact_fraction(0.02), names[4]: exact_fraction(0.05)}
    return System(components, connections, stages, periods), [str(e) for e in ends["output"]]


def bits(recording):
    found = {"time": recording.time.tobytes()}
    for name, column in recording.columns.items():
        values = column.tolist()
        found[name] = [struct.pack("d", x) if isinstance(x, float) else x for x in values]
    return found


def recorded(kind, build, share=1.0, interval="1/100"):
    system, outputs = build()
    chosen = outputs[: max(1, int(share * len(outputs)))]
    settings = Settings(
        exact_fraction(0),
        exact_fraction(1),
        exact_fraction(0.01),
        {n: endpoint(n) for n in chosen},
        exact_fraction(interval),
        executor=kind,
    )
    outcome = simulate(system, settings)
    assert outcome.failure is None, outcome.failure
    return bits(outcome.recording)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(
    ("share", "interval"), [(1.0, "1/100"), (0.2, "3/100")], ids=["everything", "some"]
)
def test_random_systems_are_bit_identical(seed, share, interval):
    native, python = (
        recorded(kind, lambda: random_system(seed), share, interval)
        for kind in ("native", "python")
    )
    assert native == python


@pytest.mark.parametrize("seed", range(4))
def test_random_systems_with_foreign_fmus_are_bit_identical(seed, probes):
    def build(isolation=None):
        files = [FmuFile(path) for path in probes.values()] * 2
        fmus = {
            f"f{i}": create_component(file, f"f{i}", isolation=isolation)
            for i, file in enumerate(files)
        }
        return random_system(seed, fmus)

    def build_isolated():
        return build(Isolation())

    native = recorded("native", build)
    assert native == recorded("python", build)
    assert native == recorded("native", build_isolated)
    assert native == recorded("python", build_isolated)


@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize("seed", range(4))
def test_random_systems_with_fmus_on_threads_are_bit_identical(seed, kind, probes, monkeypatch):
    thread_pools = []

    def create_thread_pool(size):
        thread_pools.append(ThreadPool(size))
        return thread_pools[-1]

    monkeypatch.setattr("cosim.engine.thread_pool.ThreadPool", create_thread_pool)

    def build(parallel):
        files = [FmuFile(path) for path in probes.values()]
        built, outputs = random_system(
            seed, {f"f{i}": create_component(file, f"f{i}") for i, file in enumerate(3 * files)}
        )
        return replace(built, parallel=parallel), outputs

    assert recorded(kind, lambda: build(True)) == recorded(kind, lambda: build(False))
    assert len(thread_pools) == 1


@pytest.mark.parametrize("kind", EXECUTORS)
def test_an_output_that_is_not_finite_is_named_with_its_source(kind):
    def step(values, t, _h):
        values["y"] = float("nan") if t > 0.045 else 1.0

    def consume(values, t, _h):
        if values["u"] != values["u"]:
            raise ComponentError("b", "do_step", "cannot digest this", t)

    def built(*stages):
        a = FakeComponent([Variable("y", causality="output")], step)
        b = FakeComponent([Variable("u", causality="input", start=0.0)], consume)
        return System({"a": a, "b": b}, [Connection(endpoint("a.y"), endpoint("b.u"))], stages)

    for stages in ([("a", "b")], [("a",), ("b",)]):
        outcome = simulate(
            built(*stages),
            Settings(
                exact_fraction(0),
                exact_fraction(1),
                exact_fraction(0.01),
                {"a.y": endpoint("a.y")},
                executor=kind,
            ),
        )
        assert (
            str(outcome.failure)
            == 'a: do_step failed at t = 0.05 s: the output "y" is nan, and b.u reads it'
        )
        assert len(outcome.recording.time) == 6


@pytest.mark.parametrize("kind", EXECUTORS)
def test_of_several_outputs_that_are_not_finite_the_first_in_the_order_of_steps_is_named(kind):
    """The plant passes the controller's NaN on, and its connection comes first."""

    def control(values, t, _h):
        values["y"] = float("nan") if t > 0.045 else 1.0

    def plant(values, _t, _h):
        values["x"] = values["u"]

    def block(read, written, step):
        variables = [
            Variable(read, causality="input", start=0.0),
            Variable(written, causality="output"),
        ]
        return FakeComponent(variables, step)

    connections = [
        Connection(endpoint("plant.x"), endpoint("pi.e")),
        Connection(endpoint("pi.y"), endpoint("plant.u")),
    ]
    system = System(
        {"plant": block("u", "x", plant), "pi": block("e", "y", control)},
        connections,
        [("pi",), ("plant",)],
    )
    outcome = simulate(
        system,
        Settings(exact_fraction(0), exact_fraction(1), exact_fraction(0.01), {}, executor=kind),
    )
    assert str(outcome.failure).startswith(
        'pi: do_step failed at t = 0.05 s: the output "y" is nan'
    )


@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize("copies", [1, 300])
@pytest.mark.parametrize(
    ("type_", "largest"),
    [("Float64", np.finfo(np.float64).max), ("Float32", np.finfo(np.float32).max)],
)
def test_the_largest_floats_are_finite_and_the_next_ones_are_not(kind, copies, type_, largest):
    def built(last):
        def step(values, t, _h):
            values.update(
                dict.fromkeys(values, -float(largest))
                | {f"y{copies - 1}": last if t > 0.045 else 0.0}
            )

        names = [f"y{i}" for i in range(copies)]
        a = FakeComponent([Variable(name, type_, "output") for name in names], step)
        b = FakeComponent(
            [Variable(name, type_, "input", start=0.0) for name in names],
            lambda _values, _t, _h: None,
        )
        wires = [Connection(Endpoint("a", name), Endpoint("b", name)) for name in names]
        return System({"a": a, "b": b}, wires, [("a", "b")])

    settings = Settings(exact_fraction(0), exact_fraction(0.1), exact_fraction(0.01), executor=kind)
    assert simulate(built(float(largest)), settings).failure is None
    for last in (float("inf"), -float("inf"), float("nan")):
        y = f"y{copies - 1}"
        expected = (
            f'a: do_step failed at t = 0.05 s: the output "{y}" is {last}, and b.{y} reads it'
        )
        assert str(simulate(built(last), settings).failure) == expected


@pytest.mark.parametrize("kind", EXECUTORS)
def test_unconnected_outputs_may_be_infinite(kind):
    source = FakeComponent(
        [Variable("y", causality="output")], lambda v, _t, _h: v.update(y=float("inf"))
    )
    outcome = simulate(
        System({"a": source}, (), (("a",),)),
        Settings(
            exact_fraction(0),
            exact_fraction(1),
            exact_fraction(0.1),
            {"a.y": endpoint("a.y")},
            executor=kind,
        ),
    )
    assert outcome.failure is None
    assert np.isinf(outcome.recording.columns["a.y"][1:]).all()


@pytest.mark.parametrize("kind", EXECUTORS)
def test_rows_are_complete_when_they_need_several_chunks(kind, monkeypatch):
    monkeypatch.setattr("cosim.process.row_store.CHUNK_BYTES", 1000)
    monkeypatch.setattr("cosim.process.row_store.MAX_MEMORY_BYTES", 0)
    count = FakeComponent(
        [Variable("y", causality="output")],
        lambda v, _t, _h: v.update(y=v["y"] + 1),
        start={"y": 0.0},
    )
    outcome = simulate(
        System({"a": count}, (), (("a",),)),
        Settings(
            exact_fraction(0),
            exact_fraction(10000),
            exact_fraction(1),
            {"a.y": endpoint("a.y")},
            executor=kind,
        ),
    )
    assert outcome.recording.columns["a.y"].tolist() == list(range(10001))


def test_constants_of_the_native_module_are_those_of_python():
    assert parallel.MEASURED_STEPS == _native.MEASURED_STEPS
    markers = journal.CALL_NUMBER, journal.STEP_COUNT, journal.ROW_COUNT
    assert markers == (_native.MARKER_CALL, _native.MARKER_STEPS, _native.MARKER_ROWS)


def spoiled_source(type_="Float64", value=float("nan"), copies=1, spoiled=-1):
    """Return a component with the outputs y0, y1, ..., one of which has this value in steps that
    begin after 0.045 s.
    """
    variables = [Variable(f"y{i}", type_, "output") for i in range(copies)]

    def step(values, t, _h):
        values[variables[spoiled].name] = value if t > 0.045 else 1.0

    return FakeComponent(variables, step)


def fail_settings(kind, *recorded, **more):
    columns = {name: endpoint(name) for name in recorded}
    return Settings(
        Fraction(0),
        Fraction(1),
        Fraction(1, 100),
        columns,
        executor=kind,
        non_finite="fail",
        **more,
    )


@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize("copies", [1, 300])
@pytest.mark.parametrize("type_", ["Float64", "Float32"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_a_recorded_output_must_be_finite_on_request(kind, copies, type_, value):
    names = [f"a.y{i}" for i in range(copies)]
    outcome = simulate(
        make_system({"a": spoiled_source(type_, value, copies=copies)}), fail_settings(kind, *names)
    )
    text = f'the output "y{copies - 1}" is {value}, and is recorded for t = 0.06 s'
    assert str(outcome.failure) == f"a: do_step failed at t = 0.05 s: {text}"
    assert len(outcome.recording.time) == 6


@pytest.mark.parametrize("kind", EXECUTORS)
def test_the_time_is_exact_between_recorded_rows(kind):
    outcome = simulate(
        make_system({"a": spoiled_source()}),
        fail_settings(kind, "a.y0", record_interval=Fraction(1, 10)),
    )
    assert str(outcome.failure).endswith("is nan, and is recorded for t = 0.06 s")
    assert outcome.recording.time.tolist() == [0]


@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize("start", [-1, 2**24], ids=["exact terms", "terms above 2**53"])
def test_rows_have_the_times_of_the_grid(kind, start):
    grid = TimeGrid.from_times(
        Fraction(start), Fraction(start + 100), Fraction(1_000_000_007, 1_000_000_009)
    )
    assert (grid.coefficients(grid.count) is None) == (start > 0)
    source = FakeComponent([Variable("y0", causality="output")], lambda *_: None)
    settings = Settings(grid.start, grid.end, grid.step, {"a.y0": endpoint("a.y0")}, executor=kind)
    recorded = simulate(make_system({"a": source}), settings).recording.time
    assert recorded.tolist() == [grid.time_at(n) for n in range(grid.count + 1)]


@pytest.mark.parametrize("kind", EXECUTORS)
def test_initial_outputs_must_be_finite_on_request(kind):
    source = FakeComponent(
        [Variable("y0", causality="output")], lambda *_: None, start={"y0": float("inf")}
    )
    outcome = simulate(make_system({"a": source}), fail_settings(kind, "a.y0"))
    text = (
        'a: exit_initialization_mode failed at t = 0 s: the output "y0" is inf, and is recorded '
        "for t = 0.0 s"
    )
    assert (str(outcome.failure), len(outcome.recording.time)) == (text, 0)


@pytest.mark.parametrize("kind", EXECUTORS)
def test_an_output_that_is_neither_recorded_nor_connected_may_have_any_value(kind):
    """Its component binds all of its variables, so the value lies among the recorded ones."""
    source = spoiled_source(copies=3, spoiled=1)
    source.binds_everything = True
    assert simulate(make_system({"a": source}), fail_settings(kind, "a.y0", "a.y2")).failure is None


@pytest.mark.parametrize("kind", EXECUTORS)
def test_any_value_may_be_allowed(kind):
    reader = FakeComponent(inputs("u"), lambda *_: None)
    built = make_system({"a": spoiled_source(), "b": reader}, "a.y0 > b.u")
    outcome = simulate(built, replace(fail_settings(kind, "a.y0"), non_finite="allow"))
    assert outcome.failure is None
    assert np.isnan(outcome.recording.columns["a.y0"][6:]).all()
