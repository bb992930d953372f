"""Snapshots restore the state of Python objects in place."""

import random
from collections import deque

import numpy as np

from cosim.components.object_state import snapshot


class Filter:
    def __init__(self):
        self.past, self.weights, self.names = (
            deque([1.0, 2.0], maxlen=2),
            np.array([0.5, 0.5]),
            {"a", "b"},
        )

    def __call__(self, u):
        self.past.append(u)
        self.weights *= 0.9
        return float(self.weights @ self.past)


class Controller:
    def __init__(self):
        self.last, self.filter, self.table = 0.0, Filter(), {"gains": [1.0, [2.0]]}
        self.noise, self.draws = random.Random(7), np.random.default_rng(7)  # noqa: S311 - seeded for reproducible results
        self.weights = self.filter.weights
        self.self = self

    def step(self, u):
        change, self.last = u - self.last, u
        self.table["gains"][1][0] += change
        self.table.setdefault("calls", []).append(u)
        return (
            self.filter(u) + self.table["gains"][1][0] + self.noise.random() + self.draws.normal()
        )

    def replace_attributes(self):
        del self.filter.names
        self.extra = 1


def test_a_restored_object_computes_the_same_results():
    controller = Controller()
    controller.step(0.3)
    restore = snapshot(controller)
    first = [controller.step(u) for u in (1.0, 2.0, 4.0)]
    for _ in range(2):
        controller.replace_attributes()
        restore()
        assert controller.filter.names == {"a", "b"}
        assert not hasattr(controller, "extra")
        assert controller.table == {"gains": [1.0, [2.3]], "calls": [0.3]}
        assert [controller.step(u) for u in (1.0, 2.0, 4.0)] == first


def test_references_to_parts_stay_valid():
    controller = Controller()
    inner, weights, gains = controller.filter, controller.weights, controller.table["gains"]
    restore = snapshot(controller)
    controller.filter, controller.weights, controller.table = Filter(), np.zeros(2), {}
    inner(5.0)
    gains.clear()
    restore()
    assert controller.filter is inner
    assert controller.weights is weights is inner.weights
    assert controller.table["gains"] is gains
    assert (list(inner.past), weights.tolist(), gains) == ([1.0, 2.0], [0.5, 0.5], [1.0, [2.0]])


def test_excluded_attributes_are_not_restored():
    controller = Controller()
    restore = snapshot(controller, {"last"})
    controller.step(3.0)
    restore()
    assert controller.last == 3.0
    assert controller.table == {"gains": [1.0, [2.0]]}
