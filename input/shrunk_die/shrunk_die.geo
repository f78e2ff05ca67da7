// Half of the meridian section of a die in a shrunk-on ring, and of the billet in it: radius x, axis
// y. Insert 10 to 20 mm, ring 20 to 35 mm, 30 mm high; billet 9.95 mm, 5 to 25 mm. The lines of each
// block follow each other: bottom, right, top, left.
left[] = {10, 20, 0};
right[] = {20, 35, 9.95};
low[] = {0, 0, 5};
high[] = {30, 30, 25};
across[] = {12, 10, 10};
along[] = {36, 25, 20};
For i In {0:2}
  k = 4 * i;
  Point(k + 1) = {left[i], low[i], 0};
  Point(k + 2) = {right[i], low[i], 0};
  Point(k + 3) = {right[i], high[i], 0};
  Point(k + 4) = {left[i], high[i], 0};
  Line(k + 1) = {k + 1, k + 2};
  Line(k + 2) = {k + 2, k + 3};
  Line(k + 3) = {k + 3, k + 4};
  Line(k + 4) = {k + 4, k + 1};
  Transfinite Curve {k + 1, k + 3} = across[i] + 1;
  Transfinite Curve {k + 2, k + 4} = along[i] + 1;
  Curve Loop(i + 1) = {k + 1, k + 2, k + 3, k + 4};
  Plane Surface(i + 1) = {i + 1};
  Transfinite Surface {i + 1} Alternate;
EndFor
Physical Surface("insert") = {1};
Physical Surface("ring") = {2};
Physical Surface("billet") = {3};
Physical Curve("feet") = {1, 5};
