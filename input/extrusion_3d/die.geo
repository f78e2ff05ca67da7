// Container and conical die as one body of revolution about z: its facets become die.stl.
SetFactory("OpenCASCADE");
R = 15; r = 10; f = 8;           // radii of container, throat and fillets
angle = Pi/6; relief = Pi/36;    // half angles of the cone and behind the throat
entry = 20;                      // height where wall and cone would meet without a fillet
cut = f*Tan(angle/2);            // length that a fillet takes from the cone
throat = entry - (R - r)/Tan(angle) - cut;
top = 48; bottom = throat - 8; outside = 25;

// Down the inner side
Point(1) = {R, 0, top};
Point(2) = {R, 0, entry + cut};
Point(3) = {R - f, 0, entry + cut};
Point(4) = {R - cut*Sin(angle), 0, entry - cut*Cos(angle)};
Point(5) = {r + f - f*Cos(angle), 0, throat + f*Sin(angle)};
Point(6) = {r + f, 0, throat};
Point(7) = {r + f - f*Cos(relief), 0, throat - f*Sin(relief)};
Point(8) = {r + f - f*Cos(relief) + (throat - f*Sin(relief) - bottom)*Tan(relief), 0, bottom};
Point(9) = {outside, 0, bottom};
Point(10) = {outside, 0, top};
Line(1) = {1, 2};
Circle(2) = {2, 3, 4};
Line(3) = {4, 5};
Circle(4) = {5, 6, 7};
Line(5) = {7, 8};
Line(6) = {8, 9};
Line(7) = {9, 10};
Line(8) = {10, 1};
Curve Loop(1) = {1:8};
Plane Surface(1) = {1};
Extrude {{0, 0, 1}, {0, 0, 0}, 2*Pi} { Surface{1}; }
Recursive Delete { Surface{1}; }
// 36 facets to a turn, of the fillets too
Mesh.MeshSizeFromCurvature = 36;
Mesh.MeshSizeMax = 6;
