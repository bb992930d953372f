package Fleet "What the controllers of the quadcopter and the vessel share"
  constant Real sample_period(unit = "s") = 0.01 "Sample period of every controller";
  constant Real gravity(unit = "m/s2") = 9.81;
  constant Real pi = 3.14159265358979323846;
  constant Real degrees(unit = "deg/rad") = 180/pi "Degrees in a radian";
  constant Real rotor_speed_max(unit = "rad/s") = 5000*0.10471976 "Rotor speed at full throttle: 5000 rpm";
  constant Integer waypoint_capacity = 32 "Longest list of waypoints";

  type FlightMode = enumeration(
      idle "On the ground, motors off",
      take_off "Motors spin up, then a climb over the starting point",
      follow "Above the vessel at the commanded altitude",
      approach "Above the deck at the approach height",
      descend "Sinking onto the deck",
      landed "On the deck, motors cut") "Phases of a flight";

  type EndPolicy = enumeration(
      stop "Bring the vessel to rest",
      repeat "Begin again with the first waypoint",
      keep_course "Sail on with the last heading") "What a vessel does after its last waypoint";

  function limit "Value kept between two bounds"
    input Real value;
    input Real lower;
    input Real upper;
    output Real limited;
  algorithm
    limited := min(upper, max(lower, value));
  end limit;

  function wrap_angle "The same angle between -pi and pi"
    input Real angle(unit = "rad");
    output Real wrapped(unit = "rad");
  algorithm
    wrapped := if abs(angle) <= pi then angle else atan2(sin(angle), cos(angle));
  end wrap_angle;
end Fleet;
