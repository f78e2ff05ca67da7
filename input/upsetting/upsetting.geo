// Cylindrical billet, radius 10 mm, height 30 mm, axis z; about 10 000 nodes.
SetFactory("OpenCASCADE");
Cylinder(1) = {0, 0, 0, 0, 0, 30, 10};
Physical Volume("billet") = {1};
Mesh.MeshSizeMin = 0.955;
Mesh.MeshSizeMax = 0.955;
