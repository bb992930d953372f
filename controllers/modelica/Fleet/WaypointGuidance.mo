within Fleet;
block WaypointGuidance "Line of sight to the active waypoint, which a circle of acceptance switches on"
  extends WaypointList;
algorithm
  when sample(0, sample_period) then
    if not finished then
      heading_reference := atan2(ahead_y, ahead_x);
    end if;
  end when;
end WaypointGuidance;
