within Fleet;
partial block WaypointList "Waypoints in turn, switched on by circles of acceptance; extending blocks steer by them"
  record Vehicle "Measurements of the vessel"
    Horizontal.Position position;
  end Vehicle;

  parameter Real speed_command(unit = "m/s") = 1 "On the way";
  parameter Real acceptance_radius(unit = "m") = 0.5 "Of the circle around a waypoint that counts as reached";
  parameter Integer waypoint_count(min = 1, max = Fleet.waypoint_capacity) = 1 "Waypoints in use";
  parameter Real waypoint_x[Fleet.waypoint_capacity](each unit = "m") = fill(0.0, Fleet.waypoint_capacity) "East";
  parameter Real waypoint_y[Fleet.waypoint_capacity](each unit = "m") = fill(0.0, Fleet.waypoint_capacity) "North";
  parameter EndPolicy end_policy = EndPolicy.stop "What to do after the last waypoint";
  input Vehicle vehicle;
  output Real heading_reference(start = 0, unit = "rad") "Counter-clockwise from east";
  output Real speed_reference(start = 0, unit = "m/s") "Forward";
  output Real distance(start = 0, unit = "m") "To the active waypoint";
  output Integer active_waypoint(start = 1, fixed = true);
  output Boolean finished(start = false, fixed = true) "The last waypoint is reached and the list does not repeat";
protected
  discrete Boolean reached(start = false, fixed = true);
  discrete Real ahead_x(start = 0, fixed = true) "From the vessel to the active waypoint";
  discrete Real ahead_y(start = 0, fixed = true);
algorithm
  when sample(0, sample_period) then
    assert(waypoint_count >= 1 and waypoint_count <= waypoint_capacity, "waypoint_count is not between 1 and 32");
    active_waypoint := min(pre(active_waypoint), waypoint_count);
    ahead_x := waypoint_x[active_waypoint] - vehicle.position.x;
    ahead_y := waypoint_y[active_waypoint] - vehicle.position.y;
    reached := Horizontal.length(ahead_x, ahead_y) <= acceptance_radius and not pre(finished);
    if reached then
      if active_waypoint < waypoint_count then
        active_waypoint := active_waypoint + 1;
      elseif end_policy == EndPolicy.repeat then
        active_waypoint := 1;
      else
        finished := true;
      end if;
      ahead_x := waypoint_x[active_waypoint] - vehicle.position.x;
      ahead_y := waypoint_y[active_waypoint] - vehicle.position.y;
    end if;
    distance := Horizontal.length(ahead_x, ahead_y);
    speed_reference := if finished and end_policy == EndPolicy.stop then 0 else speed_command;
  end when;
end WaypointList;
