"""Front end: flattening of Modelica files by rumoca and conversion to the flat model."""
