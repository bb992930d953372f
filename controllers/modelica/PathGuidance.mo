block PathGuidance "Path command of the vessel: adaptive line of sight along straight legs"
  extends Fleet.PathGuidance;
end PathGuidance;
