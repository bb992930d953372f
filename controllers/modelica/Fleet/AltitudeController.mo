within Fleet;
block AltitudeController "Altitude loop: from altitude reference to the common throttle of the rotors"
  record Position
    Real z(unit = "m") "Up";
  end Position;

  record Vehicle "Measurements of the quadcopter"
    Position position "Centre of mass";
  end Vehicle;

  parameter Real altitude_P(unit = "%/m") = 170.242040782586 "Throttle per altitude error";
  parameter Real altitude_I(unit = "%/(m.s)") = 28.86184465251 "Throttle rate per altitude error";
  parameter Real altitude_D(unit = "%.s/m") = 50 "Throttle per rate of the altitude error";
  parameter Real altitude_N(unit = "rad/s") = 50 "Bandwidth of the derivative filter";
  parameter Real throttle_min(unit = "%") = 35;
  parameter Real throttle_max(unit = "%") = 90;
  parameter Real mass(unit = "kg") = 0.441 "Of the quadcopter, as the controller believes it";
  parameter Real thrust_coefficient(unit = "N.s2/rad2") = 8.24e-6 "Thrust of a rotor over its squared speed";
  final parameter Real hover_throttle(unit = "%") = 100/rotor_speed_max*sqrt(mass*gravity/(4*thrust_coefficient))
    "Throttle that carries the weight: the integral starts there";
  input Vehicle vehicle;
  input Real altitude_reference(start = 0, unit = "m") "Of the centre of mass";
  input Boolean reset(start = false) "Holds the loop in its start state: hover throttle";
  output Real throttle(start = 0, unit = "%");
protected
  Pid climb(
    final P = altitude_P,
    final I = altitude_I,
    final D = altitude_D,
    final N = altitude_N,
    final u_min = throttle_min,
    final u_max = throttle_max,
    final u_start = hover_throttle);
equation
  climb.error = altitude_reference - vehicle.position.z;
  climb.feed_forward = 0;
  climb.reset = reset;
  throttle = climb.u;
end AltitudeController;
