within Estimation;
block InertialFilter "Inertial navigation by an error-state extended Kalman filter, aided by GNSS and magnetometer"
  // J. Sola: Quaternion kinematics for the error-state Kalman filter (2017); C code and equations in inertial_ekf.h
  record Position "World frame"
    Real x(unit = "m");
    Real y(unit = "m");
    Real z(unit = "m");
  end Position;

  record Velocity "World frame"
    Real x(unit = "m/s");
    Real y(unit = "m/s");
    Real z(unit = "m/s");
  end Velocity;

  record Acceleration "Body frame"
    Real x(unit = "m/s2");
    Real y(unit = "m/s2");
    Real z(unit = "m/s2");
  end Acceleration;

  record Field "Body frame"
    Real x(unit = "T");
    Real y(unit = "T");
    Real z(unit = "T");
  end Field;

  record Rates "Body frame"
    Real p(unit = "rad/s");
    Real q(unit = "rad/s");
    Real r(unit = "rad/s");
  end Rates;

  record Imu
    Acceleration acceleration "Specific force";
    Rates rates;
  end Imu;

  record Gnss
    Position position;
    Velocity velocity;
    Real time(unit = "s") "Of the sample";
  end Gnss;

  record Magnetometer
    Field field;
    Real time(unit = "s") "Of the sample";
  end Magnetometer;

  record Orientation "Unit quaternion, body to world"
    Real w(start = 1);
    Real x;
    Real y;
    Real z;
  end Orientation;

  record Attitude
    Real roll(unit = "rad");
    Real pitch(unit = "rad");
    Real yaw(unit = "rad");
  end Attitude;

  parameter Real declination(unit = "rad") = 1.551190995937692 "Heading of the horizontal magnetic field, counter-clockwise from east";
  parameter Real density[4] = {2e-3, 3e-4, 2e-5, 2e-4} "Noise of velocity, attitude, gyroscope and accelerometer bias per square root of s";
  parameter Real start_deviation[5] = {0.05, 0.05, 0.02, 0.02, 0.2} "Standard deviations: position, velocity, attitude, both biases";
  parameter Real noise[4] = {0.012, 0.02, 0.05, 0.03} "Of horizontal and vertical position, velocity and heading";
  input Imu imu;
  input Gnss gnss;
  input Magnetometer magnetometer;
  output Position position;
  output Velocity velocity;
  output Orientation orientation;
  output Attitude attitude;
  output Rates rates "Without bias";
  output Real position_deviation(unit = "m") "Standard deviation of the position east";
protected
  constant Real h(unit = "s") = 0.01;
  pure function start
    input Real position[3];
    input Real yaw;
    input Real deviation[5];
    output Real next[244];
  external "C" ekf_start(position, yaw, deviation, next) annotation(Include = "#include \"inertial_ekf.h\"");
  end start;

  pure function advance
    input Real state[244];
    input Real h;
    input Real rates[3];
    input Real force[3];
    input Real density[4];
    input Boolean has_fix;
    input Real position[3];
    input Real velocity[3];
    input Real delay;
    input Boolean has_yaw;
    input Real yaw;
    input Real noise[4];
    output Real next[244];
  external "C" ekf_step(state, h, rates, force, density, has_fix, position, velocity, delay, has_yaw, yaw, noise, next)
    annotation(Include = "#include \"inertial_ekf.h\"");
  end advance;

  discrete Boolean running(start = false, fixed = true);
  discrete Real fix_time(start = 0, fixed = true);
  discrete Real field_time(start = 0, fixed = true);
  discrete Real roll(start = 0, fixed = true);
  discrete Real pitch(start = 0, fixed = true);
  discrete Real yaw(start = 0, fixed = true) "Measured, levelled with the estimate";
  discrete Real state[244](each start = 0, each fixed = true);
algorithm
  when sample(0, 0.01) then
    roll := if pre(running) then atan2(2*(pre(state[7])*pre(state[8]) + pre(state[9])*pre(state[10])), 1 - 2*(pre(state[8])^2 + pre(state[9])^2)) else 0.0;
    pitch := if pre(running) then asin(min(1, max(-1, 2*(pre(state[7])*pre(state[9]) - pre(state[10])*pre(state[8]))))) else 0.0;
    yaw := declination - atan2(
      cos(roll)*magnetometer.field.y - sin(roll)*magnetometer.field.z,
      cos(pitch)*magnetometer.field.x + sin(pitch)*(sin(roll)*magnetometer.field.y + cos(roll)*magnetometer.field.z));
    if pre(running) then
      state := advance(pre(state), h, {imu.rates.p, imu.rates.q, imu.rates.r},
        {imu.acceleration.x, imu.acceleration.y, imu.acceleration.z}, density, gnss.time > pre(fix_time),
        {gnss.position.x, gnss.position.y, gnss.position.z}, {gnss.velocity.x, gnss.velocity.y, gnss.velocity.z},
        time - gnss.time, magnetometer.time > pre(field_time), yaw, noise);
    else
      state := start({gnss.position.x, gnss.position.y, gnss.position.z}, yaw, start_deviation);
    end if;
    running := true;
    fix_time := gnss.time;
    field_time := magnetometer.time;

    position.x := state[1];
    position.y := state[2];
    position.z := state[3];
    velocity.x := state[4];
    velocity.y := state[5];
    velocity.z := state[6];
    orientation.w := state[7];
    orientation.x := state[8];
    orientation.y := state[9];
    orientation.z := state[10];
    attitude.roll := atan2(2*(state[7]*state[8] + state[9]*state[10]), 1 - 2*(state[8]^2 + state[9]^2));
    attitude.pitch := asin(min(1, max(-1, 2*(state[7]*state[9] - state[10]*state[8]))));
    attitude.yaw := atan2(2*(state[7]*state[10] + state[8]*state[9]), 1 - 2*(state[9]^2 + state[10]^2));
    rates.p := imu.rates.p - state[11];
    rates.q := imu.rates.q - state[12];
    rates.r := imu.rates.r - state[13];
    position_deviation := sqrt(max(0, state[20]));
  end when;
end InertialFilter;
