block VesselFilter "Extended Kalman filter for the motion of a vessel: position, velocity, attitude with heading, and biases of its IMU"
  // A vessel starts afloat, so that roll and pitch are less certain than those of a quadcopter on the ground. The larger noise of the
  // velocity covers the product of this uncertainty and the accelerometer bias, which a linear error model leaves out.
  extends Estimation.InertialFilter(start_deviation = {0.04, 0.02, 0.2}, density = {6e-3, 3e-4, 2e-5, 2e-4});
end VesselFilter;
