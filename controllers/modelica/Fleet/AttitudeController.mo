within Fleet;
block AttitudeController "Roll, pitch and yaw loops: from attitude commands to throttle differences"
  record Attitude
    Real roll(unit = "rad") "Positive: left side up";
    Real pitch(unit = "rad") "Positive: nose down";
    Real yaw(unit = "rad") "Positive: counter-clockwise seen from above";
  end Attitude;

  record Vehicle "Measurements of the quadcopter"
    Attitude attitude;
  end Vehicle;

  parameter Real roll_P(unit = "%/deg") = 0.3217;
  parameter Real roll_I(unit = "%/(deg.s)") = 0.4324;
  parameter Real roll_D(unit = "%.s/deg") = 0.0583;
  parameter Real pitch_P(unit = "%/deg") = 0.3217336;
  parameter Real pitch_I(unit = "%/(deg.s)") = 0.4324;
  parameter Real pitch_D(unit = "%.s/deg") = 0.0583122;
  parameter Real tilt_N(unit = "rad/s") = 100 "Bandwidth of the derivative filters of roll and pitch";
  parameter Real tilt_limit(unit = "%") = 20 "Of the roll and pitch differences";
  parameter Real yaw_P(unit = "%/deg") = 0.665668467901894;
  parameter Real yaw_I(unit = "%/(deg.s)") = 0.340149010656045;
  parameter Real yaw_D(unit = "%.s/deg") = 0.313800354221384;
  parameter Real yaw_N(unit = "rad/s") = 96.4244783671056 "Bandwidth of the derivative filter of yaw";
  parameter Real yaw_limit(unit = "%") = 10 "Of the yaw difference";
  input Vehicle vehicle;
  input Real roll_command(start = 0, unit = "rad");
  input Real pitch_command(start = 0, unit = "rad");
  input Real yaw_command(start = 0, unit = "rad");
  input Boolean reset(start = false) "Holds the loops in their start state: no differences";
  output Real roll_difference(start = 0, unit = "%") "Positive: raises the left side";
  output Real pitch_difference(start = 0, unit = "%") "Positive: lowers the nose";
  output Real yaw_difference(start = 0, unit = "%") "Positive: turns counter-clockwise";
protected
  Pid roll(
    final P = roll_P,
    final I = roll_I,
    final D = roll_D,
    final N = tilt_N,
    final u_min = -tilt_limit,
    final u_max = tilt_limit);
  Pid pitch(
    final P = pitch_P,
    final I = pitch_I,
    final D = pitch_D,
    final N = tilt_N,
    final u_min = -tilt_limit,
    final u_max = tilt_limit);
  Pid yaw(
    final P = yaw_P,
    final I = yaw_I,
    final D = yaw_D,
    final N = yaw_N,
    final u_min = -yaw_limit,
    final u_max = yaw_limit);
equation
  roll.error = degrees*(roll_command - vehicle.attitude.roll);
  pitch.error = degrees*(pitch_command - vehicle.attitude.pitch);
  yaw.error = degrees*wrap_angle(yaw_command - vehicle.attitude.yaw);
  roll.feed_forward = 0;
  pitch.feed_forward = 0;
  yaw.feed_forward = 0;
  roll.reset = reset;
  pitch.reset = reset;
  yaw.reset = reset;
  roll_difference = roll.u;
  pitch_difference = pitch.u;
  yaw_difference = yaw.u;
end AttitudeController;
