"""`cosim new controller --library`: a speed controller around LimPID flies demo1.

Without the Standard Library in MODELICAPATH, a small library with a block of the same name and
parameters replaces it.
"""

from __future__ import annotations

import json
import os
from contextlib import chdir

import pytest
from click.testing import CliRunner

import cosim
from cosim.cli import cli

#: a variable of the library block
INTERNAL = "usv.speed.pid.limiter.u"

LIBRARY = """package Modelica "Blocks that the template uses"
  package Blocks
    package Types
      type SimpleController = enumeration(P, PI, PD, PID);
    end Types;
    package Interfaces
      connector RealInput = input Real;
      connector RealOutput = output Real;
      partial block SVcontrol
        RealInput u_s;
        RealInput u_m;
        RealOutput y;
      end SVcontrol;
    end Interfaces;
    package Nonlinear
      block Limiter
        parameter Real uMax(start = 1);
        parameter Real uMin = -uMax;
        Interfaces.RealInput u;
        Interfaces.RealOutput y;
      equation
        assert(uMax >= uMin, "Limits must be consistent, found uMax = " + String(uMax));
        y = smooth(0, if u > uMax then uMax elseif u < uMin then uMin else u);
      end Limiter;
    end Nonlinear;
    package Continuous
      block LimPID
        extends Interfaces.SVcontrol;
        parameter Types.SimpleController controllerType = Types.SimpleController.PID;
        parameter Real k = 1;
        parameter Real Ti(unit = "s", start = 0.5);
        parameter Real Ni(min = 1e-9) = 0.9;
        parameter Real yMax(start = 1);
        parameter Real yMin = -yMax;
        Nonlinear.Limiter limiter(uMax = yMax, uMin = yMin);
      protected
        parameter Boolean with_I = controllerType == Types.SimpleController.PI;
        Real x(start = 0, fixed = true);
      equation
        der(x) = if with_I then (u_s - u_m + (y - limiter.u)/(k*Ni))/Ti else 0;
        limiter.u = k*(u_s - u_m + x);
        connect(limiter.y, y);
      end LimPID;
    end Continuous;
  end Blocks;
  annotation(version = "4.1.0");
end Modelica;
"""


@pytest.fixture
def library(tmp_path, monkeypatch):
    if not os.environ.get("MODELICAPATH"):
        (tmp_path / "libraries").mkdir()
        (tmp_path / "libraries" / "Modelica.mo").write_text(LIBRARY)
        monkeypatch.setenv("MODELICAPATH", str(tmp_path / "libraries"))


def new_controller(*arguments: str):
    return CliRunner().invoke(cli, ["new", "controller", "my_speed", *arguments])


@pytest.mark.usefixtures("library")
def test_a_controller_around_the_library_pid_flies_demo1(tmp_path):
    with chdir(tmp_path):
        made = new_controller("--language", "modelica", "--library")
    assert made.exit_code == 0, made.output
    assert sorted(path.name for path in (tmp_path / "my_speed").iterdir()) == [
        "MySpeed.mo", "autopilot.json", "fmus", "my_speed.json", "test_my_speed.py",
    ]  # fmt: skip
    scenario = tmp_path / "my_speed" / "my_speed.json"
    keys = json.loads(scenario.read_text()) | {
        "record": {"signals": ["plant.*", "uav.*", "usv.*", INTERNAL]}
    }
    scenario.write_text(json.dumps(keys))
    result = cosim.run(scenario)
    assert [check.name for check in result.checks if not check.passed] == []
    assert result[INTERNAL].max() > 3  # before the limit


def test_other_languages_have_no_library(tmp_path):
    with chdir(tmp_path):
        made = new_controller("--language", "python", "--library")
    assert "--library needs --language modelica" in str(made.exception)
