within Fleet;
block PathGuidance "Adaptive line of sight (ALOS) along the legs between waypoints, with an estimate of the crab angle"
  // T. I. Fossen: An adaptive line-of-sight (ALOS) guidance law for path following of aircraft and marine craft,
  // IEEE Transactions on Control Systems Technology 31 (2023), equations 18 to 21, with the angles counter-clockwise from east
  extends WaypointList;
  parameter Real look_ahead(unit = "m", min = 0.1) = 1.5 "Distance along the leg to the point that is aimed at";
  parameter Real adaptation(unit = "rad/(m.s)", min = 0) = 0.1 "Rate of the crab angle per cross-track error";
  parameter Real crab_limit(unit = "rad", min = 0) = 1 "Largest crab angle";
  output Real cross_track_error(start = 0, unit = "m") "Positive: left of the leg";
  output Real crab_angle(start = 0, fixed = true, unit = "rad") "Estimate: course minus heading";
protected
  discrete Boolean running(start = false, fixed = true);
  discrete Integer leg(start = 0, fixed = true) "Active waypoint when the leg began";
  discrete Real start_x(start = 0, fixed = true) "Begin of the leg";
  discrete Real start_y(start = 0, fixed = true);
  discrete Real end_x(start = 0, fixed = true) "Last begin or waypoint";
  discrete Real end_y(start = 0, fixed = true);
  discrete Real course(start = 0, fixed = true) "Of the leg, counter-clockwise from east";
algorithm
  when sample(0, sample_period) then
    end_x := if pre(running) then pre(end_x) else vehicle.position.x;
    end_y := if pre(running) then pre(end_y) else vehicle.position.y;
    leg := pre(leg);
    start_x := pre(start_x);
    start_y := pre(start_y);
    crab_angle := pre(crab_angle);
    if active_waypoint <> leg then
      start_x := end_x;
      start_y := end_y;
      end_x := waypoint_x[active_waypoint];
      end_y := waypoint_y[active_waypoint];
      leg := active_waypoint;
      crab_angle := 0;
      course := atan2(end_y - start_y, end_x - start_x);
    end if;
    running := true;
    cross_track_error := cos(course)*(vehicle.position.y - start_y) - sin(course)*(vehicle.position.x - start_x);
    if not finished then
      heading_reference := wrap_angle(course - crab_angle - atan2(cross_track_error, look_ahead));
      crab_angle := limit(crab_angle + sample_period*adaptation*cross_track_error*look_ahead
        /Horizontal.length(look_ahead, cross_track_error), -crab_limit, crab_limit);
    end if;
  end when;
end PathGuidance;
