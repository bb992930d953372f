within Fleet;
block Vtol "Path command of the quadcopter: take-off, pursuit of a vessel and landing on its deck"
  record Position
    Real x(unit = "m") "East";
    Real y(unit = "m") "North";
    Real z(unit = "m") "Up";
  end Position;

  record Attitude
    Real yaw(unit = "rad") "Counter-clockwise from east";
  end Attitude;

  record Contact
    Boolean vessel(start = false) "The quadcopter touches a vessel";
  end Contact;

  record Vehicle "Measurements of the quadcopter"
    Position position "Centre of mass";
    Attitude attitude;
    Contact contact;
  end Vehicle;

  record Deck "Measurements of the landing deck"
    Position position "Centre of its top";
    Horizontal.Velocity velocity "Of that point";
  end Deck;

  parameter Real take_off_time(unit = "s") = 0 "Earliest start of the motors";
  parameter Boolean landing_enabled = true "False: keep following, also out of an approach or descent";
  parameter Real landing_time(unit = "s") = 5 "Earliest start of the approach";
  parameter Boolean velocity_feed_forward = true "Follow with the velocity of the deck as feed-forward";
  parameter Real ramp_time(unit = "s", min = 0.01) = 0.3 "In which the motors spin up or down";
  parameter Real clearance(unit = "m") = 0.4 "Climb above the starting point before the pursuit begins";
  parameter Real resting_height(unit = "m") = 0.056 "Of the centre of mass above the deck when landed";
  parameter Real approach_height(unit = "m") = 0.675 "Above the resting height";
  parameter Real waiting_height(unit = "m") = 0.15 "Above the resting height: the descent waits there until the deck is calm";
  parameter Real press_depth(unit = "m") = 0.1 "Below the resting height: end of the descent, which keeps the contact";
  parameter Real approach_band(unit = "m") = 0.1 "Altitude error that allows the descent";
  parameter Real landing_error(unit = "m") = 0.05 "Horizontal error that allows the descent to begin and to go on";
  parameter Real abort_error(unit = "m") = 0.15 "Horizontal error that aborts the descent";
  parameter Real hold_time(unit = "s") = 0.3 "In which both errors must stay small before the descent";
  parameter Real contact_time(unit = "s") = 0.03 "Of unbroken contact that counts as touchdown";
  parameter Real climb_rate(unit = "m/s") = 1 "Of the altitude reference, up and down";
  parameter Real descent_rate(unit = "m/s") = 0.3 "Of the altitude reference onto the deck";
  input Vehicle vehicle;
  input Deck target;
  input Real altitude_command(start = 2, unit = "m") "Of the centre of mass, for the pursuit";
  input Real yaw_command(start = 0, unit = "rad") "Counter-clockwise from east, for the pursuit";
  input Boolean calm(start = true) "Quiescent window: the deck permits a touchdown";
  output Horizontal.Position position_reference;
  output Horizontal.Velocity velocity_reference;
  output Real altitude_reference(start = 0, unit = "m");
  output Real yaw_reference(start = 0, unit = "rad");
  output Real motor_share(start = 0, fixed = true, unit = "1") "Of the commanded rotor speeds: ramps at take-off and touchdown";
  output Boolean motors_on(start = false);
  output Boolean reset(start = true) "Controllers hold their start state: the motors are not at full share";
  output FlightMode mode(start = FlightMode.idle, fixed = true);
  output Real horizontal_error(start = 0, unit = "m") "Distance to the centre of the deck";
  output Integer aborts(start = 0, fixed = true) "Aborted descents";
protected
  constant Real half_period(unit = "s") = sample_period/2 "Lets sums of periods meet a time in spite of rounding";
  discrete Real home_x(start = 0, fixed = true) "Last pose before take-off";
  discrete Real home_y(start = 0, fixed = true);
  discrete Real home_z(start = 0, fixed = true);
  discrete Real home_yaw(start = 0, fixed = true);
  discrete Real landed_altitude(start = 0, fixed = true) "Of the centre of mass";
  discrete Real steady(start = 0, fixed = true) "Time spent in the window that allows the descent";
  discrete Real touching(start = 0, fixed = true) "Time spent in contact with the vessel";
  discrete Boolean centred(start = false, fixed = true) "Horizontal error inside that window";
  discrete Boolean level(start = false, fixed = true) "Altitude inside that window";
  discrete Boolean committed(start = false, fixed = true) "To the touchdown: a calm deck at the waiting height";
  discrete Boolean flying(start = false, fixed = true);
  discrete Real destination(start = 0, fixed = true) "Of the altitude reference";
  discrete Real rate(start = 0, fixed = true) "Of the altitude reference";
