within Fleet;
block InverseKinematics "From horizontal acceleration and altitude commands to tilt commands and the common throttle of the rotors"
  record Position
    Real z(unit = "m") "Up";
  end Position;

  record Vehicle "Measurements of the quadcopter"
    Position position "Centre of mass";
  end Vehicle;

  record Acceleration
    Real x(unit = "m/s2") "East";
    Real y(unit = "m/s2") "North";
  end Acceleration;

  parameter Real altitude_P(unit = "N/m") = 10 "Vertical force per altitude error";
  parameter Real altitude_I(unit = "N/(m.s)") = 10 "Rate of the vertical force per altitude error";
  parameter Real altitude_D(unit = "N.s/m") = 3 "Vertical force per rate of the altitude error";
  parameter Real altitude_N(unit = "rad/s") = 40 "Bandwidth of the derivative filter";
  parameter Real force_min(unit = "N") = 2 "Of the vertical force";
  parameter Real force_max(unit = "N") = 7 "Of the vertical force";
  parameter Real filter_frequency(unit = "Hz", min = 0.01, max = 49) = 20 "Of the low-pass on the vertical force";
  parameter Real mass(unit = "kg") = 0.441 "Of the quadcopter, as the controller believes it";
  parameter Real thrust_coefficient(unit = "N.s2/rad2") = 8.24e-6 "Thrust of a rotor over its squared speed";
  input Vehicle vehicle;
  input Acceleration acceleration_command "In the world frame, whatever the heading";
  input Real altitude_command(start = 2, unit = "m") "Of the centre of mass";
  input Real yaw_command(start = 0, unit = "rad") "Counter-clockwise from east";
  input Boolean reset(start = false) "Holds the start state: level, with the force that carries the weight";
  output Real roll_command(start = 0, unit = "rad") "Positive: left side up, accelerates to the right";
  output Real pitch_command(start = 0, unit = "rad") "Positive: nose down, accelerates forward";
  output Real throttle(start = 0, unit = "%");
  output Real thrust(start = 0, unit = "N") "Wanted, of all rotors together";
protected
  final parameter Real weight(unit = "N") = mass*gravity;
  discrete Real force_x(start = 0, fixed = true, unit = "N");
  discrete Real force_y(start = 0, fixed = true, unit = "N");
  discrete Real z_x(start = 0, fixed = true) "Body axis z in the world frame: along the force";
  discrete Real z_y(start = 0, fixed = true);
  discrete Real z_z(start = 1, fixed = true);
  discrete Real c(start = 1, fixed = true) "cos(yaw_command)";
  discrete Real s(start = 0, fixed = true) "sin(yaw_command)";
  discrete Real y_x(start = 0, fixed = true) "Body axis y: across the heading";
  discrete Real y_y(start = 1, fixed = true);
  discrete Real y_z(start = 0, fixed = true);
  discrete Real across(start = 1, fixed = true) "Length of y before it is made one";
  Pid climb(
    final P = altitude_P,
    final I = altitude_I,
    final D = altitude_D,
    final N = altitude_N,
    final u_min = force_min,
    final u_max = force_max,
    final u_start = weight);
  Butterworth low_pass(
    final frequency = filter_frequency,
    final u_start = weight);
equation
  climb.error = altitude_command - vehicle.position.z;
  climb.feed_forward = 0;
  climb.reset = reset;
  low_pass.u = climb.u;
  low_pass.reset = reset;
algorithm
  when sample(0, sample_period) then
    force_x := if reset then 0.0 else mass*acceleration_command.x;
    force_y := if reset then 0.0 else mass*acceleration_command.y;
    thrust := sqrt(force_x^2 + force_y^2 + low_pass.y^2);
    z_x := force_x/thrust;
    z_y := force_y/thrust;
    z_z := low_pass.y/thrust;
    c := cos(yaw_command);
    s := sin(yaw_command);
    y_x := -z_z*s;
    y_y := z_z*c;
    y_z := z_x*s - z_y*c;
    across := sqrt(y_x^2 + y_y^2 + y_z^2);
    y_x := y_x/across;
    y_y := y_y/across;
    y_z := y_z/across;
    pitch_command := -asin(limit(y_x*z_y - y_y*z_x, -1, 1));
    roll_command := atan2(y_z, z_z);
    throttle := 100/rotor_speed_max*sqrt(thrust/(4*thrust_coefficient));
  end when;
end InverseKinematics;
