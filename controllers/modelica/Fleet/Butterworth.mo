within Fleet;
block Butterworth "Sampled low-pass of order 15, made by the bilinear transform: seven sections of order two, one of order one"
  parameter Real frequency(unit = "Hz", min = 0.01, max = 49) = 20 "At which the gain is -3 dB";
  parameter Real u_start = 0 "Steady input before the start and after a reset";
  input Real u(start = 0);
  input Boolean reset(start = false) "Holds the start state: the input is ignored";
  output Real y(start = 0);
protected
  constant Integer order = 15;
  final parameter Real K = tan(pi*frequency*sample_period) "Cut-off frequency, warped so that it is met exactly";
  final parameter Real b = K/(K + 1);
  final parameter Real a1 = (K - 1)/(K + 1);
  discrete Boolean running(start = false, fixed = true) "False until the first tick after a reset";
  discrete Boolean fresh(start = true, fixed = true);
  discrete Real last(start = 0, fixed = true) "State of the section of order one";
  LowPassSection section1(final K = K, final damping = 2*cos(pi*1/order), final u_start = u_start);
  LowPassSection section2(final K = K, final damping = 2*cos(pi*2/order), final u_start = u_start);
  LowPassSection section3(final K = K, final damping = 2*cos(pi*3/order), final u_start = u_start);
  LowPassSection section4(final K = K, final damping = 2*cos(pi*4/order), final u_start = u_start);
  LowPassSection section5(final K = K, final damping = 2*cos(pi*5/order), final u_start = u_start);
  LowPassSection section6(final K = K, final damping = 2*cos(pi*6/order), final u_start = u_start);
  LowPassSection section7(final K = K, final damping = 2*cos(pi*7/order), final u_start = u_start);
equation
  section1.u = u;
  section1.reset = reset;
  section2.u = section1.y;
  section2.reset = reset;
  section3.u = section2.y;
  section3.reset = reset;
  section4.u = section3.y;
  section4.reset = reset;
  section5.u = section4.y;
  section5.reset = reset;
  section6.u = section5.y;
  section6.reset = reset;
  section7.u = section6.y;
  section7.reset = reset;
algorithm
  when sample(0, sample_period) then
    fresh := reset or not pre(running);
    running := not reset;
    last := if fresh then (1 - b)*u_start else pre(last);
    y := b*section7.y + last;
    last := b*section7.y - a1*y;
  end when;
end Butterworth;
