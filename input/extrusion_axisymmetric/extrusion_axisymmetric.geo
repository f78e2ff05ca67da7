// Half of the meridian section of a billet: radius x, axis y; radius 15 mm, length 35 mm.
n = 12;
Point(1) = {0, -37, 0};
Point(2) = {15, -37, 0};
Point(3) = {15, -2, 0};
Point(4) = {0, -2, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Transfinite Curve {1, 3} = n + 1;
// Flat cells: the flow stretches them to more than twice their length
Transfinite Curve {2, 4} = 70 + 1;
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Surface {1} Right;
Physical Surface("billet") = {1};
