// Half of the meridian section of a ring 60 : 30 : 20 mm: radius x, axis y.
h = 0.5;
Point(1) = {15, 0, 0, h};
Point(2) = {30, 0, 0, h};
Point(3) = {30, 20, 0, h};
Point(4) = {15, 20, 0, h};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Physical Surface("ring") = {1};
