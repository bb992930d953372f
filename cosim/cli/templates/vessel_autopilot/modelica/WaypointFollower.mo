block WaypointFollower
  "Vessel autopilot along waypoints; SI units, angles in rad, yaw counter-clockwise from east"
  record Position
    Real x(unit = "m") "East";
    Real y(unit = "m") "North";
  end Position;

  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record BodyVelocity
    Real u(unit = "m/s") "Forward";
  end BodyVelocity;

  record Rates
    Real r(unit = "rad/s") "Yaw rate";
  end Rates;

  record Vehicle "Measurements of the vessel"
    Position position;
    Attitude attitude;
    BodyVelocity velocity_body;
    Rates rates;
  end Vehicle;

  constant Real sample_period(unit = "s") = 0.01;
  parameter Real speed_command(unit = "m/s") = 1;
  parameter Real acceptance_radius(unit = "m") = 0.5 "Distance at which a waypoint is reached";
  parameter Integer waypoint_count(min = 0, max = 32) = 1 "Number of waypoints in use";
  parameter Real waypoint_x[32](each unit = "m") = zeros(32) "East";
  parameter Real waypoint_y[32](each unit = "m") = zeros(32) "North";
  parameter Real speed_P(unit = "N.s/m") = 82.65 "Thrust per speed error";
  parameter Real speed_I(unit = "N/m") = 10 "Thrust per integral of the speed error";
  parameter Real thrust_limit(unit = "N") = 3;
  parameter Real course_P(unit = "1") = 1.5 "Rudder angle per course error";
  parameter Real course_D(unit = "s") = 0.8 "Rudder angle per yaw rate";
  parameter Real rudder_limit(unit = "rad") = 0.610865238198015 "35 degrees";
  input Vehicle vehicle;
  output Real thrust(start = 0, fixed = true, unit = "N");
  output Real rudder_angle(start = 0, fixed = true, unit = "rad") "Positive: bow to starboard";
  output Integer reached(start = 0, fixed = true) "Number of waypoints reached";
protected
  discrete Real east(start = 0, fixed = true, unit = "m") "To the next waypoint";
  discrete Real north(start = 0, fixed = true, unit = "m");
  discrete Real speed_error(start = 0, fixed = true, unit = "m/s");
  discrete Real speed_integral(start = 0, fixed = true, unit = "N")
    "Constant while the thrust is at its limit";
  discrete Real demand(start = 0, fixed = true, unit = "N") "Thrust without limit";
  discrete Real course_error(start = 0, fixed = true, unit = "rad");
algorithm
  when sample(0, sample_period) then
    if pre(reached) < waypoint_count then
      east := waypoint_x[pre(reached) + 1] - vehicle.position.x;
      north := waypoint_y[pre(reached) + 1] - vehicle.position.y;
      reached := pre(reached) + (if sqrt(east^2 + north^2) < acceptance_radius then 1 else 0);
      speed_error := speed_command - vehicle.velocity_body.u;
      demand := speed_P * speed_error + pre(speed_integral);
      thrust := max(-thrust_limit, min(thrust_limit, demand));
      speed_integral := pre(speed_integral)
        + (if abs(demand) < thrust_limit then speed_I * sample_period * speed_error else 0);

      // A positive rudder angle reduces the yaw angle, hence measurement minus command.
      course_error := vehicle.attitude.yaw - atan2(north, east);
      course_error := atan2(sin(course_error), cos(course_error));
      rudder_angle := max(-rudder_limit,
        min(rudder_limit, course_P * course_error + course_D * vehicle.rates.r));
    else
      thrust := 0;
      rudder_angle := 0;
    end if;
  end when;
end WaypointFollower;
