// Half of the meridian section of a coated billet: radius x, axis y; core 11.25 mm, coat 3.75 mm.
// Both share the nodes where they meet.
Point(1) = {0, -37, 0};
Point(2) = {11.25, -37, 0};
Point(3) = {15, -37, 0};
Point(4) = {15, -2, 0};
Point(5) = {11.25, -2, 0};
Point(6) = {0, -2, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 1};
Line(7) = {2, 5};
Transfinite Curve {1, 5} = 9 + 1;
Transfinite Curve {2, 4} = 4 + 1;
// Flat cells: the flow stretches them to half as much again
Transfinite Curve {3, 6, 7} = 56 + 1;
Curve Loop(1) = {1, 7, 5, 6};
Curve Loop(2) = {2, 3, 4, -7};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Surface {1, 2} Right;
Physical Surface("core") = {1};
Physical Surface("coat") = {2};
