"""Force of the rudder."""
