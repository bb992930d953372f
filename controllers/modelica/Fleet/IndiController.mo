within Fleet;
block IndiController "Tracking by incremental nonlinear dynamic inversion: the measured acceleration corrects the specific force"
  // E. J. J. Smeur, G. C. H. E. de Croon, Q. Chu: Cascaded incremental nonlinear dynamic inversion for MAV disturbance rejection,
  // Control Engineering Practice 73 (2018), equations 20 to 25, with the force instead of attitude and thrust as input
  extends DisturbanceTracking;
  parameter Real position_P(unit = "1/s") = 3 "Speed per horizontal position error";
  parameter Real velocity_P(unit = "1/s") = 6 "Acceleration per horizontal velocity error";
  parameter Real altitude_P(unit = "1/s") = 3 "Speed per altitude error";
  parameter Real climb_P(unit = "1/s") = 8 "Acceleration per error of the vertical velocity";
  parameter Real speed_limit(unit = "m/s") = 2 "Of the horizontal speed that makes up for a position error";
protected
  discrete Real error[3](each start = 0, each fixed = true) "Position";
  discrete Real speed[3](each start = 0, each fixed = true) "That makes up for it";
  discrete Real ease(start = 1, fixed = true) "Of a speed that is too high";
algorithm
  when sample(0, sample_period) then
    error := {
      position_reference.x - vehicle.position.x,
      position_reference.y - vehicle.position.y,
      position_reference.z - vehicle.position.z};
    ease := min(1, speed_limit/max(1e-9, position_P*sqrt(error[1]^2 + error[2]^2)));
    speed := {ease*position_P*error[1], ease*position_P*error[2], altitude_P*error[3]};

    wanted := {
      acceleration_reference.x + velocity_P*(velocity_reference.x + speed[1] - vehicle.velocity.x) - disturbance[1],
      acceleration_reference.y + velocity_P*(velocity_reference.y + speed[2] - vehicle.velocity.y) - disturbance[2],
      gravity + max(-sink, acceleration_reference.z + climb_P*(velocity_reference.z + speed[3] - vehicle.velocity.z) - disturbance[3])};
  end when;
end IndiController;
