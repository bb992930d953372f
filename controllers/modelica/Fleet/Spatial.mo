within Fleet;
package Spatial "Vectors in the world frame"
  record Position
    Real x(unit = "m") "East";
    Real y(unit = "m") "North";
    Real z(unit = "m") "Up";
  end Position;

  record Velocity
    Real x(unit = "m/s") "East";
    Real y(unit = "m/s") "North";
    Real z(unit = "m/s") "Up";
  end Velocity;

  record Acceleration
    Real x(unit = "m/s2") "East";
    Real y(unit = "m/s2") "North";
    Real z(unit = "m/s2") "Up";
  end Acceleration;

  function rotation "Rotation matrix of a unit quaternion: its columns are the body axes in the world frame"
    input Real w;
    input Real x;
    input Real y;
    input Real z;
    output Real R[3, 3];
  algorithm
    R := {
      {1 - 2*(y^2 + z^2), 2*(x*y - w*z), 2*(x*z + w*y)},
      {2*(x*y + w*z), 1 - 2*(x^2 + z^2), 2*(y*z - w*x)},
      {2*(x*z - w*y), 2*(y*z + w*x), 1 - 2*(x^2 + y^2)}};
  end rotation;

  function heading_frame "Rotation matrix whose third column is `up` (not horizontal) and whose first one looks towards a heading"
    input Real up[3] "Of unit length";
    input Real yaw(unit = "rad");
    output Real R[3, 3];
  protected
    Real left[3];
    Real ahead[3];
  algorithm
    left := cross(up, {cos(yaw), sin(yaw), 0.0});
    left := left/sqrt(left*left);
    ahead := cross(left, up);
    R := {{ahead[1], left[1], up[1]}, {ahead[2], left[2], up[2]}, {ahead[3], left[3], up[3]}};
  end heading_frame;
end Spatial;
