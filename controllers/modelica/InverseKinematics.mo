block InverseKinematics "From horizontal acceleration and altitude commands to tilt commands and the common throttle of the rotors"
  extends Fleet.InverseKinematics;
end InverseKinematics;
