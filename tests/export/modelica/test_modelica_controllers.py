"""Complete controllers: generated C code compared with the interpreter, and a cascade compared with
a NumPy reference.

Inputs are random, parameters are random or default, and all outputs must be bit-identical.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

CONTROLLERS = sorted((Path(__file__).parents[3] / "controllers" / "modelica").glob("*.mo"))
TICKS = 500


@pytest.mark.parametrize("path", CONTROLLERS, ids=lambda path: path.stem)
def test_shipped_controllers_agree_with_the_interpreter(compile_both, path):
    """Run 10 ticks with default parameters, then 50 ticks with random ones."""
    model = compile_both(path)
    model.initialize()
    assert len(list(model.run(10))) == 10
    rng = np.random.default_rng(1)
    for parameter in model.c.block.variables:
        if parameter.causality == "parameter" and parameter.type == "Float64":
            value = np.asarray(parameter.start, float).reshape(parameter.shape) * rng.uniform(
                0.7, 1.4
            )
            model.c.set(parameter.name, value)
            model.python.set(parameter.name, value)
    model.initialize()
    assert len(list(model.run(50, seed=1))) == 50


PID = """package P
  function limit
    input Real v;
    input Real lo;
    input Real hi;
    output Real y;
  algorithm
    y := min(hi, max(lo, v));
  end limit;
  block Pid
    parameter Real kp = 1;
    parameter Real ki = 0.5;
    parameter Real kd = 0.1;
    parameter Real nd = 50;
    parameter Real uMax = 2;
    final parameter Real alpha = 1 - exp(-nd*0.01);
    input Real e;
    input Boolean reset;
    output Real u(start = 0, fixed = true);
  protected
    discrete Real i(start = 0, fixed = true);
    discrete Real f(start = 0, fixed = true);
    discrete Real v(start = 0, fixed = true);
  algorithm
    when sample(0, 0.01) then
      f := if reset then e else pre(f) + alpha*(e - pre(f));
      v := kp*e + pre(i) + kd*nd*(e - f);
      u := limit(v, -uMax, uMax);
      if reset then
        i := 0;
      elseif not (abs(v) > uMax and v*e > 0) then
        i := pre(i) + ki*0.01*e;
      end if;
    end when;
  end Pid;
  block Axis
    parameter Real vMax = 1;
    parameter Real gain = 1;
    input Real error;
    input Real velocity;
    input Boolean reset;
    output Real command;
    Pid position(final uMax = vMax, final kp = gain);
    Pid speed(kd = 0.02);
  equation
    position.e = error;
    speed.e = position.u - velocity;
    position.reset = reset;
    speed.reset = reset;
    command = speed.u;
  end Axis;
end P;
model Cascade
  parameter Real vMax = 1;
  parameter Real gain[3] = {1, 2, 3};
  input Real position[3];
  input Real velocity[3];
  input Real reference[3];
  input Boolean reset;
  output Real command[3];
  P.Axis x(vMax = vMax, gain = gain[1]);
  P.Axis y(vMax = vMax, gain = gain[2]);
  P.Axis z(vMax = vMax, gain = gain[3]);
equation
  x.error = reference[1] - position[1];
  y.error = reference[2] - position[2];
  z.error = reference[3] - position[3];
  x.velocity = velocity[1];
  y.velocity = velocity[2];
  z.velocity = velocity[3];
  x.reset = reset;
  y.reset = reset;
  z.reset = reset;
  command = {x.command, y.command, z.command};
end Cascade;"""


class Pid:
    """Reference implementation of the PID controller in the cascade."""

    def __init__(self, kp=1.0, ki=0.5, kd=0.1, nd=50.0, limit=2.0):
        self.kp, self.ki, self.kd, self.nd, self.limit = kp, ki, kd, nd, limit
        self.alpha = 1 - math.exp(-nd * 0.01)
        self.integral = self.filtered = 0.0

    def __call__(self, error: float, reset: bool) -> float:
        self.filtered = error if reset else self.filtered + self.alpha * (error - self.filtered)
        unlimited = self.kp * error + self.integral + self.kd * self.nd * (error - self.filtered)
        saturated = abs(unlimited) > self.limit and unlimited * error > 0
        if reset:
            self.integral = 0.0
        elif not saturated:
            self.integral += self.ki * 0.01 * error
        return min(self.limit, max(-self.limit, unlimited))


def test_a_cascade_of_pid_controllers_against_numpy(compile_both):
    model = compile_both(PID)
    gains, v_max, nd = [1.3, 0.4, 2.2], 1.7, 33.0
    model.set(gain=gains, vMax=v_max)
    model.set(x__speed__nd=nd, y__speed__nd=nd, z__speed__nd=nd)
    outer = [Pid(kp=gain, limit=v_max) for gain in gains]
    inner = [Pid(kd=0.02, nd=nd) for _ in gains]
    model.initialize()
    for tick in range(400):
        inputs = model.randomize(tick)
        inputs["reset"] = tick % 97 == 0
        model.set(reset=inputs["reset"])
        model.step(tick * 0.01)
        for k in range(3):
            speed = outer[k](inputs["reference"][k] - inputs["position"][k], inputs["reset"])
            assert model.get("command")[k] == inner[k](
                speed - inputs["velocity"][k], inputs["reset"]
            )


GUIDANCE = """package P
  function wrapAngle
    input Real a;
    output Real b;
  algorithm
    b := atan2(sin(a), cos(a));
  end wrapAngle;
end P;
model Guidance
  parameter Integer count(min = 1, max = 8) = 4;
  parameter Real wx[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  parameter Real wy[8] = {0, 1, 0, 1, 0, 1, 0, 1};
  parameter Real radius = 0.5;
  parameter Boolean repeat = false;
  input Real x;
  input Real y;
  input Real psi;
  output Integer active(start = 1, fixed = true);
  output Boolean finished(start = false, fixed = true);
  output Real error(start = 0, fixed = true);
protected
  discrete Real distance(start = 0, fixed = true);
algorithm
  when sample(0, 0.01) then
    distance := sqrt((wx[active] - x)^2 + (wy[active] - y)^2);
    if distance <= radius then
      if active < count then
        active := active + 1;
      elseif repeat then
        active := 1;
      else
        finished := true;
      end if;
    end if;
    error := if finished then 0 else P.wrapAngle(atan2(wy[active] - y, wx[active] - x) - psi);
  end when;
end Guidance;"""


@pytest.mark.parametrize("repeat", [False, True])
def test_waypoint_guidance_against_numpy(compile_both, repeat):
    model = compile_both(GUIDANCE)
    rng = np.random.default_rng(3)
    wx, wy = rng.uniform(-2, 2, 8), rng.uniform(-2, 2, 8)
    model.set(wx=wx, wy=wy, count=6, radius=0.8, repeat=repeat)
    model.initialize()
    active, finished, switches = 0, False, 0
    for tick in range(TICKS):
        i = model.randomize(tick)
        model.step(tick * 0.01)
        if math.sqrt((wx[active] - i["x"]) ** 2 + (wy[active] - i["y"]) ** 2) <= 0.8:
            finished = finished or (active == 5 and not repeat)
            switches += not finished
            if active < 5:
                active += 1
            elif repeat:
                active = 0
        bearing = math.atan2(wy[active] - i["y"], wx[active] - i["x"]) - i["psi"]
        assert (model.get("active"), model.get("finished")) == (active + 1, finished)
        assert model.get("error") == (
            0 if finished else math.atan2(math.sin(bearing), math.cos(bearing))
        )
    assert switches > 5 if repeat else finished
