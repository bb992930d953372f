block DynamicPositioning "Station keeping of a vessel with two fixed propellers, which turns into the weather by itself"
  // T. I. Fossen, J. P. Strand: Nonlinear passive weather optimal positioning control (WOPC) system for ships and rigs,
  // Automatica 37 (2001): the vessel hangs on a virtual hinge ahead of it, whose place is adapted until the vessel is on station
  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Rates "Angular velocity in the body frame"
    Real r(unit = "rad/s");
  end Rates;

  record Vehicle "Measurements of the vessel"
    Fleet.Horizontal.Position position;
    Fleet.Horizontal.Velocity velocity;
    Attitude attitude;
    Rates rates;
  end Vehicle;

  parameter Real hinge(unit = "m", min = 0.1) = 1.0 "Distance of the hinge ahead of the vessel's position";
  parameter Real position_P(unit = "1/s2") = 0.5 "Acceleration per error of the hinge";
  parameter Real velocity_P(unit = "1/s") = 1.4 "Acceleration per velocity of the hinge";
  parameter Real position_I(unit = "1/s3") = 0.05 "Rate of the acceleration per error of the hinge";
  parameter Real adaptation(unit = "1/s") = 0.1 "Rate of the hinge's place per position error of the vessel";
  parameter Real trim_limit(unit = "m/s2") = 1.5 "Of the integral action along each axis";
  parameter Real error_limit(unit = "m") = 3 "Errors of the hinge are shortened to this length";
  parameter Real surge_mass(unit = "kg") = 85 "With payload and added mass";
  parameter Real yaw_inertia(unit = "kg.m2") = 42 "With payload and added mass";
  parameter Real propeller_arm(unit = "m", min = 0.01) = 0.395 "Of each propeller beside the centre line";
  parameter Real thrust_ahead(unit = "N.s2/rad2") = 0.01108 "Thrust over squared speed of a propeller";
  parameter Real thrust_astern(unit = "N.s2/rad2") = 0.006445 "The same astern";
  parameter Real propeller_limit(unit = "rad/s") = 100;
  input Vehicle vehicle;
  input Fleet.Horizontal.Position position_reference "Station";
  output Real propeller_speed[2](each start = 0, each unit = "rad/s") "Port, starboard";
  output Real position_error(start = 0, unit = "m") "Distance from the station";
protected
  discrete Boolean running(start = false, fixed = true);
  discrete Real c(start = 1, fixed = true);
  discrete Real s(start = 0, fixed = true);
  discrete Real place[2](each start = 0, each fixed = true) "Of the hinge, wanted, relative to the station";
  discrete Real error[2](each start = 0, each fixed = true) "Of the hinge";
  discrete Real ease(start = 1, fixed = true) "Of an error that is too large";
  discrete Real trim[2](each start = 0, each fixed = true);
  discrete Real a[2](each start = 0, each fixed = true) "Wanted acceleration of the hinge, world frame";
  discrete Real surge(start = 0, fixed = true, unit = "N");
  discrete Real yaw(start = 0, fixed = true, unit = "N") "Moment over the distance of the propellers";
  discrete Real most(start = 0, fixed = true, unit = "N") "Largest thrust of a propeller astern";
  discrete Real thrust[2](each start = 0, each fixed = true);
algorithm
  when sample(0, Fleet.sample_period) then
    c := cos(vehicle.attitude.yaw);
    s := sin(vehicle.attitude.yaw);
    place := if pre(running) then {
      pre(place[1]) + Fleet.sample_period*adaptation*(position_reference.x - vehicle.position.x),
      pre(place[2]) + Fleet.sample_period*adaptation*(position_reference.y - vehicle.position.y)} else {hinge*c, hinge*s};
    place := min(1, hinge/max(1e-9, Fleet.Horizontal.length(place[1], place[2])))*place;
    running := true;
    error := {
      position_reference.x + place[1] - vehicle.position.x - hinge*c,
      position_reference.y + place[2] - vehicle.position.y - hinge*s};
    ease := min(1, error_limit/max(1e-9, Fleet.Horizontal.length(error[1], error[2])));
    for i in 1:2 loop
      trim[i] := if ease < 1 then pre(trim[i])
        else Fleet.limit(pre(trim[i]) + Fleet.sample_period*position_I*error[i], -trim_limit, trim_limit);
    end for;
    a := {
      position_P*ease*error[1] + trim[1] - velocity_P*(vehicle.velocity.x - vehicle.rates.r*hinge*s),
      position_P*ease*error[2] + trim[2] - velocity_P*(vehicle.velocity.y + vehicle.rates.r*hinge*c)};

    // Steering has priority: surge is what the yaw moment leaves of the propellers' range.
    most := thrust_astern*propeller_limit^2;
    yaw := Fleet.limit(yaw_inertia/hinge*(c*a[2] - s*a[1])/(2*propeller_arm), -most, most);
    surge := Fleet.limit(surge_mass*(c*a[1] + s*a[2])/2, abs(yaw) - most, thrust_ahead*propeller_limit^2 - abs(yaw));
    thrust := {surge - yaw, surge + yaw};
    for i in 1:2 loop
      propeller_speed[i] := if thrust[i] >= 0 then sqrt(thrust[i]/thrust_ahead) else -sqrt(-thrust[i]/thrust_astern);
    end for;
    position_error := Fleet.Horizontal.length(position_reference.x - vehicle.position.x, position_reference.y - vehicle.position.y);
  end when;
end DynamicPositioning;
