block PositionController "Horizontal position and velocity loops: from position reference to roll and pitch command"
  extends Fleet.PositionController;
end PositionController;
