// Cylindrical billet, radius 10 mm, height 30 mm, axis z; about 10 000 nodes.
// A disc at half height is extruded both ways. Rings at its edge and layers at the ends are thin:
// there the side folds onto the tools, and both ends and all of the circumference see one mesh.
r = 8.4;
size = 1.6;
Point(1) = {0, 0, 15, size};
Point(2) = {r, 0, 15, size};
Point(3) = {0, r, 15, size};
Point(4) = {-r, 0, 15, size};
Point(5) = {0, -r, 15, size};
Point(6) = {10, 0, 15, size};
Point(7) = {0, 10, 15, size};
Point(8) = {-10, 0, 15, size};
Point(9) = {0, -10, 15, size};
For i In {0 : 3}
  Circle(1 + i) = {2 + i, 1, 2 + (i + 1) % 4};
  Circle(5 + i) = {6 + i, 1, 6 + (i + 1) % 4};
  Line(9 + i) = {2 + i, 6 + i};
EndFor
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Point {1} In Surface {1};
Transfinite Curve {1:8} = 14;
Transfinite Curve {9:12} = 5;
For i In {0 : 3}
  Curve Loop(2 + i) = {9 + i, 5 + i, -(9 + (i + 1) % 4), -(1 + i)};
  Plane Surface(2 + i) = {2 + i};
  Transfinite Surface {2 + i} Alternate;
EndFor

n() = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
z() = {2, 4, 5.9, 7.7, 9.3, 10.7, 11.9, 12.85, 13.7, 14.45, 15};
For i In {0 : #z() - 1}
  z(i) = z(i) / 15;
EndFor
billet() = {};
For i In {1 : 5}
  up() = Extrude {0, 0, 15} { Surface{i}; Layers{n(), z()}; };
  down() = Extrude {0, 0, -15} { Surface{i}; Layers{n(), z()}; };
  billet() += {up(1), down(1)};
EndFor
Physical Volume("billet") = {billet()};
