// Quarter of a roller, radius 50 mm, on half of a block of 200 x 200 mm; x = 0 is a plane of
// symmetry. Regular squares of cells where they touch, of size h on the block and a quarter larger on
// the roller; around them they grow with the distance. The roller is drawn a little too low, by half
// of what its surface rises over a cell, so that it rests on the block from the start.
r = 50;
h = 0.62;
coarser = 1.25;
near = 9;
size = 100;
low = h^2 / (4 * r);
// The roller
Point(1) = {0, -low, 0};
Point(2) = {near, r - Sqrt(r^2 - near^2) - low, 0};
Point(3) = {r, r - low, 0};
Point(4) = {0, r - low, 0};
Point(5) = {0, near, 0};
Point(6) = {near, near, 0};
Circle(1) = {1, 4, 2};
Circle(2) = {2, 4, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 1};
Line(6) = {2, 6};
Line(7) = {6, 5};
Curve Loop(1) = {1, 6, 7, 5};
Plane Surface(1) = {1};
Curve Loop(2) = {2, 3, 4, -7, -6};
Plane Surface(2) = {2};
Transfinite Curve {1, 5, 6, 7} = Ceil(near / (coarser * h)) + 1;
Transfinite Surface {1} Left;
// The block
Point(11) = {0, 0, 0};
Point(12) = {near, 0, 0};
Point(13) = {size, 0, 0};
Point(14) = {size, -2 * size, 0};
Point(15) = {0, -2 * size, 0};
Point(16) = {0, -near, 0};
Point(17) = {near, -near, 0};
Line(11) = {12, 11};
Line(12) = {13, 12};
Line(13) = {14, 13};
Line(14) = {15, 14};
Line(15) = {16, 15};
Line(16) = {11, 16};
Line(17) = {17, 12};
Line(18) = {16, 17};
Curve Loop(11) = {11, 16, 18, 17};
Plane Surface(11) = {11};
Curve Loop(12) = {12, -17, -18, 15, 14, 13};
Plane Surface(12) = {12};
Transfinite Curve {11, 16, 17, 18} = Ceil(near / h) + 1;
Transfinite Surface {11} Left;
Physical Surface("roller") = {1, 2};
Physical Surface("block") = {11, 12};
Physical Curve("skin") = {1, 2};
Physical Curve("top") = {11, 12};
Physical Curve("axis") = {4, 5, 15, 16};
Physical Curve("equator") = {3};
Physical Curve("base") = {14};
Field[1] = MathEval;
Field[1].F = Sprintf("%g + 0.12 * max(0, sqrt(x^2 + y^2) - %g)", h, near);
Background Field = 1;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
Mesh.MeshSizeExtendFromBoundary = 0;
