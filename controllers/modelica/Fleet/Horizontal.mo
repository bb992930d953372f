within Fleet;
package Horizontal "Vectors in the horizontal plane of the world frame"
  record Position
    Real x(unit = "m") "East";
    Real y(unit = "m") "North";
  end Position;

  record Velocity
    Real x(unit = "m/s") "East";
    Real y(unit = "m/s") "North";
  end Velocity;

  function length "Euclidean norm"
    input Real x;
    input Real y;
    output Real norm;
  algorithm
    norm := sqrt(x^2 + y^2);
  end length;
end Horizontal;
