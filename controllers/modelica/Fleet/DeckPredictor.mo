within Fleet;
block DeckPredictor "Accelerations of a landing deck in waves, a moment ahead: it swings about its mean motion like a harmonic oscillator"
  record Deck "Measurements of the landing deck"
    Spatial.Position position "Centre of its top";
    Spatial.Velocity velocity "Of that point";
  end Deck;

  parameter Real prediction_time(unit = "s", min = 0, max = 1) = 0.12 "How far ahead, horizontally: the lag of the attitude loop";
  parameter Real filter_bandwidth(unit = "rad/s", min = 1) = 20 "Of the differentiation of velocities";
  parameter Real mean_time(unit = "s", min = 0.1) = 6 "Of the means about which the deck swings";
  parameter Real memory(unit = "s", min = 0.1) = 10 "Of the averages that tell the frequency of the swinging";
  input Deck target;
  output Real heave(start = 0, unit = "m") "Of the deck, above its mean height";
  output Spatial.Acceleration acceleration "Of the deck: horizontally ahead in time, vertically now";
  output Real frequency(start = 0, fixed = true, unit = "rad/s") "Of the swinging, as far as it is known";
protected
  final parameter Real quick = 1 - exp(-filter_bandwidth*sample_period);
  final parameter Real slow = 1 - exp(-sample_period/mean_time);
  final parameter Real forget = 1 - exp(-sample_period/memory);
  constant Real calm(unit = "m2/s2") = 1e-4 "Squared speed below which nothing swings";
  constant Real frequency_max(unit = "rad/s") = 10;
  discrete Boolean running(start = false, fixed = true);
  discrete Real height(start = 0, fixed = true) "Mean";
  discrete Real v[3](each start = 0, each fixed = true) "Velocity";
  discrete Real lagging[3](each start = 0, each fixed = true) "Low-pass filtered velocity";
  discrete Real mean[3](each start = 0, each fixed = true) "Velocity";
  discrete Real a[3](each start = 0, each fixed = true) "Acceleration";
  discrete Real speed_2(start = 0, fixed = true, unit = "m2/s2") "Mean square of the vertical swinging";
  discrete Real acceleration_2(start = 0, fixed = true, unit = "m2/s4") "Mean square of the vertical acceleration";
  discrete Real c(start = 1, fixed = true) "Cosine and sine of the angle by which the deck swings on meanwhile";
  discrete Real s(start = 0, fixed = true);
algorithm
  when sample(0, sample_period) then
    v := {target.velocity.x, target.velocity.y, target.velocity.z};
    lagging := if pre(running) then pre(lagging) + quick*(v - pre(lagging)) else v;
    mean := if pre(running) then pre(mean) + slow*(v - pre(mean)) else v;
    height := if pre(running) then pre(height) + slow*(target.position.z - pre(height)) else target.position.z;
    a := if pre(running) then (lagging - pre(lagging))/sample_period else {0.0, 0.0, 0.0};
    running := true;

    speed_2 := pre(speed_2) + forget*((lagging[3] - mean[3])^2 - pre(speed_2));
    acceleration_2 := pre(acceleration_2) + forget*(a[3]^2 - pre(acceleration_2));
    frequency := min(frequency_max, sqrt(acceleration_2/(speed_2 + calm)));
    // the filter lags by 1/bandwidth, in which an oscillator changes its acceleration by -frequency^2*velocity
    a := a - frequency^2/filter_bandwidth*(v - mean);

    c := cos(frequency*prediction_time);
    s := sin(frequency*prediction_time);
    heave := target.position.z - height;
    acceleration.x := c*a[1] - s*frequency*(v[1] - mean[1]);
    acceleration.y := c*a[2] - s*frequency*(v[2] - mean[2]);
    acceleration.z := a[3];
  end when;
end DeckPredictor;
