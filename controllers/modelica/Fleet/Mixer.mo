within Fleet;
block Mixer "Throttle and its differences to the rotor speeds of a '+' frame"
  input Real throttle(start = 0, unit = "%") "Common to all rotors";
  input Real roll_difference(start = 0, unit = "%") "Positive: raises the left side";
  input Real pitch_difference(start = 0, unit = "%") "Positive: lowers the nose";
  input Real yaw_difference(start = 0, unit = "%") "Positive: turns counter-clockwise";
  input Real motor_share(start = 0, unit = "1") "Share of the commanded rotor speeds; 0: motors stopped";
  output Real rotor_speed[4](each start = 0, each unit = "rad/s") "Front, left, rear, right";
protected
  constant Real mixing[4, 4] = {
      {1.0, 0.0, -1.0, 1.0},
      {1.0, 1.0, 0.0, -1.0},
      {1.0, 0.0, 1.0, 1.0},
      {1.0, -1.0, 0.0, -1.0}} "Columns: throttle, roll, pitch, yaw. Front and rear rotor turn the body counter-clockwise";
  discrete Real rotor_throttle[4](each start = 0, each fixed = true, each unit = "%");
algorithm
  when sample(0, sample_period) then
    rotor_throttle := mixing*{throttle, roll_difference, pitch_difference, yaw_difference};
    for i in 1:4 loop
      rotor_speed[i] := motor_share*rotor_speed_max/100*limit(rotor_throttle[i], 0, 100);
    end for;
  end when;
end Mixer;
