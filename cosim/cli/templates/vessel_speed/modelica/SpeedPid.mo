block SpeedPid
  "Speed loop of a vessel around the PID controller of the Modelica Standard Library; SI units"
  record BodyVelocity
    Real u(unit = "m/s") "Forward";
  end BodyVelocity;

  record Vehicle "Measurements of the vessel"
    BodyVelocity velocity_body;
  end Vehicle;

  parameter Real speed_P(unit = "N.s/m") = 82.65 "Thrust per speed error";
  parameter Real speed_T(unit = "s") = 8 "Integral time";
  constant Real thrust_limit(unit = "N") = 3;
  input Vehicle vehicle;
  input Real speed_reference(start = 0, unit = "m/s") "Forward";
  output Real thrust(unit = "N");
protected
  Modelica.Blocks.Continuous.LimPID pid(
    controllerType = Modelica.Blocks.Types.SimpleController.PI,
    k = speed_P,
    Ti = speed_T,
    yMax = thrust_limit,
    yMin = -thrust_limit);
equation
  pid.u_s = speed_reference;
  pid.u_m = vehicle.velocity_body.u;
  thrust = pid.y;
  annotation(uses(Modelica(version = "4.1.0")));
end SpeedPid;
