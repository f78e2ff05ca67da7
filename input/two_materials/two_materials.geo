// Half of the meridian section of a coin blank, above its middle plane: radius x, axis y. A core of
// radius 8 mm and a ring around it; each has a mesh of its own.
h = 0.1;
Point(1) = {0, 0, 0};
Point(2) = {8, 0, 0};
Point(3) = {8, 1, 0};
Point(4) = {0, 1, 0};
Point(5) = {8.05, 0, 0};
Point(6) = {11.9, 0, 0};
Point(7) = {11.9, 1.1, 0};
Point(8) = {8.05, 1.1, 0};
For i In {0:3}
  Line(1 + i) = {1 + i, 1 + (i + 1) % 4};
  Line(5 + i) = {5 + i, 5 + (i + 1) % 4};
EndFor
Curve Loop(1) = {1:4};
Curve Loop(2) = {5:8};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
MeshSize {:} = h;
// The meshes do not match
MeshSize {1, 2, 3, 4} = 0.8 * h;
Physical Surface("core") = {1};
Physical Surface("ring") = {2};
Physical Curve("middle") = {1, 5};
