within Fleet;
partial block DeckLanding "Landing on decks that move in waves: path command in still water, deck motion as feed-forward, a tracking controller"
  record Contact
    Boolean vessel(start = false) "The quadcopter touches a vessel";
  end Contact;

  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Vehicle "Measurements of the quadcopter"
    Spatial.Position position "Centre of mass";
    Spatial.Velocity velocity "Of the centre of mass";
    TrackingController.Orientation orientation;
    Attitude attitude;
    TrackingController.Rates rates;
    Contact contact;
  end Vehicle;

  record Deck "Measurements of the landing deck"
    Spatial.Position position "Centre of its top";
    Spatial.Velocity velocity "Of that point";
  end Deck;

  parameter Real engage_time(unit = "s", min = 0.01) = 1 "In which the motion of the deck is taken over, from the approach on";
  parameter Real tilt_limit(unit = "deg", min = 1, max = 60) = 35;
  parameter Real touchdown_tilt_limit(unit = "deg", min = 1, max = 60) = 12 "Just above the deck, so that it is not one foot that lands";
  parameter Real flare_height(unit = "m") = 0.16 "Of the centre of mass above the deck: from there on down the limit for the touchdown holds";
  input Vehicle vehicle;
  input Deck target;
  input Real altitude_command(start = 2, unit = "m") "Of the centre of mass, for the pursuit";
  input Real yaw_command(start = 0, unit = "rad") "Counter-clockwise from east, for the pursuit";
  output Real rotor_speed[4](each start = 0, each unit = "rad/s") "Front, left, rear, right";
  output Real altitude_reference(start = 0, unit = "m");
  output FlightMode mode(start = FlightMode.idle);
  output Boolean motors_on(start = false);
  output Real horizontal_error(start = 0, unit = "m") "Distance to the centre of the deck";
  output Integer aborts(start = 0) "Aborted descents";
  DeckPredictor deck;
  QuiescentWindow window;
  Vtol vtol(landing_error = 0.08, abort_error = 0.25, ramp_time = 0.15);
  replaceable TrackingController tracking;
protected
  discrete Real share(start = 0, fixed = true) "Of the motion of the deck that is followed";
  discrete Real rate(start = 0, fixed = true, unit = "m/s") "Of the altitude reference in still water";
  discrete Real level(start = 0, fixed = true, unit = "m") "Altitude reference in still water";
  discrete Boolean near(start = false, fixed = true) "The deck is being approached, or was reached";
  Real heave(unit = "m") "Taken over";
  Boolean flaring "About to touch the deck";
equation
  heave = share*deck.heave;

  deck.target.position.x = target.position.x;
  deck.target.position.y = target.position.y;
  deck.target.position.z = target.position.z;
  deck.target.velocity.x = target.velocity.x;
  deck.target.velocity.y = target.velocity.y;
  deck.target.velocity.z = target.velocity.z;

  window.speed = target.velocity.z;
  window.acceleration = deck.acceleration.z;
  window.tilt = acos(limit(1 - 2*(vehicle.orientation.x^2 + vehicle.orientation.y^2), -1, 1));
  window.descending = pre(mode) == FlightMode.descend;

  vtol.vehicle.position.x = vehicle.position.x;
  vtol.vehicle.position.y = vehicle.position.y;
  vtol.vehicle.position.z = vehicle.position.z - heave;
  vtol.vehicle.attitude.yaw = vehicle.attitude.yaw;
  vtol.vehicle.contact.vessel = vehicle.contact.vessel;
  vtol.target.position.x = target.position.x;
  vtol.target.position.y = target.position.y;
  vtol.target.position.z = target.position.z - heave;
  vtol.target.velocity.x = target.velocity.x;
  vtol.target.velocity.y = target.velocity.y;
  vtol.altitude_command = altitude_command;
  vtol.yaw_command = yaw_command;
  vtol.calm = window.calm;

  tracking.vehicle.position.x = vehicle.position.x;
  tracking.vehicle.position.y = vehicle.position.y;
  tracking.vehicle.position.z = vehicle.position.z;
  tracking.vehicle.velocity.x = vehicle.velocity.x;
  tracking.vehicle.velocity.y = vehicle.velocity.y;
  tracking.vehicle.velocity.z = vehicle.velocity.z;
  tracking.vehicle.orientation.w = vehicle.orientation.w;
  tracking.vehicle.orientation.x = vehicle.orientation.x;
  tracking.vehicle.orientation.y = vehicle.orientation.y;
  tracking.vehicle.orientation.z = vehicle.orientation.z;
  tracking.vehicle.rates.p = vehicle.rates.p;
  tracking.vehicle.rates.q = vehicle.rates.q;
  tracking.vehicle.rates.r = vehicle.rates.r;
  tracking.position_reference.x = vtol.position_reference.x;
  tracking.position_reference.y = vtol.position_reference.y;
  tracking.position_reference.z = altitude_reference;
  tracking.velocity_reference.x = vtol.velocity_reference.x;
  tracking.velocity_reference.y = vtol.velocity_reference.y;
  tracking.velocity_reference.z = rate + share*target.velocity.z;
  tracking.acceleration_reference.x = share*deck.acceleration.x;
  tracking.acceleration_reference.y = share*deck.acceleration.y;
  tracking.acceleration_reference.z = share*deck.acceleration.z;
  tracking.yaw_reference = vtol.yaw_reference;
  flaring = vtol.mode == FlightMode.descend and vehicle.position.z - target.position.z < flare_height;
  tracking.tilt_limit = if flaring then touchdown_tilt_limit else tilt_limit;
  tracking.motor_share = vtol.motor_share;
  tracking.reset = vtol.reset;

  rotor_speed = tracking.rotor_speed;
  altitude_reference = vtol.altitude_reference + heave;
  mode = vtol.mode;
  motors_on = vtol.motors_on;
  horizontal_error = vtol.horizontal_error;
  aborts = vtol.aborts;
algorithm
  when sample(0, sample_period) then
    near := pre(mode) == FlightMode.approach or pre(mode) == FlightMode.descend or pre(mode) == FlightMode.landed;
    share := limit(pre(share) + (if near then 1 else -1)*sample_period/engage_time, 0, 1);
  end when;
algorithm
  when sample(0, sample_period) then
    level := vtol.altitude_reference;
    rate := if vtol.reset then 0.0 else (level - pre(level))/sample_period;
  end when;
end DeckLanding;
