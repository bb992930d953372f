"""Parts of multirotors: airframe, interface, equations, ground effect."""
