block Vtol "Path command of the quadcopter: take-off, pursuit of a vessel and landing on its deck"
  extends Fleet.Vtol;
end Vtol;
