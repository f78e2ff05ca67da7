// Lower half of a roller, radius 10 mm, that touches the plane y = 0 in the origin. A regular
// rectangle of cells of size h there, all cut alike; around it they grow with the distance.
r = 10;
h = 0.016;
near = 0.4;
low = r - Sqrt(r^2 - near^2);
Point(1) = {-near, low, 0};
Point(2) = {near, low, 0};
Point(3) = {near, near, 0};
Point(4) = {-near, near, 0};
Point(5) = {-r, r, 0};
Point(6) = {r, r, 0};
Point(7) = {0, r, 0};
Circle(1) = {1, 7, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Circle(5) = {2, 7, 6};
Line(6) = {6, 5};
Circle(7) = {5, 7, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Curve Loop(2) = {5, 6, 7, -4, -3, -2};
Plane Surface(2) = {2};
// An even number: a node in the origin
Transfinite Curve {1, 3} = 2 * Ceil(near / h) + 1;
Transfinite Curve {2, 4} = Ceil(near / h) + 1;
Transfinite Surface {1} Left;
Physical Surface("body") = {1, 2};
Physical Curve("skin") = {1, 5, 7};
Physical Curve("equator") = {6};
Field[1] = MathEval;
Field[1].F = Sprintf("%g + 0.12 * max(0, sqrt(x^2 + y^2) - %g)", h, near);
Background Field = 1;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
Mesh.MeshSizeExtendFromBoundary = 0;
