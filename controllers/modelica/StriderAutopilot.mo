block StriderAutopilot "Waypoint guidance, speed and heading control of a vessel with thruster and rudder in one block"
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
    final speed_command = speed_command,
    final acceptance_radius = acceptance_radius,
    final waypoint_count = waypoint_count,
    final waypoint_x = waypoint_x,
    final waypoint_y = waypoint_y,
    final end_policy = end_policy);
  Fleet.SpeedController speed(
    final speed_P = speed_P,
    final thrust_limit = thrust_limit);
  Fleet.HeadingController heading(
    final heading_P = heading_P,
    final heading_D = heading_D,
    final heading_N = heading_N,
    final rudder_limit = rudder_limit);
equation
  guidance.vehicle.position.x = vehicle.position.x;
  guidance.vehicle.position.y = vehicle.position.y;

  speed.vehicle.velocity_body.u = vehicle.velocity_body.u;
  speed.speed_reference = guidance.speed_reference;

  heading.vehicle.attitude.yaw = vehicle.attitude.yaw;
  heading.heading_reference = guidance.heading_reference;

  thrust = speed.thrust;
  rudder_angle = heading.rudder_angle;
  heading_reference = guidance.heading_reference;
  distance = guidance.distance;
  active_waypoint = guidance.active_waypoint;
  finished = guidance.finished;
end StriderAutopilot;
