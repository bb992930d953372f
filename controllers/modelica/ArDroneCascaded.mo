block ArDroneCascaded "Cascaded PID control of the AR.Drone in one block: path command, control loops, mixing"
  record Position
    Real x(unit = "m") "East";
    Real y(unit = "m") "North";
    Real z(unit = "m") "Up";
  end Position;

  record Attitude
    Real roll(unit = "rad") "Positive: left side up";
    Real pitch(unit = "rad") "Positive: nose down";
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Contact
    Boolean vessel(start = false) "The quadcopter touches a vessel";
  end Contact;

  record Vehicle "Measurements of the quadcopter"
    Position position "Centre of mass";
    Fleet.Horizontal.Velocity velocity "Of the centre of mass";
    Attitude attitude;
    Contact contact;
  end Vehicle;

  record Deck "Measurements of the landing deck"
    Position position "Centre of its top";
    Fleet.Horizontal.Velocity velocity "Of that point";
  end Deck;

  input Vehicle vehicle;
  input Deck target;
  input Real altitude_command(start = 2, unit = "m") "Of the centre of mass, for the pursuit";
  input Real yaw_command(start = 0, unit = "rad") "Counter-clockwise from east, for the pursuit";
  output Real rotor_speed[4](each start = 0, each unit = "rad/s") "Front, left, rear, right";
  output Real altitude_reference(start = 0, unit = "m");
  output Fleet.FlightMode mode(start = Fleet.FlightMode.idle);
  output Boolean motors_on(start = false);
  output Real horizontal_error(start = 0, unit = "m") "Distance to the centre of the deck";
  output Integer aborts(start = 0) "Aborted descents";
  Fleet.Vtol vtol;
  Fleet.PositionController position;
  Fleet.AltitudeController altitude;
  Fleet.AttitudeController attitude;
  Fleet.Mixer mixer;
equation
  vtol.vehicle.position.x = vehicle.position.x;
  vtol.vehicle.position.y = vehicle.position.y;
  vtol.vehicle.position.z = vehicle.position.z;
  vtol.vehicle.attitude.yaw = vehicle.attitude.yaw;
  vtol.vehicle.contact.vessel = vehicle.contact.vessel;
  vtol.target.position.x = target.position.x;
  vtol.target.position.y = target.position.y;
  vtol.target.position.z = target.position.z;
  vtol.target.velocity.x = target.velocity.x;
  vtol.target.velocity.y = target.velocity.y;
  vtol.altitude_command = altitude_command;
  vtol.yaw_command = yaw_command;
  vtol.calm = true;

  position.vehicle.position.x = vehicle.position.x;
  position.vehicle.position.y = vehicle.position.y;
  position.vehicle.velocity.x = vehicle.velocity.x;
  position.vehicle.velocity.y = vehicle.velocity.y;
  position.vehicle.attitude.yaw = vehicle.attitude.yaw;
  position.position_reference.x = vtol.position_reference.x;
  position.position_reference.y = vtol.position_reference.y;
  position.velocity_reference.x = vtol.velocity_reference.x;
  position.velocity_reference.y = vtol.velocity_reference.y;
  position.reset = vtol.reset;

  altitude.vehicle.position.z = vehicle.position.z;
  altitude.altitude_reference = vtol.altitude_reference;
  altitude.reset = vtol.reset;

  attitude.vehicle.attitude.roll = vehicle.attitude.roll;
  attitude.vehicle.attitude.pitch = vehicle.attitude.pitch;
  attitude.vehicle.attitude.yaw = vehicle.attitude.yaw;
  attitude.roll_command = position.roll_command;
  attitude.pitch_command = position.pitch_command;
  attitude.yaw_command = vtol.yaw_reference;
  attitude.reset = vtol.reset;

  mixer.throttle = altitude.throttle;
  mixer.roll_difference = attitude.roll_difference;
  mixer.pitch_difference = attitude.pitch_difference;
  mixer.yaw_difference = attitude.yaw_difference;
  mixer.motor_share = vtol.motor_share;

  rotor_speed = mixer.rotor_speed;
  altitude_reference = vtol.altitude_reference;
  mode = vtol.mode;
  motors_on = vtol.motors_on;
  horizontal_error = vtol.horizontal_error;
  aborts = vtol.aborts;
end ArDroneCascaded;
