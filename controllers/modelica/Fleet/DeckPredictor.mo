within Fleet;
block DeckPredictor "Acceleration of a landing deck a moment ahead, from its velocity: filtered derivatives, extrapolated over their own lag too"
  record Deck "Measurements of the landing deck"
    Spatial.Position position "Centre of its top";
    Spatial.Velocity velocity "Of that point";
  end Deck;

  parameter Real prediction_time(unit = "s", min = 0, max = 1) = 0.12 "How far ahead, horizontally: the lag of the attitude loop";
  parameter Real acceleration_bandwidth(unit = "rad/s", min = 1) = 20 "Of the filter on the derivative of the velocity";
  parameter Real jerk_bandwidth(unit = "rad/s", min = 1) = 12 "Of the filter on the derivative of that";
  parameter Real mean_time(unit = "s", min = 0.1) = 6 "Of the mean height about which the deck heaves";
  input Deck target;
  output Real heave(start = 0, unit = "m") "Of the deck, above its mean height";
  output Spatial.Acceleration acceleration "Of the deck: horizontally ahead in time, vertically now";
protected
  final parameter Real lag(unit = "s") = 1/acceleration_bandwidth "Of the acceleration";
  final parameter Real quick = 1 - exp(-acceleration_bandwidth*sample_period);
  final parameter Real quick_jerk = 1 - exp(-jerk_bandwidth*sample_period);
  final parameter Real slow = 1 - exp(-sample_period/mean_time);
  discrete Boolean running(start = false, fixed = true);
  discrete Real height(start = 0, fixed = true) "Mean";
  discrete Real v[3](each start = 0, each fixed = true) "Velocity";
  discrete Real smooth_v[3](each start = 0, each fixed = true) "Low-pass filtered velocity";
  discrete Real a[3](each start = 0, each fixed = true) "Acceleration";
  discrete Real smooth_a[3](each start = 0, each fixed = true) "Low-pass filtered acceleration";
  discrete Real jerk[3](each start = 0, each fixed = true);
algorithm
  when sample(0, sample_period) then
    v := {target.velocity.x, target.velocity.y, target.velocity.z};
    smooth_v := if pre(running) then pre(smooth_v) + quick*(v - pre(smooth_v)) else v;
    a := if pre(running) then (smooth_v - pre(smooth_v))/sample_period else {0.0, 0.0, 0.0};
    smooth_a := pre(smooth_a) + quick_jerk*(a - pre(smooth_a));
    jerk := (smooth_a - pre(smooth_a))/sample_period;
    height := if pre(running) then pre(height) + slow*(target.position.z - pre(height)) else target.position.z;
    running := true;

    heave := target.position.z - height;
    acceleration.x := a[1] + (lag + prediction_time)*jerk[1];
    acceleration.y := a[2] + (lag + prediction_time)*jerk[2];
    acceleration.z := a[3] + lag*jerk[3];
  end when;
end DeckPredictor;
