within Fleet;
block LqrController "Tracking by a linear-quadratic regulator with integral action"
  // B. D. O. Anderson, J. B. Moore: Optimal control: linear quadratic methods (1990), chapters 2 and 3 (Riccati equation in discrete time).
  // Horizontal states per axis: integral of the error, error, error of the velocity, acceleration by the rotors behind a lag of
  // 0.12 s; weights 100, 200, 8, 0 and 1 (input). Vertical: the first three; weights 100, 200, 30 and 1.
  extends TrackingController;
  parameter Real horizontal_gain[4] = {9.694005342697157, 18.71271392285115, 8.366932834017815, 0.7343870780672244};
  parameter Real vertical_gain[3] = {9.595474537327458, 18.385633268946563, 8.018636645249567};
  parameter Real speed_limit(unit = "m/s") = 2 "Of the horizontal speed that makes up for a position error";
  parameter Real trim_limit(unit = "m/s2") = 6 "Of the integral action, along each axis";
protected
  discrete Real error[3](each start = 0, each fixed = true) "Position";
  discrete Real slip[3](each start = 0, each fixed = true) "Velocity error";
  discrete Real ease(start = 1, fixed = true) "Of a position error that is too large";
  discrete Real trim[3](each start = 0, each fixed = true) "Integral action";
  discrete Real up[2](each start = 0, each fixed = true) "Horizontal part of the vertical body axis, world frame";
algorithm
  when sample(0, sample_period) then
    error := {
      position_reference.x - vehicle.position.x,
      position_reference.y - vehicle.position.y,
      position_reference.z - vehicle.position.z};
    slip := {
      velocity_reference.x - vehicle.velocity.x,
      velocity_reference.y - vehicle.velocity.y,
      velocity_reference.z - vehicle.velocity.z};
    ease := min(1, speed_limit*horizontal_gain[3]/(horizontal_gain[2]*max(1e-9, sqrt(error[1]^2 + error[2]^2))));
    for i in 1:3 loop
      trim[i] := if reset then 0.0 elseif ease < 1 then pre(trim[i]) else limit(
        pre(trim[i]) + sample_period*(if i == 3 then vertical_gain[1] else horizontal_gain[1])*error[i], -trim_limit, trim_limit);
    end for;
    up := {
      2*(vehicle.orientation.x*vehicle.orientation.z + vehicle.orientation.w*vehicle.orientation.y),
      2*(vehicle.orientation.y*vehicle.orientation.z - vehicle.orientation.w*vehicle.orientation.x)};
    wanted := {
      acceleration_reference.x + trim[1] + horizontal_gain[2]*ease*error[1] + horizontal_gain[3]*slip[1]
        - horizontal_gain[4]*(pre(thrust)/mass*up[1] - acceleration_reference.x),
      acceleration_reference.y + trim[2] + horizontal_gain[2]*ease*error[2] + horizontal_gain[3]*slip[2]
        - horizontal_gain[4]*(pre(thrust)/mass*up[2] - acceleration_reference.y),
      gravity + max(-sink, acceleration_reference.z + trim[3] + vertical_gain[2]*error[3] + vertical_gain[3]*slip[3])};
  end when;
end LqrController;
