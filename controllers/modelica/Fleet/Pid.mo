within Fleet;
block Pid "Sampled PID controller: parallel form, filtered derivative, output limits, anti-windup, reset"
  parameter Real P = 0 "Proportional gain";
  parameter Real I = 0 "Integral gain, per second";
  parameter Real D = 0 "Derivative gain, times a second";
  parameter Real N(unit = "rad/s") = 100 "Bandwidth of the derivative filter";
  parameter Real u_min = -1e9 "Lower output limit";
  parameter Real u_max = 1e9 "Upper output limit";
  parameter Real u_start = 0 "Integral at the start and after a reset";
  input Real error(start = 0) "Command minus measurement";
  input Real feed_forward(start = 0) "Added to the output before it is limited";
  input Boolean reset(start = false) "Holds the start state: the error is ignored";
  output Real u(start = 0) "Limited output";
protected
  final parameter Real h = N*sample_period;
  final parameter Real decay = 1 - h + h^2/2 - h^3/6 "Of the filter in one period, by a third-order Runge-Kutta step";
  discrete Boolean running(start = false, fixed = true) "False until the first tick after a reset";
  discrete Boolean fresh(start = true, fixed = true);
  discrete Real e(start = 0, fixed = true);
  discrete Real integral(start = 0, fixed = true);
  discrete Real filtered(start = 0, fixed = true) "Low-pass filtered D*e";
  discrete Real unlimited(start = 0, fixed = true);
algorithm
  when sample(0, sample_period) then
    fresh := reset or not pre(running);
    running := not reset;
    e := if reset then 0.0 else error;
    integral := if fresh then u_start else pre(integral);
    filtered := if fresh then D*e else pre(filtered);
    unlimited := feed_forward + P*e + integral + N*(D*e - filtered);
    u := limit(unlimited, u_min, u_max);
    if I*e*(unlimited - u) <= 0 then
      integral := integral + sample_period*I*e;
    end if;
    filtered := D*e + decay*(filtered - D*e);
  end when;
end Pid;
