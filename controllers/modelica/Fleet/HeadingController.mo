within Fleet;
block HeadingController "Heading loop: from heading reference to the rudder angle of a vessel"
  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Vehicle "Measurements of the vessel"
    Attitude attitude;
  end Vehicle;

  parameter Real heading_P(unit = "1") = 1.5 "Rudder angle per heading error";
  parameter Real heading_D(unit = "s") = 0.8 "Rudder angle per rate of the heading error";
  parameter Real heading_N(unit = "rad/s") = 21.4165136740303 "Bandwidth of the derivative filter";
  parameter Real rudder_limit(unit = "rad") = 0.610865238198015 "35 degrees";
  input Vehicle vehicle;
  input Real heading_reference(start = 0, unit = "rad") "Counter-clockwise from east";
  output Real rudder_angle(start = 0, unit = "rad") "Positive: bow to starboard";
protected
  Pid yaw(
    final P = heading_P,
    final D = heading_D,
    final N = heading_N,
    final u_min = -rudder_limit,
    final u_max = rudder_limit);
equation
  // A positive rudder angle reduces the yaw angle, hence measurement minus reference.
  yaw.error = wrap_angle(vehicle.attitude.yaw - heading_reference);
  yaw.feed_forward = 0;
  yaw.reset = false;
  rudder_angle = yaw.u;
end HeadingController;
