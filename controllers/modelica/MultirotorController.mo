block MultirotorController "Holds a multirotor of any layout at a position: from position and yaw reference to rotor speeds"
  record Attitude
    Real roll(unit = "rad") "Positive: left side up";
    Real pitch(unit = "rad") "Positive: nose down";
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Rates "Angular velocity in the body frame"
    Real p(unit = "rad/s");
    Real q(unit = "rad/s");
    Real r(unit = "rad/s");
  end Rates;

  record Vehicle "Measurements of the multirotor"
    Fleet.Spatial.Position position "Centre of mass";
    Fleet.Spatial.Velocity velocity "Of the centre of mass";
    Attitude attitude;
    Rates rates;
  end Vehicle;

  parameter Real position_P(unit = "1/s") = 1 "Speed per position error";
  parameter Real position_I(unit = "1/s3") = 0.5 "Rate of the acceleration per position error";
  parameter Real velocity_P(unit = "1/s") = 2 "Acceleration per velocity error";
  parameter Real speed_limit(unit = "m/s") = 2 "Of the speed along each axis";
  parameter Real trim_error(unit = "m") = 0.2 "Greater position errors are integrated as this one";
  parameter Real trim_limit(unit = "m/s2") = 3 "Of the integrals";
  parameter Real tilt_limit(unit = "deg", min = 1, max = 45) = 20 "Of roll and pitch";
  parameter Real attitude_P(unit = "1/s2") = 40 "Angular acceleration per error of roll and pitch";
  parameter Real attitude_D(unit = "1/s") = 9 "Angular acceleration per roll and pitch rate";
  parameter Real yaw_P(unit = "1/s2") = 4 "Angular acceleration per yaw error";
  parameter Real yaw_D(unit = "1/s") = 4 "Angular acceleration per yaw rate";
  parameter Real mass(unit = "kg") = 0.443892 "As the controller believes it";
  parameter Real inertia[3](each unit = "kg.m2") = {0.002835, 0.002821, 0.005131} "About the body axes";
  parameter Integer rotor_count(min = 3, max = 8) = 4;
  parameter Real rotor_x[8](each unit = "m") = {0.1815, 0, -0.1815, 0, 0, 0, 0, 0} "Places ahead of the centre; the sums of x, y, x y and of these times the sense are 0";
  parameter Real rotor_y[8](each unit = "m") = {0, 0.1815, 0, -0.1815, 0, 0, 0, 0} "Places to port of the centre; balanced as rotor_x";
  parameter Real rotor_sense[8](each unit = "1") = {1, -1, 1, -1, 0, 0, 0, 0} "1: turns clockwise seen from above, its reaction turns the body to port; -1: counter-clockwise; 0: no rotor";
  parameter Real thrust_coefficient(unit = "N.s2/rad2") = 8.24e-6 "Thrust of a rotor over its squared speed";
  parameter Real torque_coefficient(unit = "N.m.s2/rad2") = 2.38e-7 "Reaction torque of a rotor over its squared speed";
  parameter Real rotor_speed_max(unit = "rad/s") = 523.5988;
  input Vehicle vehicle;
  input Fleet.Spatial.Position position_reference;
  input Real yaw_reference(start = 0, unit = "rad");
  output Real rotor_speed[8](each start = 0, each unit = "rad/s") "Of the first rotor_count rotors, the others rest";
  output Real thrust(start = 0, unit = "N") "Wanted of all rotors";
protected
  discrete Real error[3](each start = 0, each fixed = true) "Position";
  discrete Real trim[3](each start = 0, each fixed = true) "Integrals";
  discrete Real reference[3](each start = 0, each fixed = true) "Position";
  discrete Real moving[3](each start = 0, each fixed = true) "Velocity of the position reference";
  discrete Real speed[3](each start = 0, each fixed = true) "Wanted";
  discrete Real wanted[3](each start = 0, each fixed = true) "Acceleration, world frame";
  discrete Real ahead(start = 0, fixed = true) "Acceleration along the heading";
  discrete Real aside(start = 0, fixed = true) "Acceleration to the left of it";
  discrete Real limit_tangent(start = 0, fixed = true);
  discrete Real roll_error(start = 0, fixed = true);
  discrete Real pitch_error(start = 0, fixed = true);
  discrete Real torque[3](each start = 0, each fixed = true);
  discrete Real share[8](each start = 0, each fixed = true) "Thrust of each rotor";
algorithm
  when sample(0, Fleet.sample_period) then
    reference := {position_reference.x, position_reference.y, position_reference.z};
    error := {
      reference[1] - vehicle.position.x,
      reference[2] - vehicle.position.y,
      reference[3] - vehicle.position.z};
    for i in 1:3 loop
      moving[i] := Fleet.limit((reference[i] - pre(reference[i]))/Fleet.sample_period, -speed_limit, speed_limit);
      speed[i] := Fleet.limit(moving[i] + position_P*error[i], -speed_limit, speed_limit);
      trim[i] := Fleet.limit(
        pre(trim[i]) + Fleet.sample_period*position_I*Fleet.limit(error[i], -trim_error, trim_error), -trim_limit, trim_limit);
    end for;
    wanted := {
      trim[1] + velocity_P*(speed[1] - vehicle.velocity.x),
      trim[2] + velocity_P*(speed[2] - vehicle.velocity.y),
      trim[3] + velocity_P*(speed[3] - vehicle.velocity.z)};
    wanted[3] := Fleet.gravity + Fleet.limit(wanted[3], -Fleet.gravity/2, Fleet.gravity);

    ahead := cos(vehicle.attitude.yaw)*wanted[1] + sin(vehicle.attitude.yaw)*wanted[2];
    aside := cos(vehicle.attitude.yaw)*wanted[2] - sin(vehicle.attitude.yaw)*wanted[1];
    limit_tangent := tan(tilt_limit/Fleet.degrees);
    pitch_error := atan(Fleet.limit(ahead/wanted[3], -limit_tangent, limit_tangent)) - vehicle.attitude.pitch;
    roll_error := -atan(Fleet.limit(aside/wanted[3], -limit_tangent, limit_tangent)) - vehicle.attitude.roll;
    torque := {
      inertia[1]*(attitude_P*roll_error - attitude_D*vehicle.rates.p),
      inertia[2]*(attitude_P*pitch_error - attitude_D*vehicle.rates.q),
      inertia[3]*(yaw_P*Fleet.wrap_angle(yaw_reference - vehicle.attitude.yaw) - yaw_D*vehicle.rates.r)};
    thrust := mass*wanted[3]/(cos(vehicle.attitude.roll)*cos(vehicle.attitude.pitch));

    for i in 1:8 loop
      share[i] := (thrust + torque[3]*rotor_sense[i]*thrust_coefficient/torque_coefficient)/rotor_count
        + torque[1]*rotor_y[i]/(rotor_y*rotor_y) - torque[2]*rotor_x[i]/(rotor_x*rotor_x);
      rotor_speed[i] := abs(rotor_sense[i])*min(rotor_speed_max, sqrt(max(0, share[i])/thrust_coefficient));
    end for;
  end when;
end MultirotorController;
