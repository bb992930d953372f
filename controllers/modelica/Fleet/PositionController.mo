within Fleet;
block PositionController "Horizontal position and velocity loops: from position reference to roll and pitch command"
  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Vehicle "Measurements of the quadcopter"
    Horizontal.Position position "Centre of mass";
    Horizontal.Velocity velocity "Of the centre of mass";
    Attitude attitude;
  end Vehicle;

  parameter Real position_P(unit = "1/s") = 2 "Speed per position error";
  parameter Real position_I(unit = "1/s2") = 1.1 "Acceleration per position error";
  parameter Real speed_limit(unit = "m/s") = 2 "Of the speed command, along each axis";
  parameter Real velocity_P(unit = "deg.s/m") = 19.6600401691244 "Tilt per velocity error";
  parameter Real velocity_D(unit = "deg.s2/m") = 0.259478709550943 "Tilt per rate of the velocity error";
  parameter Real velocity_N(unit = "rad/s") = 3.0476144677615 "Bandwidth of the derivative filter";
  parameter Real tilt_limit(unit = "deg") = 15 "Of roll and pitch command";
  input Vehicle vehicle;
  input Horizontal.Position position_reference;
  input Horizontal.Velocity velocity_reference "Feed-forward: velocity of the position reference";
  input Boolean reset(start = false) "Holds the loops in their start state: level commands";
  output Real roll_command(start = 0, unit = "rad") "Positive: left side up, accelerates to the right";
  output Real pitch_command(start = 0, unit = "rad") "Positive: nose down, accelerates forward";
protected
  Real c "cos(yaw)";
  Real s "sin(yaw)";
  Pid position_forward(
    final P = position_P,
    final I = position_I,
    final u_min = -speed_limit,
    final u_max = speed_limit);
  Pid position_left(
    final P = position_P,
    final I = position_I,
    final u_min = -speed_limit,
    final u_max = speed_limit);
  Pid velocity_forward(
    final P = velocity_P,
    final D = velocity_D,
    final N = velocity_N,
    final u_min = -tilt_limit,
    final u_max = tilt_limit);
  Pid velocity_left(
    final P = velocity_P,
    final D = velocity_D,
    final N = velocity_N,
    final u_min = -tilt_limit,
    final u_max = tilt_limit);
equation
  c = cos(vehicle.attitude.yaw);
  s = sin(vehicle.attitude.yaw);

  position_forward.error = c*(position_reference.x - vehicle.position.x) + s*(position_reference.y - vehicle.position.y);
  position_left.error = c*(position_reference.y - vehicle.position.y) - s*(position_reference.x - vehicle.position.x);
  position_forward.feed_forward = c*velocity_reference.x + s*velocity_reference.y;
  position_left.feed_forward = c*velocity_reference.y - s*velocity_reference.x;

  velocity_forward.error = position_forward.u - (c*vehicle.velocity.x + s*vehicle.velocity.y);
  velocity_left.error = position_left.u - (c*vehicle.velocity.y - s*vehicle.velocity.x);
  velocity_forward.feed_forward = 0;
  velocity_left.feed_forward = 0;

  position_forward.reset = reset;
  position_left.reset = reset;
  velocity_forward.reset = reset;
  velocity_left.reset = reset;

  pitch_command = velocity_forward.u/degrees;
  roll_command = -velocity_left.u/degrees;
end PositionController;
