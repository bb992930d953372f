block StriderAutopilot "Waypoint guidance, surge speed and heading control of a vessel with thruster and rudder"
  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record BodyVelocity
    Real u(unit = "m/s") "Forward";
  end BodyVelocity;

  record Vehicle "Measurements of the vessel"
    Fleet.Horizontal.Position position;
    Attitude attitude;
    BodyVelocity velocity_body;
  end Vehicle;

  parameter Real speed_command(unit = "m/s") = 1;
  parameter Real acceptance_radius(unit = "m") = 0.5 "Of the circle around a waypoint that counts as reached";
  parameter Integer waypoint_count(min = 1, max = Fleet.waypoint_capacity) = 1 "Waypoints in use";
  parameter Real waypoint_x[Fleet.waypoint_capacity](each unit = "m") = fill(0.0, Fleet.waypoint_capacity) "East";
  parameter Real waypoint_y[Fleet.waypoint_capacity](each unit = "m") = fill(0.0, Fleet.waypoint_capacity) "North";
  parameter Fleet.EndPolicy end_policy = Fleet.EndPolicy.stop "What to do after the last waypoint";
  parameter Real speed_P(unit = "N.s/m") = 82.65 "Thrust per speed error";
  parameter Real thrust_limit(unit = "N") = 3;
  parameter Real heading_P(unit = "1") = 1.5 "Rudder angle per heading error";
  parameter Real heading_D(unit = "s") = 0.8 "Rudder angle per rate of the heading error";
  parameter Real heading_N(unit = "rad/s") = 21.4165136740303 "Bandwidth of the derivative filter";
  parameter Real rudder_limit(unit = "rad") = 0.610865238198015 "35 degrees";
  input Vehicle vehicle;
  output Real thrust(start = 0, unit = "N");
  output Real rudder_angle(start = 0, unit = "rad") "Positive: bow to starboard";
  output Real heading_reference(start = 0, unit = "rad") "Counter-clockwise from east";
  output Real distance(start = 0, unit = "m") "To the active waypoint";
  output Integer active_waypoint(start = 1);
  output Boolean finished(start = false) "The last waypoint is reached and the list does not repeat";
protected
  Fleet.WaypointGuidance guidance(
    final acceptance_radius = acceptance_radius,
    final waypoint_count = waypoint_count,
    final waypoint_x = waypoint_x,
    final waypoint_y = waypoint_y,
    final end_policy = end_policy);
  Fleet.Pid surge(
    final P = speed_P,
    final u_min = -thrust_limit,
    final u_max = thrust_limit);
  Fleet.Pid heading(
    final P = heading_P,
    final D = heading_D,
    final N = heading_N,
    final u_min = -rudder_limit,
    final u_max = rudder_limit);
equation
  guidance.position.x = vehicle.position.x;
  guidance.position.y = vehicle.position.y;

  surge.error = (if finished and end_policy == Fleet.EndPolicy.stop then 0 else speed_command) - vehicle.velocity_body.u;
  surge.feed_forward = 0;
  surge.reset = false;

  // A positive rudder angle reduces the yaw angle, hence measurement minus reference.
  heading.error = Fleet.wrap_angle(vehicle.attitude.yaw - heading_reference);
  heading.feed_forward = 0;
  heading.reset = false;

  thrust = surge.u;
  rudder_angle = heading.u;
  heading_reference = guidance.heading_reference;
  distance = guidance.distance;
  active_waypoint = guidance.active_waypoint;
  finished = guidance.finished;
end StriderAutopilot;
