within Fleet;
block HeadingAutopilot "Heading loop with integral action and a wave filter: from heading reference to the rudder angle of a vessel"
  // T. I. Fossen: Handbook of marine craft hydrodynamics and motion control, 2nd edition (2021), sections 13.2 (notch) and 15.3 (PID)
  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Vehicle "Measurements of the vessel"
    Attitude attitude;
  end Vehicle;

  parameter Real heading_P(unit = "1") = 1.5 "Rudder angle per heading error";
  parameter Real heading_I(unit = "1/s") = 0.3 "Rate of the rudder angle per heading error";
  parameter Real heading_D(unit = "s") = 0.8 "Rudder angle per rate of the heading error";
  parameter Real heading_N(unit = "rad/s") = 10 "Bandwidth of the derivative filter";
  parameter Real rudder_limit(unit = "rad") = 0.610865238198015 "35 degrees";
  parameter Real wave_period(unit = "s", min = 0.05) = 1.25 "Of the encountered waves, which the rudder does not follow";
  parameter Real wave_depth(unit = "1", min = 0) = 0.1 "Damping ratio of the zeros of the wave filter; equal to wave_width: no filter";
  parameter Real wave_width(unit = "1", min = 0.01) = 0.4 "Damping ratio of its poles";
  input Vehicle vehicle;
  input Real heading_reference(start = 0, unit = "rad") "Counter-clockwise from east";
  output Real rudder_angle(start = 0, unit = "rad") "Positive: bow to starboard";
protected
  Notch waves(
    final period = wave_period,
    final depth = wave_depth,
    final width = wave_width);
  Pid yaw(
    final P = heading_P,
    final I = heading_I,
    final D = heading_D,
    final N = heading_N,
    final u_min = -rudder_limit,
    final u_max = rudder_limit);
equation
  // A positive rudder angle reduces the yaw angle, hence measurement minus reference.
  waves.u = wrap_angle(vehicle.attitude.yaw - heading_reference);
  yaw.error = waves.y;
  yaw.feed_forward = 0;
  yaw.reset = false;
  rudder_angle = yaw.u;
end HeadingAutopilot;
