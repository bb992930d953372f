within Fleet;
block QuiescentWindow "Calm moments of deck and wind: a slow deck now and at the touchdown, and an upright quadcopter"
  // In waves the slope under a vessel is greatest where the surface rises or falls fastest, and zero on crests and in troughs.
  parameter Real touchdown_time(unit = "s", min = 0) = 0.4 "Between the decision and the contact";
  parameter Real calm_share(unit = "1", min = 0) = 1 "Of the usual vertical speed (RMS) that counts as calm";
  parameter Real calm_speed(unit = "m/s", min = 0) = 0.1 "Vertical speed that always counts as calm";
  parameter Real calm_tilt(unit = "deg", min = 0) = 10 "Of the quadcopter";
  parameter Real patience(unit = "s", min = 0.1) = 4 "In which these limits double from the begin of the descent on";
  parameter Real memory_time(unit = "s", min = 0.1) = 6 "Of the usual vertical speed";
  input Real speed(start = 0, unit = "m/s") "Vertical velocity of the deck";
  input Real acceleration(start = 0, unit = "m/s2") "Vertical acceleration of the deck";
  input Real tilt(start = 0, unit = "rad") "Of the quadcopter";
  input Boolean descending(start = false);
  output Boolean calm(start = true);
protected
  final parameter Real slow = 1 - exp(-sample_period/memory_time);
  discrete Real power(start = 0, fixed = true) "Mean squared speed";
  discrete Real waited(start = 0, fixed = true, unit = "s");
  discrete Real ease(start = 1, fixed = true) "Of the limits";
  discrete Real bound(start = 0, fixed = true) "Speed that counts as calm";
algorithm
  when sample(0, sample_period) then
    power := pre(power) + slow*(speed^2 - pre(power));
    waited := if descending then pre(waited) + sample_period else 0.0;
    ease := 1 + waited/patience;
    bound := ease*max(calm_speed, calm_share*sqrt(power));
    calm := abs(speed) <= bound and abs(speed + touchdown_time*acceleration) <= bound and degrees*tilt <= ease*calm_tilt;
  end when;
end QuiescentWindow;
