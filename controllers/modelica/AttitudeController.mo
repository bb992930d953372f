block AttitudeController "Roll, pitch and yaw loops: from attitude commands to throttle differences"
  extends Fleet.AttitudeController;
end AttitudeController;
