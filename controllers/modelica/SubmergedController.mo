block SubmergedController "Holds a submerged vehicle with up to 8 thrusters at a position, level and on a heading: from the references to thruster speeds"
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

  record Vehicle "Measurements of the vehicle"
    Fleet.Spatial.Position position "Centre of mass";
    Fleet.Spatial.Velocity velocity "Of the centre of mass";
    Attitude attitude;
    Rates rates;
  end Vehicle;

  parameter Real position_P(unit = "1/s") = 0.5 "Speed per position error";
  parameter Real position_I(unit = "N/(m.s)") = 8 "Rate of the trim force per position error";
  parameter Real velocity_P(unit = "N.s/m") = 80 "Force per velocity error";
  parameter Real speed_limit(unit = "m/s") = 0.4 "Of the speed along each axis";
  parameter Real trim_error(unit = "m") = 0.3 "Greater position errors are integrated as this one";
  parameter Real trim_limit(unit = "N") = 40 "Of the integrals";
  parameter Real attitude_P(unit = "N.m/rad") = 6 "Torque per error of roll and pitch";
  parameter Real attitude_D(unit = "N.m.s/rad") = 3 "Torque per roll and pitch rate";
  parameter Real yaw_P(unit = "N.m/rad") = 5 "Torque per yaw error";
  parameter Real yaw_D(unit = "N.m.s/rad") = 4 "Torque per yaw rate";
  parameter Real surge_share[8](each unit = "1") = zeros(8) "Thrust of each thruster over the force along x, body frame";
  parameter Real sway_share[8](each unit = "1") = zeros(8) "Thrust of each thruster over the force along y, body frame";
  parameter Real heave_share[8](each unit = "1") = zeros(8) "Thrust of each thruster over the force along z, body frame";
  parameter Real roll_share[8](each unit = "1/m") = zeros(8) "Thrust of each thruster over the torque about x, body frame";
  parameter Real pitch_share[8](each unit = "1/m") = zeros(8) "Thrust of each thruster over the torque about y, body frame";
  parameter Real yaw_share[8](each unit = "1/m") = zeros(8) "Thrust of each thruster over the torque about z, body frame";
  parameter Real thrust_coefficient(unit = "N.s2/rad2") = 3.8e-4 "Thrust of a thruster over its squared speed, equal in both senses";
  parameter Real thruster_speed_max(unit = "rad/s") = 283;
  input Vehicle vehicle;
  input Fleet.Spatial.Position position_reference;
  input Real yaw_reference(start = 0, unit = "rad");
  output Real thruster_speed[8](each start = 0, each unit = "rad/s");
protected
  discrete Real error[3](each start = 0, each fixed = true) "Position";
  discrete Real trim[3](each start = 0, each fixed = true) "Integrals";
  discrete Real wanted[3](each start = 0, each fixed = true) "Force, world frame";
  discrete Real ahead(start = 0, fixed = true) "Force along the heading";
  discrete Real load[6](each start = 0, each fixed = true) "Force and torque, body frame";
  discrete Real share[8](each start = 0, each fixed = true) "Thrust of each thruster";
algorithm
  when sample(0, Fleet.sample_period) then
    error := {
      position_reference.x - vehicle.position.x,
      position_reference.y - vehicle.position.y,
      position_reference.z - vehicle.position.z};
    for i in 1:3 loop
      trim[i] := Fleet.limit(
        pre(trim[i]) + Fleet.sample_period*position_I*Fleet.limit(error[i], -trim_error, trim_error), -trim_limit, trim_limit);
    end for;
    wanted := {
      trim[1] + velocity_P*(Fleet.limit(position_P*error[1], -speed_limit, speed_limit) - vehicle.velocity.x),
      trim[2] + velocity_P*(Fleet.limit(position_P*error[2], -speed_limit, speed_limit) - vehicle.velocity.y),
      trim[3] + velocity_P*(Fleet.limit(position_P*error[3], -speed_limit, speed_limit) - vehicle.velocity.z)};
    ahead := cos(vehicle.attitude.yaw)*wanted[1] + sin(vehicle.attitude.yaw)*wanted[2];
    load := {
      cos(vehicle.attitude.pitch)*ahead - sin(vehicle.attitude.pitch)*wanted[3],
      cos(vehicle.attitude.yaw)*wanted[2] - sin(vehicle.attitude.yaw)*wanted[1],
      cos(vehicle.attitude.pitch)*wanted[3] + sin(vehicle.attitude.pitch)*ahead,
      -attitude_P*vehicle.attitude.roll - attitude_D*vehicle.rates.p,
      -attitude_P*vehicle.attitude.pitch - attitude_D*vehicle.rates.q,
      yaw_P*Fleet.wrap_angle(yaw_reference - vehicle.attitude.yaw) - yaw_D*vehicle.rates.r};
    for i in 1:8 loop
      share[i] := surge_share[i]*load[1] + sway_share[i]*load[2] + heave_share[i]*load[3]
        + roll_share[i]*load[4] + pitch_share[i]*load[5] + yaw_share[i]*load[6];
      thruster_speed[i] := Fleet.limit(sign(share[i])*sqrt(abs(share[i])/thrust_coefficient), -thruster_speed_max, thruster_speed_max);
    end for;
  end when;
end SubmergedController;
