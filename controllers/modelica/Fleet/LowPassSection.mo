within Fleet;
block LowPassSection "Second-order part of a sampled low-pass, made by the bilinear transform, in transposed direct form II"
  parameter Real K = 1 "tan(pi*f/fs) for the cut-off frequency f and the sample frequency fs";
  parameter Real damping = 1 "Coefficient c of the analog prototype s^2 + c*s + 1";
  parameter Real u_start = 0 "Steady input before the start and after a reset";
  input Real u(start = 0);
  input Boolean reset(start = false) "Holds the start state: the input is ignored";
  output Real y(start = 0);
protected
  final parameter Real a0 = 1 + damping*K + K^2;
  final parameter Real a1 = 2*(K^2 - 1)/a0;
  final parameter Real a2 = (1 - damping*K + K^2)/a0;
  final parameter Real b = K^2/a0;
  discrete Boolean running(start = false, fixed = true) "False until the first tick after a reset";
  discrete Boolean fresh(start = true, fixed = true);
  discrete Real x(start = 0, fixed = true);
  discrete Real near(start = 0, fixed = true);
  discrete Real far(start = 0, fixed = true);
algorithm
  when sample(0, sample_period) then
    fresh := reset or not pre(running);
    running := not reset;
    x := if reset then u_start else u;
    near := if fresh then (1 - b)*u_start else pre(near);
    far := if fresh then (b - a2)*u_start else pre(far);
    y := b*x + near;
    near := 2*b*x - a1*y + far;
    far := b*x - a2*y;
  end when;
end LowPassSection;
