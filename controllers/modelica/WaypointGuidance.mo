block WaypointGuidance "Line of sight to the active waypoint, which a circle of acceptance switches on"
  extends Fleet.WaypointGuidance;
end WaypointGuidance;
