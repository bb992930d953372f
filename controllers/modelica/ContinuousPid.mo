block ContinuousPid "PID controller in continuous time: filtered derivative, output limits, anti-windup by back-calculation"
  parameter Real P = 1 "Proportional gain";
  parameter Real I(unit = "1/s") = 0.5 "Integral gain";
  parameter Real D(unit = "s") = 0 "Derivative gain";
  parameter Real N(unit = "rad/s") = 50 "Bandwidth of the derivative filter";
  parameter Real tracking_time(unit = "s") = 1 "How fast the integral follows when the output is limited";
  parameter Real u_min = -1e9 "Lower output limit";
  parameter Real u_max = 1e9 "Upper output limit";
  parameter Real u_start = 0 "Integral at the start";
  input Real reference(start = 0);
  input Real measurement(start = 0);
  input Real feed_forward(start = 0) "Added to the output before it is limited";
  output Real u(start = 0) "Limited output";
protected
  Real error "Reference minus measurement";
  Real integral(start = u_start, fixed = true);
  Real filtered "Low-pass filtered error: without a jump at the start";
  Real unlimited "Output before the limits";
initial equation
  filtered = error;
equation
  error = reference - measurement;
  unlimited = feed_forward + P*error + integral + D*der(filtered);
  u = min(u_max, max(u_min, unlimited));
  der(filtered) = N*(error - filtered);
  der(integral) = I*error + (u - unlimited)/tracking_time;
end ContinuousPid;
