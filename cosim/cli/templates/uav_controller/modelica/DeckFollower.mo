block DeckFollower "Quadcopter controller that flies above the deck; SI units, angles in rad"
  record Position "World frame: east, north, up"
    Real x(unit = "m");
    Real y(unit = "m");
    Real z(unit = "m");
  end Position;

  record Velocity "World frame: east, north, up"
    Real x(unit = "m/s");
    Real y(unit = "m/s");
    Real z(unit = "m/s");
  end Velocity;

  record Attitude
    Real roll(unit = "rad") "Positive: left side up";
    Real pitch(unit = "rad") "Positive: nose down";
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Rates "Angular velocity, body frame: forward, left, up"
    Real p(unit = "rad/s");
    Real q(unit = "rad/s");
    Real r(unit = "rad/s");
  end Rates;

  record Vehicle "Measurements of the quadcopter"
    Position position;
    Velocity velocity;
    Attitude attitude;
    Rates rates;
  end Vehicle;

  record Target "Motion of the deck"
    Position position;
    Velocity velocity;
  end Target;

  constant Real sample_period(unit = "s") = 0.01;
  constant Real gravity(unit = "m/s2") = 9.81;
  parameter Real position_bandwidth(unit = "rad/s") = 1.2;
  parameter Real acceleration_limit(unit = "m/s2") = 3;
  parameter Real attitude_bandwidth(unit = "rad/s") = 8;
  parameter Real yaw_bandwidth(unit = "rad/s") = 2;
  parameter Real mass(unit = "kg") = 0.443892;
  parameter Real inertia_xy(unit = "kg.m2") = 0.00283 "About the axes forward and left";
  parameter Real inertia_z(unit = "kg.m2") = 0.005131;
  parameter Real arm(unit = "m") = 0.1815;
  parameter Real torque_per_thrust(unit = "m") = 0.0289
    "Reaction torque of a rotor over its thrust";
  parameter Real thrust_coefficient(unit = "N.s2/rad2") = 8.24e-6
    "Thrust of a rotor over its squared speed";
  parameter Real rotor_speed_limit(unit = "rad/s") = 523.6;
  input Vehicle vehicle;
  input Target target;
  input Real altitude_command(unit = "m", start = 2);
  input Real yaw_command(unit = "rad") "Counter-clockwise from east";
  output Real rotor_speed[4](each start = 0, each fixed = true, each unit = "rad/s")
    "Front, left, rear, right";
protected
  Real east(unit = "m/s2") "Commanded acceleration";
  Real north(unit = "m/s2");
  Real up(unit = "m/s2");
  Real roll(unit = "rad") "Commanded attitude";
  Real pitch(unit = "rad");
  Real thrust(unit = "N");
  Real turn(unit = "rad");
  Real x(unit = "N") "Torque about the body axis over twice the arm";
  Real y(unit = "N");
  Real z(unit = "N") "Yaw torque over four times the torque per thrust";
  Real thrusts[4](each unit = "N");
equation
  // Position: critically damped control.
  east = max(-acceleration_limit, min(acceleration_limit,
    position_bandwidth^2 * (target.position.x - vehicle.position.x)
    + 2 * position_bandwidth * (target.velocity.x - vehicle.velocity.x)));
  north = max(-acceleration_limit, min(acceleration_limit,
    position_bandwidth^2 * (target.position.y - vehicle.position.y)
    + 2 * position_bandwidth * (target.velocity.y - vehicle.velocity.y)));
  up = max(-acceleration_limit, min(acceleration_limit,
    position_bandwidth^2 * (altitude_command - vehicle.position.z)
    - 2 * position_bandwidth * vehicle.velocity.z));

  // Tilt of the thrust: a positive pitch angle lowers the nose, a positive roll angle raises the
  // left side.
  pitch = atan2(east * cos(vehicle.attitude.yaw) + north * sin(vehicle.attitude.yaw), gravity);
  roll = -atan2(north * cos(vehicle.attitude.yaw) - east * sin(vehicle.attitude.yaw), gravity);
  thrust = mass * (gravity + up)
    / max(0.5, cos(vehicle.attitude.roll) * cos(vehicle.attitude.pitch));

  // Attitude: control with a damping ratio of 0.8.
  turn = atan2(sin(yaw_command - vehicle.attitude.yaw), cos(yaw_command - vehicle.attitude.yaw));
  x = inertia_xy * (attitude_bandwidth^2 * (roll - vehicle.attitude.roll)
    - 1.6 * attitude_bandwidth * vehicle.rates.p) / (2 * arm);
  y = inertia_xy * (attitude_bandwidth^2 * (pitch - vehicle.attitude.pitch)
    - 1.6 * attitude_bandwidth * vehicle.rates.q) / (2 * arm);
  z = inertia_z * (yaw_bandwidth^2 * turn
    - 1.6 * yaw_bandwidth * vehicle.rates.r) / (4 * torque_per_thrust);

  // Front and rear rotor turn the body counter-clockwise by their reaction torques.
  thrusts = {thrust / 4 - y + z, thrust / 4 + x - z, thrust / 4 + y + z, thrust / 4 - x - z};
algorithm
  when sample(0, sample_period) then
    for i in 1:4 loop
      rotor_speed[i] := min(rotor_speed_limit, sqrt(max(0, thrusts[i]) / thrust_coefficient));
    end for;
  end when;
end DeckFollower;
