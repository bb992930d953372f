within Fleet;
partial block TrackingController "Attitude control on SE(3): from the wanted specific force to rotor speeds; extending blocks compute the force"
  // T. Lee, M. Leok, N. H. McClamroch: Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010, equations 10 to 16
  record Orientation "Unit quaternion, body to world"
    Real w(start = 1, unit = "1");
    Real x(unit = "1");
    Real y(unit = "1");
    Real z(unit = "1");
  end Orientation;

  record Rates "Angular velocity in the body frame"
    Real p(unit = "rad/s");
    Real q(unit = "rad/s");
    Real r(unit = "rad/s");
  end Rates;

  record Vehicle "Measurements of the quadcopter"
    Spatial.Position position "Centre of mass";
    Spatial.Velocity velocity "Of the centre of mass";
    Orientation orientation;
    Rates rates;
  end Vehicle;

  parameter Real attitude_P(unit = "1/s2") = 150 "Angular acceleration per attitude error";
  parameter Real attitude_D(unit = "1/s") = 20 "Angular acceleration per error of the rates";
  parameter Real yaw_share(unit = "1", min = 0, max = 1) = 0.1 "Of these gains about the vertical body axis";
  parameter Real mass(unit = "kg") = 0.441 "Of the quadcopter, as the controller believes it";
  parameter Real inertia[3, 3](each unit = "kg.m2") = {
      {0.002835, 0.000978, 0.000116},
      {0.000978, 0.002821, -0.000111},
      {0.000116, -0.000111, 0.005131}};
  parameter Real arm(unit = "m") = 0.1815 "Distance of a rotor from the centre";
  parameter Real thrust_coefficient(unit = "N.s2/rad2") = 8.24e-6 "Thrust of a rotor over its squared speed";
  parameter Real torque_coefficient(unit = "N.m.s2/rad2") = 2.38e-7 "Reaction torque of a rotor over its squared speed";
  input Vehicle vehicle;
  input Spatial.Position position_reference;
  input Spatial.Velocity velocity_reference;
  input Spatial.Acceleration acceleration_reference;
  input Real tilt_limit(start = 25, unit = "deg");
  input Real yaw_reference(start = 0, unit = "rad") "Counter-clockwise from east";
  input Real motor_share(start = 0, unit = "1") "Share of the commanded rotor speeds; 0: motors stopped";
  input Boolean reset(start = false) "Holds the start state of the integrals";
  output Real rotor_speed[4](each start = 0, each unit = "rad/s") "Front, left, rear, right";
protected
  constant Real sink(unit = "m/s2") = 5 "Largest downward acceleration";
  discrete Real wanted[3](each start = 0, each fixed = true) "Specific force, world frame, assigned by extending blocks";
  discrete Real force[3](each start = 0, each fixed = true) "That force within the tilt limit";
  discrete Real shrink(start = 1, fixed = true) "Of a horizontal force that is too large";
  discrete Real R[3, 3](each start = 0, each fixed = true) "Attitude: columns are the body axes in the world frame";
  discrete Real E[3, 3](each start = 0, each fixed = true) "From the attitude to the wanted one";
  discrete Real omega[3](each start = 0, each fixed = true) "Angular velocity, body frame";
  discrete Real alpha[3](each start = 0, each fixed = true) "Wanted angular acceleration, body frame";
  discrete Real torque[3](each start = 0, each fixed = true);
  discrete Real thrust(start = 0, fixed = true, unit = "N");
  discrete Real share[4](each start = 0, each fixed = true) "Thrust of each rotor";
algorithm
  when sample(0, sample_period) then
    shrink := min(1, tan(tilt_limit/degrees)*wanted[3]/max(1e-9, sqrt(wanted[1]^2 + wanted[2]^2)));
    force := {shrink*wanted[1], shrink*wanted[2], wanted[3]};

    R := Spatial.rotation(vehicle.orientation.w, vehicle.orientation.x, vehicle.orientation.y, vehicle.orientation.z);
    thrust := mass*max(0, force*R[:, 3]);
    E := transpose(Spatial.heading_frame(force/sqrt(force*force), yaw_reference))*R;
    omega := {vehicle.rates.p, vehicle.rates.q, vehicle.rates.r};
    alpha := -attitude_P/2*{E[3, 2] - E[2, 3], E[1, 3] - E[3, 1], E[2, 1] - E[1, 2]} - attitude_D*omega;
    alpha[3] := yaw_share*alpha[3];
    torque := inertia*alpha + cross(omega, inertia*omega);

    share := thrust/4*{1, 1, 1, 1} + torque[1]/(2*arm)*{0, 1, 0, -1} + torque[2]/(2*arm)*{-1, 0, 1, 0}
      + torque[3]*thrust_coefficient/(4*torque_coefficient)*{1, -1, 1, -1};
    for i in 1:4 loop
      rotor_speed[i] := motor_share*min(rotor_speed_max, sqrt(max(0, share[i])/thrust_coefficient));
    end for;
  end when;
end TrackingController;
