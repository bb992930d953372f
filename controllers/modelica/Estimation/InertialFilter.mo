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

  parameter Real earth[2](each unit = "rad") = {1.551190995937692, 0.967273} "Magnetic field: heading, counter-clockwise from east, and dip";
  parameter Real density[4] = {3e-3, 3e-4, 2e-5, 2e-4} "Noise of velocity, attitude, gyroscope and accelerometer bias per square root of s";
  parameter Real start_deviation[3] = {0.02, 0.02, 0.2} "Standard deviations: roll and pitch, biases of gyroscopes and accelerometers";
  parameter Real noise[4] = {0.02, 0.03, 0.05, 0.012} "Of horizontal and vertical position, velocity and heading";
  input Imu imu;
  input Gnss gnss;
  input Magnetometer magnetometer;
  output Position position;
  output Velocity velocity;
  output Orientation orientation;
  output Attitude attitude;
  output Rates rates "Without bias";
  output Real deviation[9] "Standard deviations of position (world), velocity (world) and attitude (body): x, y, z of each";
protected
  constant Real h(unit = "s") = 0.01;
  pure function start
    input Real position[3];
    input Real velocity[3];
    input Real field[3];
    input Real earth[2];
    input Real deviation[3];
    input Real noise[4];
    output Real next[244];
  external "C" ekf_start(position, velocity, field, earth, deviation, noise, next) annotation(Include = "#include \"inertial_ekf.h\"");
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
    input Boolean has_field;
    input Real field[3];
    input Real earth[2];
    input Real noise[4];
    output Real next[244];
  external "C" ekf_step(state, h, rates, force, density, has_fix, position, velocity, delay, has_field, field,
    earth, noise, next) annotation(Include = "#include \"inertial_ekf.h\"");
  end advance;

  discrete Boolean running(start = false, fixed = true);
  discrete Real fix_time(start = 0, fixed = true);
  discrete Real field_time(start = 0, fixed = true);
  discrete Real rates_now[3](each start = 0, each fixed = true) "Of the gyroscopes; a step turns by the mean of its two ends";
  discrete Real field[3](each start = 0, each fixed = true);
  discrete Real state[244](each start = 0, each fixed = true);
algorithm
  when sample(0, 0.01) then
    rates_now := {imu.rates.p, imu.rates.q, imu.rates.r};
    field := {magnetometer.field.x, magnetometer.field.y, magnetometer.field.z};
    if pre(running) then
      state := advance(pre(state), h, (pre(rates_now) + rates_now)/2,
        {imu.acceleration.x, imu.acceleration.y, imu.acceleration.z}, density, gnss.time > pre(fix_time),
        {gnss.position.x, gnss.position.y, gnss.position.z}, {gnss.velocity.x, gnss.velocity.y, gnss.velocity.z},
        time - gnss.time, magnetometer.time > pre(field_time), field, earth, noise);
    else
      state := start({gnss.position.x, gnss.position.y, gnss.position.z}, {gnss.velocity.x, gnss.velocity.y, gnss.velocity.z}, field,
        earth, start_deviation, noise);
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
    for i in 1:9 loop
      deviation[i] := sqrt(max(0, state[4 + 16*i]));
    end for;
  end when;
end InertialFilter;
