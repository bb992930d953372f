within Fleet;
block GeometricController "Tracking of a path on SE(3): cascade of position and velocity with integral action"
  extends TrackingController;
  parameter Real position_P(unit = "1/s") = 2.5 "Speed per horizontal position error";
  parameter Real velocity_P(unit = "1/s") = 6 "Acceleration per horizontal velocity error";
  parameter Real altitude_P(unit = "1/s") = 3 "Speed per altitude error";
  parameter Real climb_P(unit = "1/s") = 8 "Acceleration per error of the vertical velocity";
  parameter Real position_I(unit = "1/s3") = 4 "Rate of the acceleration per position error";
  parameter Real speed_limit(unit = "m/s") = 2 "Of the horizontal speed that makes up for a position error";
  parameter Real trim_limit(unit = "m/s2") = 6 "Of the integrals";
protected
  discrete Real error[3](each start = 0, each fixed = true) "Position";
  discrete Real speed[3](each start = 0, each fixed = true) "That makes up for it";
  discrete Real ease(start = 1, fixed = true) "Of a speed that is too high";
  discrete Real trim[3](each start = 0, each fixed = true) "Integrals";
algorithm
  when sample(0, sample_period) then
    error := {
      position_reference.x - vehicle.position.x,
      position_reference.y - vehicle.position.y,
      position_reference.z - vehicle.position.z};
    ease := min(1, speed_limit/max(1e-9, position_P*sqrt(error[1]^2 + error[2]^2)));
    speed := {ease*position_P*error[1], ease*position_P*error[2], altitude_P*error[3]};
    for i in 1:3 loop
      trim[i] := if reset then 0.0 elseif ease < 1 then pre(trim[i])
        else limit(pre(trim[i]) + sample_period*position_I*error[i], -trim_limit, trim_limit);
    end for;
    wanted := {
      acceleration_reference.x + velocity_P*(velocity_reference.x + speed[1] - vehicle.velocity.x) + trim[1],
      acceleration_reference.y + velocity_P*(velocity_reference.y + speed[2] - vehicle.velocity.y) + trim[2],
      gravity + max(-sink, acceleration_reference.z + climb_P*(velocity_reference.z + speed[3] - vehicle.velocity.z) + trim[3])};
  end when;
end GeometricController;
