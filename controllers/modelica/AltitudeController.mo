block AltitudeController "Altitude loop: from altitude reference to the common throttle of the rotors"
  extends Fleet.AltitudeController;
end AltitudeController;
