// A foundation, 90 x 30 mm, and half a roller of radius 30 mm that touches it at (35, 30). The meshes
// are fine along the track, and do not match.
h = 1;
// Roller by foundation
ratio = 0.8;
radius = 30;
start = 35;
height = 30;
Point(1) = {0, 0, 0, 6 * h};
Point(2) = {90, 0, 0, 6 * h};
Point(3) = {90, height, 0, 6 * h};
Point(4) = {start + 20, height, 0, h};
Point(5) = {start - 10, height, 0, h};
Point(6) = {0, height, 0, 6 * h};
For i In {0:5}
  Line(1 + i) = {1 + i, 1 + (i + 1) % 6};
EndFor
Curve Loop(1) = {1:6};
Plane Surface(1) = {1};

angle = 20 * Pi / 180;
Point(10) = {start, height + radius, 0, 6 * h};
Point(11) = {start - radius, height + radius, 0, 6 * h};
Point(12) = {start - radius * Sin(angle), height + radius - radius * Cos(angle), 0, ratio * h};
Point(13) = {start, height, 0, ratio * h};
Point(14) = {start + radius * Sin(angle), height + radius - radius * Cos(angle), 0, ratio * h};
Point(15) = {start + radius, height + radius, 0, 6 * h};
For i In {0:3}
  Circle(11 + i) = {11 + i, 10, 12 + i};
EndFor
Line(15) = {15, 11};
Curve Loop(2) = {11:15};
Plane Surface(2) = {2};

Physical Surface("foundation") = {1};
Physical Surface("roller") = {2};
Physical Curve("base") = {1};
Physical Curve("track") = {3, 4, 5};
Physical Curve("round") = {12, 13};
Physical Curve("grip") = {15};
