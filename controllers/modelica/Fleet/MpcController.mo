within Fleet;
block MpcController "Tracking by model predictive control over 2 s, with limits of tilt and vertical acceleration and a forecast of the deck"
  // D. Q. Mayne et al.: Constrained model predictive control, Automatica 36 (2000); the wind is rejected as in IndiController.
  extends DisturbanceTracking;
  parameter Real position_weight(unit = "1") = 40 "Per squared position error (m2)";
  parameter Real velocity_weight(unit = "1") = 8 "Per squared velocity error (m2/s2)";
  parameter Real input_weight(unit = "1") = 0.1 "Per squared acceleration command (m2/s4)";
  parameter Real horizontal_lag(unit = "s", min = 0.02) = 0.12 "Of the horizontal acceleration: attitude loop";
  parameter Real vertical_lag(unit = "s", min = 0.02) = 0.05 "Of the vertical acceleration: rotors";
  parameter Real climb_limit(unit = "m/s2") = 6 "Largest upward acceleration";
  parameter Real error_limit(unit = "m") = 2 "Position errors are shortened to this length";
  input Real deck_velocity[3](each start = 0, each unit = "m/s");
  input Real deck_share(start = 0, unit = "1") "Of the motion of the deck that is followed";
protected
  pure function command "First input of the optimal sequence, additional to the acceleration reference"
    input Real error[3];
    input Real step;
    input Real lag;
    input Real position_weight;
    input Real velocity_weight;
    input Real input_weight;
    input Real lower[10];
    input Real upper[10];
    output Real u;
  external "C" u = box_mpc_command(error, step, lag, position_weight, velocity_weight, input_weight, lower, upper)
    annotation(Include = "#include \"box_mpc.h\"");
  end command;

  constant Real step(unit = "s") = 0.1;
  DeckForecast forecast_x;
  DeckForecast forecast_y;
  DeckForecast forecast_z;
  discrete Real side(start = 0, fixed = true, unit = "m/s2") "Largest specific force along each horizontal axis";
  discrete Real error[3](each start = 0, each fixed = true) "Position";
  discrete Real ease(start = 1, fixed = true) "Of a position error that is too large";
  discrete Real needed_x[10](each start = 0, each fixed = true) "Specific force that follows the forecast deck in the wind";
  discrete Real needed_y[10](each start = 0, each fixed = true);
  discrete Real needed_z[10](each start = 0, each fixed = true) "Without that against gravity";
  discrete Real correction[3](each start = 0, each fixed = true) "First optimal commands";
equation
  forecast_x.u = deck_velocity[1];
  forecast_y.u = deck_velocity[2];
  forecast_z.u = deck_velocity[3];
algorithm
  when sample(0, sample_period) then
    error := {
      position_reference.x - vehicle.position.x,
      position_reference.y - vehicle.position.y,
      position_reference.z - vehicle.position.z};
    ease := min(1, error_limit/max(1e-9, sqrt(error[1]^2 + error[2]^2)));
    side := gravity*tan(tilt_limit/degrees);
    needed_x := deck_share*forecast_x.acceleration - fill(disturbance[1], 10);
    needed_y := deck_share*forecast_y.acceleration - fill(disturbance[2], 10);
    needed_z := deck_share*forecast_z.acceleration - fill(disturbance[3], 10);
    correction := {
      command({ease*error[1], velocity_reference.x - vehicle.velocity.x, lift/mass*pre(R[1, 3]) + disturbance[1] - acceleration_reference.x},
        step, horizontal_lag, position_weight, velocity_weight, input_weight, -fill(side, 10) - needed_x, fill(side, 10) - needed_x),
      command({ease*error[2], velocity_reference.y - vehicle.velocity.y, lift/mass*pre(R[2, 3]) + disturbance[2] - acceleration_reference.y},
        step, horizontal_lag, position_weight, velocity_weight, input_weight, -fill(side, 10) - needed_y, fill(side, 10) - needed_y),
      command({error[3], velocity_reference.z - vehicle.velocity.z, lift/mass*pre(R[3, 3]) - gravity + disturbance[3] - acceleration_reference.z},
        step, vertical_lag, position_weight, velocity_weight, input_weight, -fill(sink, 10) - needed_z, fill(climb_limit, 10) - needed_z)};
    wanted := {
      acceleration_reference.x + correction[1] - disturbance[1],
      acceleration_reference.y + correction[2] - disturbance[2],
      gravity + max(-sink, acceleration_reference.z + correction[3] - disturbance[3])};
  end when;
end MpcController;
