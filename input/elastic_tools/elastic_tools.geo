// Meridian section of a billet between two elastic dies: radius x, axis y. Billet 15 x 12 mm on a
// lower die of 30 x 30 mm, under an upper one of 25 x 20 mm. Cells of the dies grow away from it.
h = 0.6;
face = 1.5;
back = 5;

Point(1) = {0, 0, 0, h};
Point(2) = {15, 0, 0, h};
Point(3) = {15, 12, 0, h};
Point(4) = {0, 12, 0, h};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve {1, 3} = 26;
Transfinite Curve {2, 4} = 21;
Transfinite Surface {1} Alternate;

Point(11) = {0, -30, 0, back};
Point(12) = {30, -30, 0, back};
Point(13) = {30, 0, 0, back};
Point(14) = {22, 0, 0, face};
Point(15) = {0, 0, 0, face};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 15};
Line(15) = {15, 11};
Curve Loop(2) = {11, 12, 13, 14, 15};
Plane Surface(2) = {2};

Point(21) = {0, 12, 0, face};
Point(22) = {22, 12, 0, face};
Point(23) = {25, 12, 0, face};
Point(24) = {25, 32, 0, back};
Point(25) = {0, 32, 0, back};
Line(21) = {21, 22};
Line(22) = {22, 23};
Line(23) = {23, 24};
Line(24) = {24, 25};
Line(25) = {25, 21};
Curve Loop(3) = {21, 22, 23, 24, 25};
Plane Surface(3) = {3};

Physical Surface("billet") = {1};
Physical Surface("lower") = {2};
Physical Surface("upper") = {3};
Physical Curve("bed") = {11};
Physical Curve("ram") = {24};
Physical Curve("lower_face") = {13, 14};
Physical Curve("upper_face") = {21, 22};
