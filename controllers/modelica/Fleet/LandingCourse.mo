within Fleet;
block LandingCourse "Path command of a vessel that helps a landing: waypoints first, then a course relative to the wind"
  // With the wind the vessel takes its speed off the wind that the quadcopter meets, and the waves overtake it slowly.
  record Vehicle "Measurements of the vessel"
    Horizontal.Position position;
  end Vehicle;

  parameter Real speed_command(unit = "m/s") = 1 "On the way";
  parameter Real acceptance_radius(unit = "m") = 0.5 "Of the circle around a waypoint that counts as reached";
  parameter Integer waypoint_count(min = 1, max = Fleet.waypoint_capacity) = 1 "Waypoints in use";
  parameter Real waypoint_x[Fleet.waypoint_capacity](each unit = "m") = fill(0.0, Fleet.waypoint_capacity) "East";
  parameter Real waypoint_y[Fleet.waypoint_capacity](each unit = "m") = fill(0.0, Fleet.waypoint_capacity) "North";
  parameter EndPolicy end_policy = EndPolicy.stop "What to do after the last waypoint";
  parameter Real landing_time(unit = "s") = 5 "From then on the vessel helps";
  parameter Real landing_speed(unit = "m/s") = 1.4 "Speed for the landing";
  parameter Real landing_angle(unit = "rad") = 0 "Course for the landing from that with the wind; pi: into the wind";
  parameter Real wind_time(unit = "s", min = 0.1) = 5 "In which gusts are averaged";
  parameter Real calm_wind(unit = "m/s", min = 0) = 1 "Mean wind below which the vessel keeps its course";
  input Vehicle vehicle;
  input Horizontal.Velocity wind "Of the air at the vessel";
  output Real heading_reference(start = 0, unit = "rad") "Counter-clockwise from east";
  output Real speed_reference(start = 0, unit = "m/s") "Forward";
  output Real distance(start = 0, unit = "m") "To the active waypoint";
  output Integer active_waypoint(start = 1);
  output Boolean finished(start = false) "The last waypoint is reached and the list does not repeat";
  output Boolean helping(start = false) "The vessel steers for the landing";
protected
  WaypointGuidance route(
    final speed_command = speed_command,
    final acceptance_radius = acceptance_radius,
    final waypoint_count = waypoint_count,
    final waypoint_x = waypoint_x,
    final waypoint_y = waypoint_y,
    final end_policy = end_policy);
  discrete Boolean running(start = false, fixed = true);
  discrete Real share(start = 1, fixed = true) "Of a sample in the mean";
  discrete Real mean[2](each start = 0, each fixed = true, each unit = "m/s") "Wind without gusts";
equation
  route.vehicle.position.x = vehicle.position.x;
  route.vehicle.position.y = vehicle.position.y;
  distance = route.distance;
  active_waypoint = route.active_waypoint;
  finished = route.finished;
algorithm
  when sample(0, sample_period) then
    share := if pre(running) then 1 - exp(-sample_period/wind_time) else 1.0;
    mean := {pre(mean[1]) + share*(wind.x - pre(mean[1])), pre(mean[2]) + share*(wind.y - pre(mean[2]))};
    running := true;
    helping := time >= landing_time;
    if helping and Horizontal.length(mean[1], mean[2]) >= calm_wind then
      heading_reference := wrap_angle(atan2(mean[2], mean[1]) + landing_angle);
    else
      heading_reference := route.heading_reference;
    end if;
    speed_reference := if helping then landing_speed else route.speed_reference;
  end when;
end LandingCourse;
