"""Rules for the calls of an importer, checked from the record of calls: FMI 2.0 section 4.2.4, FMI
3.0 sections 2.3 and 4.2.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

WARNING, ERROR, FATAL = 1, 3, 4
#: what is still allowed after an error
AFTER_ERROR = ("FreeInstance", "Reset", "SetFMUstate", "SetFMUState")
#: letters of the life cycle: instantiate, set, get, setup, enter and exit initialization, step,
#: terminate, free, logging
CALL_LETTERS = {
    "Instantiate": "I",
    "SetupExperiment": "u",
    "SetDebugLogging": "l",
    "EnterInitializationMode": "E",
    "ExitInitializationMode": "X",
    "DoStep": "D",
    "Terminate": "T",
    "FreeInstance": "F",
}
LIFE_CYCLE = {
    2: re.compile(r"I[sl]*u[s]*E[sg]*Xg*(s*Dg*)*s*TF"),
    3: re.compile(r"I[sl]*E[sg]*Xg*(s*Dg*)*s*TF"),
}


def calls(lines: Iterable[str]) -> Iterator[tuple[str, str]]:
    """(instance or "-" before there is one, function without prefix) of every call; ("...", "status
    N") of every bad return.
    """
    for line in lines:
        words = line.split()
        if len(words) > 2 and words[1] == "status":
            yield words[0], f"status {words[2]}"
        elif len(words) > 1 and words[1].startswith("fmi"):
            yield words[0], words[1][4:]


def letter(function: str) -> str:
    name = function.removesuffix("CoSimulation")
    return CALL_LETTERS.get(name) or {"Set": "s", "Get": "g"}.get(name[:3], "?")


def life_cycle(lines: Iterable[str]) -> str:
    """The life of the FMU's only instance as a word of letters."""
    return "".join(
        letter(function)
        for _, function in calls(lines)
        if not function.startswith(("status", "GetTypes", "GetVersion"))
    )


def violations(lines: Sequence[str]) -> list[str]:
    """Every call that a rule forbids; empty for an obedient importer."""
    return [*_after_bad_status(lines), *_get_after_set(lines), *_time_violations(lines)]


def _after_bad_status(lines: Sequence[str]) -> Iterator[str]:
    """After fatal nothing on any instance, after an error little on that one, after NULL nothing on
    the one not made.
    """
    dead, failed = False, set()
    for who, what in calls(lines):
        if what.startswith("status"):
            status = int(what.split()[1])
            dead = dead or status == FATAL or (who == "-" and status > WARNING)
            failed |= {who} if status == ERROR else set()
        elif dead:
            yield f"{who}: {what} after fatal or NULL"
        elif who in failed and what not in AFTER_ERROR:
            yield f"{who}: {what} after an error"


def _get_after_set(lines: Sequence[str]) -> Iterator[str]:
    """In step mode no Get before the DoStep that follows a Set."""
    changed: dict[str, bool] = {}
    for who, what in calls(lines):
        if what == "ExitInitializationMode" or what == "DoStep":
            changed[who] = False
        elif what.startswith("Set") and who in changed:
            changed[who] = True
        elif letter(what) == "g" and changed.get(who) and "Status" not in what:
            yield f"{who}: {what} after a Set without DoStep"


def _time_violations(lines: Sequence[str]) -> Iterator[str]:
    """Each step starts where the last one ended, to the last bit of one addition."""
    ends: dict[str, float] = {}
    for line in lines:
        if found := re.match(r"(\S+) fmi\dDoStep t=(\S+) h=(\S+)", line):
            who, t, h = found[1], float(found[2]), float(found[3])
            if who in ends and abs(t - ends[who]) > 1e-12:
                yield f"{who}: DoStep at {t!r}, the last one ended at {ends[who]!r}"
            ends[who] = t + h
