// A round punch, the coarser mesh, and the block under it, in plane strain; right half, the axis of
// symmetry is x = 0. The punch has radius 20 and touches the block at the origin.
size = 0.5;
Point(1) = {0, 0, 0, 1.7 * size};
Point(2) = {0, 20, 0, 4 * size};
Point(3) = {20 * Sin(Pi/9), 20 - 20 * Cos(Pi/9), 0, 1.7 * size};
Point(4) = {20 * Sin(Pi/9), 8, 0, 4 * size};
Point(5) = {0, 8, 0, 4 * size};
Circle(1) = {1, 2, 3};
Line(2) = {3, 4};
Line(3) = {4, 5};
Line(4) = {5, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

Point(11) = {0, -10, 0, 3 * size};
Point(12) = {12, -10, 0, 4 * size};
Point(13) = {12, 0, 0, 2 * size};
Point(14) = {0, 0, 0, size};
Point(15) = {6, 0, 0, size};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 15};
Line(15) = {15, 14};
Line(14) = {14, 11};
Curve Loop(2) = {11, 12, 13, 15, 14};
Plane Surface(2) = {2};

Physical Surface("punch") = {1};
Physical Surface("block") = {2};
Physical Curve("face") = {1};
Physical Curve("skin") = {13, 15};
Physical Curve("top") = {3};
Physical Curve("bottom") = {11};
Physical Curve("middle") = {4, 14};
