block InertialFilter "Inertial navigation by an error-state extended Kalman filter, aided by GNSS and magnetometer"
  extends Estimation.InertialFilter;
end InertialFilter;
