within Fleet;
block AccelerationController "Horizontal pursuit: from position and velocity references to the acceleration that an inverse-kinematics control takes"
  record Vehicle "Measurements of the quadcopter"
    Horizontal.Position position "Centre of mass";
    Horizontal.Velocity velocity "Of the centre of mass";
  end Vehicle;

  record Acceleration
    Real x(start = 0, unit = "m/s2") "East";
    Real y(start = 0, unit = "m/s2") "North";
  end Acceleration;

  parameter Real position_P(unit = "1/s") = 2 "Speed per position error";
  parameter Real position_I(unit = "1/s2") = 1.1 "Rate of the speed per position error";
  parameter Real speed_limit(unit = "m/s") = 2 "Of the speed command, along each axis";
  parameter Real velocity_P(unit = "1/s") = 3 "Acceleration per velocity error";
  parameter Real acceleration_limit(unit = "m/s2") = 2.6 "Along each axis";
  input Vehicle vehicle;
  input Horizontal.Position position_reference;
  input Horizontal.Velocity velocity_reference "Feed-forward: velocity of the position reference";
  input Boolean reset(start = false) "Holds the loops in their start state: no acceleration";
  output Acceleration acceleration_command;
protected
  Pid position_x(
    final P = position_P,
    final I = position_I,
    final u_min = -speed_limit,
    final u_max = speed_limit);
  Pid position_y(
    final P = position_P,
    final I = position_I,
    final u_min = -speed_limit,
    final u_max = speed_limit);
equation
  position_x.error = position_reference.x - vehicle.position.x;
  position_y.error = position_reference.y - vehicle.position.y;
  position_x.feed_forward = velocity_reference.x;
  position_y.feed_forward = velocity_reference.y;
  position_x.reset = reset;
  position_y.reset = reset;
algorithm
  when sample(0, sample_period) then
    acceleration_command.x := if reset then 0.0
      else limit(velocity_P*(position_x.u - vehicle.velocity.x), -acceleration_limit, acceleration_limit);
    acceleration_command.y := if reset then 0.0
      else limit(velocity_P*(position_y.u - vehicle.velocity.y), -acceleration_limit, acceleration_limit);
  end when;
end AccelerationController;
