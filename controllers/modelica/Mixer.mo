block Mixer "Throttle and its differences to the rotor speeds of a '+' frame"
  extends Fleet.Mixer;
end Mixer;
