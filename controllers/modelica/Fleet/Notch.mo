within Fleet;
block Notch "Sampled notch filter of second order by the bilinear transform, exact at its centre"
  // transposed direct form II of (s^2 + 2 depth w s + w^2)/(s^2 + 2 width w s + w^2)
  parameter Real period(unit = "s", min = 0.05) = 1 "Of the oscillation that is removed";
  parameter Real depth(unit = "1", min = 0) = 0.1 "Damping ratio of the zeros";
  parameter Real width(unit = "1", min = 0.01) = 0.7 "Damping ratio of the poles";
  input Real u(start = 0);
  output Real y(start = 0);
protected
  final parameter Real K = tan(pi*sample_period/period);
  final parameter Real a0 = 1 + 2*width*K + K*K;
  final parameter Real b0 = (1 + 2*depth*K + K*K)/a0;
  final parameter Real b1 = 2*(K*K - 1)/a0 "Also of the denominator";
  final parameter Real b2 = (1 - 2*depth*K + K*K)/a0;
  final parameter Real a2 = (1 - 2*width*K + K*K)/a0;
  discrete Boolean running(start = false, fixed = true);
  discrete Real near(start = 0, fixed = true);
  discrete Real far(start = 0, fixed = true);
algorithm
  when sample(0, sample_period) then
    near := if pre(running) then pre(near) else (1 - b0)*u;
    far := if pre(running) then pre(far) else (b2 - a2)*u;
    running := true;
    y := b0*u + near;
    near := b1*u - b1*y + far;
    far := b2*u - a2*y;
  end when;
end Notch;
