block LandingCourse "Path command of a vessel that helps a landing: waypoints first, then a course relative to the wind"
  extends Fleet.LandingCourse;
end LandingCourse;
