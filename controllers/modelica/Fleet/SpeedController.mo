within Fleet;
block SpeedController "Speed loop: from speed reference to the thrust of a vessel"
  record BodyVelocity
    Real u(unit = "m/s") "Forward";
  end BodyVelocity;

  record Vehicle "Measurements of the vessel"
    BodyVelocity velocity_body;
  end Vehicle;

  parameter Real speed_P(unit = "N.s/m") = 82.65 "Thrust per speed error";
  parameter Real thrust_limit(unit = "N") = 3;
  input Vehicle vehicle;
  input Real speed_reference(start = 0, unit = "m/s") "Forward";
  output Real thrust(start = 0, unit = "N");
protected
  Pid surge(
    final P = speed_P,
    final u_min = -thrust_limit,
    final u_max = thrust_limit);
equation
  surge.error = speed_reference - vehicle.velocity_body.u;
  surge.feed_forward = 0;
  surge.reset = false;
  thrust = surge.u;
end SpeedController;
