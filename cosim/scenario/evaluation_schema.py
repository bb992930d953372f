"""Data model of the evaluation of a result in scenario files: functions, checks and references."""

from __future__ import annotations

from typing import Any

from pydantic import ConfigDict, model_validator

from .schema_types import INVALID, BoolOrNumber, FilePath, FileReference, Name, NameList, Spec, key

#: the rules of `CheckSpec._check_bounds` that JSON Schema can express
_CHECK_RULES: dict[str, Any] = {
    "anyOf": [
        {"required": [bound], "properties": {bound: {"not": {"type": "null"}}}}
        for bound in ("min", "max", "equals")
    ]
}


class CallSpec(Spec):
    """A Python function that is called with the scenario as its first argument."""

    python: FileReference = key('"file.py:function" or "package.module:function"', "cosim.kpis:rms")
    arguments: dict[str, Any] = key(
        'keyword arguments of the function; {"from": "usv.waypoint_x"} is the value of a '
        "parameter, and "
        '{"from": "/components/plant/arguments/platforms"} that of an entry of the scenario',
        {"signal": "plant.uav.position.z", "target": 2.0},
        default={},
    )
    sources: NameList = key(
        'components ("usv"), prefixes of variables ("plant.uav") or JSON pointers of objects, '
        "from which arguments that are not "
        "given are taken by name",
        "usv",
        default=[],
        alias="from",
    )


class FunctionSpec(CallSpec):
    """A Python function that is called with the result.

    A KPI returns numbers, a figure returns a matplotlib Figure.
    """

    name: Name = key(
        "unique name; that of a KPI is the prefix of its values, that of a figure the file name",
        "altitude",
    )
    optional: bool = key(
        "leave it out with a warning if an argument names a signal or parameter that does not "
        "exist",
        True,
        default=False,
    )


class CheckSpec(Spec):
    """A requirement on a KPI value; a run passes if all its checks pass."""

    model_config = ConfigDict(json_schema_extra=_CHECK_RULES)

    kpi: str = key("name of a KPI value", "landing.lateral_error")
    min: float | None = key("smallest value that passes", 0.0, unit="that of the KPI", default=None)
    max: float | None = key("largest value that passes", 0.1, unit="that of the KPI", default=None)
    equals: BoolOrNumber | None = key(
        "the only value that passes", True, unit="that of the KPI", default=None
    )

    @model_validator(mode="after")
    def _bounded(self) -> CheckSpec:
        if self is not INVALID:
            self._check_bounds()
        return self

    def _check_bounds(self) -> None:
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError('expected "min" to be at most "max"')
        if self.min is None and self.max is None and self.equals is None:
            raise ValueError('expected at least one of "min", "max", "equals"')


class ToleranceSpec(Spec):
    """Half width of the tolerance tube around a reference signal."""

    absolute: float = key(
        "along the axis of values", 0.01, unit="that of the signal", default=0.0, ge=0
    )
    relative: float = key(
        "fraction of the range (maximum - minimum) of the reference signal",
        0.05,
        unit="1",
        default=0.0,
        ge=0,
    )
    time: float = key("along the time axis", 0.02, unit="s", default=0.0, ge=0)


class ReferenceSpec(Spec):
    """A recorded trajectory with which `cosim compare` and `cosim regress` compare the result."""

    file: FilePath = key("path of a CSV file with recorded signals", "references/demo1_box.csv")
    tolerances: dict[str, ToleranceSpec] = key(
        "tolerances by pattern; only matching signals are compared",
        {"plant.*.position.*": {"absolute": 0.01, "time": 0.02}},
    )
    reason: str = key(
        "why the tolerances are as they are", "a tenth of the size of the deck", default=""
    )
