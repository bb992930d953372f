block AccelerationController "Horizontal pursuit: from position and velocity references to accelerations"
  extends Fleet.AccelerationController;
end AccelerationController;
