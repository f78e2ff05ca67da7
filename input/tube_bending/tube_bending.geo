// Half of a tube of four layers, 240 mm long along z; its plane of symmetry is y = 0.
// Each layer has nodes of its own; those of neighbours are at the same places, so that &interface
// may bond them or leave them apart.
// Circles are polygons of 48 sides with the second moment of area of the circle: their corners lie
// 0.14 % outside.
length = 240;
n_around = 24;
n_along = 64;
side = Pi / n_around;
outside = (3 * side / (Sin(side) * (2 + Cos(side))))^(1/4);

symmetry() = {};
end_0() = {};
end_1() = {};
For layer In {1:4}
  n = 1000 * layer;
  // Corners at 0, 90 and 180 degrees; e: the end, k: inside or outside
  For e In {0:1}
    Point(n + 100 * e) = {0, 0, e * length};
    For k In {0:1}
      r = (19 + layer + k) * outside;
      m = n + 100 * e + 10 * k;
      Point(m + 1) = {r, 0, e * length};
      Point(m + 2) = {0, r, e * length};
      Point(m + 3) = {-r, 0, e * length};
      Circle(m + 1) = {m + 1, n + 100 * e, m + 2};
      Circle(m + 2) = {m + 2, n + 100 * e, m + 3};
      Transfinite Curve {m + 1, m + 2} = n_around / 2 + 1;
    EndFor
    For j In {1:3}
      Line(n + 100 * e + 20 + j) = {n + 100 * e + j, n + 100 * e + 10 + j};
      Transfinite Curve {n + 100 * e + 20 + j} = 2;
    EndFor
  EndFor
  For k In {0:1}
    For j In {1:3}
      Line(n + 200 + 10 * k + j) = {n + 10 * k + j, n + 100 + 10 * k + j};
      Transfinite Curve {n + 200 + 10 * k + j} = n_along + 1;
    EndFor
  EndFor
  For q In {1:2}
    For e In {0:1}
      m = n + 100 * e;
      Curve Loop(m + q) = {m + 20 + q, m + 10 + q, -(m + 21 + q), -(m + q)};
      Plane Surface(m + q) = {m + q};
      end~{e}() += {m + q};
    EndFor
    For k In {0:1}
      m = n + 10 * k + q;
      Curve Loop(m + 200) = {m, m + 201, -(m + 100), -(m + 200)};
      Surface(m + 200) = {m + 200};
    EndFor
  EndFor
  For j In {1:3}
    m = n + 20 + j;
    Curve Loop(m + 300) = {m, n + 210 + j, -(m + 100), -(n + 200 + j)};
    Plane Surface(m + 300) = {m + 300};
  EndFor
  For q In {1:2}
    Surface Loop(n + q) = {n + q, n + 100 + q, n + 200 + q, n + 210 + q, n + 320 + q, n + 321 + q};
    Volume(n + q) = {n + q};
  EndFor
  symmetry() += {n + 321, n + 323};
  Physical Volume(Sprintf("layer_%g", layer)) = {n + 1, n + 2};
  Physical Surface(Sprintf("inside_%g", layer)) = {n + 201, n + 202};
  Physical Surface(Sprintf("outside_%g", layer)) = {n + 211, n + 212};
EndFor
Transfinite Surface {:};
Transfinite Volume {:};
Physical Surface("symmetry") = symmetry();
Physical Surface("end_a") = end_0();
Physical Surface("end_b") = end_1();
