within Estimation;
block DeckFilter "Motion of a landing deck relative to the quadcopter, from the filter of the vessel and sights of a marker"
  // The receivers of vessel and quadcopter drift apart by centimetres. Sights of the marker measure this offset, which is estimated by
  // a Kalman filter for each axis. Y. Bar-Shalom, X. R. Li, T. Kirubarajan: Estimation with Applications to Tracking and Navigation
  // (2001), section 5.2.
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

  record Orientation "Unit quaternion, body to world"
    Real w(start = 1);
    Real x;
    Real y;
    Real z;
  end Orientation;

  record Vehicle "Estimated pose of the quadcopter"
    Position position;
    Orientation orientation;
  end Vehicle;

  record Vessel "Estimated motion of the deck"
    Position position;
    Velocity velocity;
  end Vessel;

  record Marker "Measurement of a marker camera"
    Position position "Body axes of the quadcopter";
    Real time(unit = "s") "Of the picture";
  end Marker;

  parameter Real start_deviation(unit = "m", min = 0) = 0.02 "Standard deviation of the offset without sights";
  parameter Real drift_time(unit = "s", min = 1) = 60 "Correlation time of the offset";
  parameter Real position_noise(unit = "m", min = 1e-6) = 0.005 "Standard deviation of a sight at a distance of 0";
  parameter Real angle_noise(unit = "rad", min = 0) = 0.015 "Of the attitude, which turns the sight";
  input Vehicle vehicle;
  input Vessel vessel;
  input Marker marker;
  output Position position "Of the deck, in the frame of the quadcopter's own estimate";
  output Velocity velocity;
  output Real offset_deviation(start = 0, unit = "m") "Standard deviation of the offset along each axis";
protected
  function to_world "Turn a vector from body axes to world axes"
    input Real q[4] "Unit quaternion w, x, y, z";
    input Real v[3];
    output Real turned[3];
  protected
    Real half[3];
  algorithm
    half := cross(q[2:4], v) + q[1]*v;
    turned := v + 2*cross(q[2:4], half);
  end to_world;

  constant Real h(unit = "s") = 0.01;
  final parameter Real keep = exp(-h/drift_time);
  discrete Boolean running(start = false, fixed = true);
  discrete Real sight_time(start = 0, fixed = true, unit = "s");
  discrete Real east[20](each start = 0, each fixed = true) "From the deck to the quadcopter, the latest first";
  discrete Real north[20](each start = 0, each fixed = true);
  discrete Real up[20](each start = 0, each fixed = true);
  discrete Real w[20](each start = 1, each fixed = true) "Orientation of the quadcopter, the latest first";
  discrete Real x[20](each start = 0, each fixed = true);
  discrete Real y[20](each start = 0, each fixed = true);
  discrete Real z[20](each start = 0, each fixed = true);
  discrete Integer age(start = 1, fixed = true) "Of the picture: index of its pose";
  discrete Real sight[3](each start = 0, each fixed = true) "From the quadcopter to the deck, world axes";
  discrete Real offset[3](each start = 0, each fixed = true);
  discrete Real variance(start = 0, fixed = true);
  discrete Real noise(start = 0, fixed = true) "Variance of a sight";
algorithm
  when sample(0, 0.01) then
    east := cat(1, {vehicle.position.x - vessel.position.x}, pre(east[1:19]));
    north := cat(1, {vehicle.position.y - vessel.position.y}, pre(north[1:19]));
    up := cat(1, {vehicle.position.z - vessel.position.z}, pre(up[1:19]));
    w := cat(1, {vehicle.orientation.w}, pre(w[1:19]));
    x := cat(1, {vehicle.orientation.x}, pre(x[1:19]));
    y := cat(1, {vehicle.orientation.y}, pre(y[1:19]));
    z := cat(1, {vehicle.orientation.z}, pre(z[1:19]));

    variance := if pre(running) then keep^2*pre(variance) + (1 - keep^2)*start_deviation^2 else start_deviation^2;
    offset := keep*pre(offset);
    if pre(running) and marker.time > pre(sight_time) then
      age := integer(min(20, max(1, floor((time - marker.time)/h + 1.5))));
      sight := to_world({w[age], x[age], y[age], z[age]}, {marker.position.x, marker.position.y, marker.position.z});
      noise := position_noise^2 + angle_noise^2*(sight*sight);
      offset := offset + variance/(variance + noise)*({east[age], north[age], up[age]} + sight - offset);
      variance := variance*noise/(variance + noise);
    end if;
    running := true;
    sight_time := marker.time;

    position.x := vessel.position.x + offset[1];
    position.y := vessel.position.y + offset[2];
    position.z := vessel.position.z + offset[3];
    velocity.x := vessel.velocity.x;
    velocity.y := vessel.velocity.y;
    velocity.z := vessel.velocity.z;
    offset_deviation := sqrt(variance);
  end when;
end DeckFilter;
