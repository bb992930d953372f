block SpeedController "Speed loop: from speed reference to the thrust of a vessel"
  extends Fleet.SpeedController;
end SpeedController;