equation
  horizontal_error = Horizontal.length(target.position.x - vehicle.position.x, target.position.y - vehicle.position.y);
  motors_on = motor_share > 0;
  reset = motor_share < 1;
algorithm
  when sample(0, sample_period) then
    if pre(mode) == FlightMode.idle then
      home_x := vehicle.position.x;
      home_y := vehicle.position.y;
      home_z := vehicle.position.z;
      home_yaw := vehicle.attitude.yaw;
    end if;
    landed_altitude := target.position.z + resting_height;
    centred := horizontal_error <= landing_error;
    level := abs(vehicle.position.z - landed_altitude - approach_height) <= approach_band;
    steady := if centred and level and pre(mode) == FlightMode.approach then pre(steady) + sample_period else 0.0;
    touching := if vehicle.contact.vessel then pre(touching) + sample_period else 0.0;

    if pre(mode) == FlightMode.idle then
      if time >= take_off_time then
        mode := FlightMode.take_off;
      end if;
    elseif pre(mode) == FlightMode.take_off then
      if vehicle.position.z > home_z + clearance then
        mode := FlightMode.follow;
      end if;
    elseif pre(mode) == FlightMode.follow then
      if landing_enabled and time >= landing_time then
        mode := FlightMode.approach;
      end if;
    elseif pre(mode) == FlightMode.approach then
      if not landing_enabled then
        mode := FlightMode.follow;
      elseif steady >= hold_time - half_period then
        mode := FlightMode.descend;
      end if;
    elseif pre(mode) == FlightMode.descend then
      if touching >= contact_time - half_period then
        mode := FlightMode.landed;
      elseif not landing_enabled then
        mode := FlightMode.follow;
      elseif horizontal_error > abort_error then
        mode := FlightMode.approach;
        aborts := pre(aborts) + 1;
      end if;
    end if;

    flying := mode <> FlightMode.idle and mode <> FlightMode.landed;
    motor_share := limit(pre(motor_share) + (if flying then 1 else -1)*sample_period/ramp_time, 0, 1);
  end when;
algorithm
  when sample(0, sample_period) then
    if mode == FlightMode.idle or mode == FlightMode.take_off then
      position_reference.x := home_x;
      position_reference.y := home_y;
      velocity_reference.x := 0.0;
      velocity_reference.y := 0.0;
      yaw_reference := home_yaw;
    else
      position_reference.x := target.position.x;
      position_reference.y := target.position.y;
      velocity_reference.x := if velocity_feed_forward then target.velocity.x else 0.0;
      velocity_reference.y := if velocity_feed_forward then target.velocity.y else 0.0;
      yaw_reference := yaw_command;
    end if;

    committed := mode == FlightMode.descend and (pre(committed)
      or calm and pre(altitude_reference) <= landed_altitude + waiting_height + descent_rate*sample_period);
    if mode == FlightMode.take_off then
      destination := max(altitude_command, home_z + 2*clearance);
    elseif mode == FlightMode.approach then
      destination := landed_altitude + approach_height;
    elseif mode == FlightMode.descend then
      destination := landed_altitude + (if committed then -press_depth else waiting_height);
    else
      destination := altitude_command;
    end if;
    if mode <> FlightMode.descend then
      rate := climb_rate;
    elseif centred then
      rate := descent_rate;
    else
      rate := 0;
    end if;
    if motor_share < 1 then
      altitude_reference := vehicle.position.z;
    else
      altitude_reference := pre(altitude_reference)
        + limit(destination - pre(altitude_reference), -rate*sample_period, rate*sample_period);
    end if;
  end when;
end Vtol;
