within Fleet;
partial block DisturbanceTracking "Attitude control with an estimate of the acceleration that rotors and gravity do not explain, such as wind"
  extends TrackingController;
  parameter Real increment_bandwidth(unit = "rad/s", min = 1, max = 100) = 10 "Of the filter on acceleration and force";
  parameter Real rotor_time_constant(unit = "s", min = 0.001) = 0.04 "Of the thrust, as the controller believes it";
  parameter Real disturbance_limit(unit = "m/s2") = 6 "Largest acceleration by wind, along each axis";
protected
  final parameter Real quick = 1 - exp(-increment_bandwidth*sample_period);
  final parameter Real spin = 1 - exp(-sample_period/rotor_time_constant);
  discrete Boolean running(start = false, fixed = true);
  discrete Real v[3](each start = 0, each fixed = true) "Velocity";
  discrete Real smooth_v[3](each start = 0, each fixed = true) "Low-pass filtered velocity";
  discrete Real lift(start = 0, fixed = true, unit = "N") "Thrust behind the lag of the rotors";
  discrete Real smooth_f[3](each start = 0, each fixed = true) "Low-pass filtered specific force of the rotors";
  discrete Real disturbance[3](each start = 0, each fixed = true) "Filtered acceleration that rotors and gravity do not explain";
algorithm
  when sample(0, sample_period) then
    v := {vehicle.velocity.x, vehicle.velocity.y, vehicle.velocity.z};
    running := not reset;
    smooth_v := if pre(running) then pre(smooth_v) + quick*(v - pre(smooth_v)) else v;
    lift := if reset then mass*gravity else pre(lift) + spin*(pre(thrust) - pre(lift));
    smooth_f := if pre(running) then pre(smooth_f) + quick*(lift/mass*pre(R[:, 3]) - pre(smooth_f)) else {0.0, 0.0, gravity};
    for i in 1:3 loop
      disturbance[i] := if pre(running) then limit(
        (smooth_v[i] - pre(smooth_v[i]))/sample_period + (if i == 3 then gravity else 0.0) - smooth_f[i],
        -disturbance_limit, disturbance_limit) else 0.0;
    end for;
  end when;
end DisturbanceTracking;
