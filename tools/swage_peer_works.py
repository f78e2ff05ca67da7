"""Works W3 and W4, which Swage and other programs were given: geometries and inputs for the cases
and benchmarks that share them; standard library only.

W3, the elastic tool: the quarter of an elastic block of 32 x 32 x 8 mm is pressed on one eighth of
a steel billet, radius 10 and height 30 mm, with Coulomb friction 0.2; the side folds onto the tool.
W4, the cubes: two of side 10 mm, elastic, whose meshes do not match, under 100 MPa.
"""
# Way of the press of W3 [mm].
STROKE = 3.0


def boxed(*corners):
    """Gmsh text of the surfaces between two corners, which count as Gmsh expressions."""
    low, high = ([f'{x} {sign} e' for x in corner] for corner, sign in zip(corners, '-+'))
    return f'Surface In BoundingBox {{{", ".join(low + high)}}}'


def sizes(first, others):
    """Gmsh text of the size of cells in volume 1 and in the others; by Delaunay, uniform."""
    return f'''Field[1] = Constant;
Field[1].VolumesList = {{1}};
Field[1].VIn = {first!r};
Field[1].VOut = {others!r};
Background Field = 1;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm3D = 1;
'''


def tool_geometry(size, tool_size):
    """Gmsh text of the billet, its middle at z = 0, under the tool. Groups BILLET, TOOL, XMIN,
    YMIN, BOTTOM, SKIN (end and side of the billet), TOOL_FACE, TOOL_TOP."""
    return f'''SetFactory("OpenCASCADE");
e = 1e-5;
Cylinder(1) = {{0, 0, 0, 0, 0, 15, 10, Pi/2}};
Box(2) = {{0, 0, 15, 16, 16, 8}};
Physical Volume("BILLET") = {{1}};
Physical Volume("TOOL") = {{2}};
x() = {boxed((0, 0, 0), (0, 16, 23))};
y() = {boxed((0, 0, 0), (16, 0, 23))};
z() = {boxed((0, 0, 0), (16, 16, 0))};
skin() = Boundary {{ Volume{{1}}; }};
skin() -= x(); skin() -= y(); skin() -= z();
face() = {boxed((0, 0, 15), (16, 16, 15))};
face() -= skin();
Physical Surface("XMIN") = x();
Physical Surface("YMIN") = y();
Physical Surface("BOTTOM") = z();
Physical Surface("SKIN") = skin();
Physical Surface("TOOL_FACE") = face();
Physical Surface("TOOL_TOP") = {boxed((0, 0, 23), (16, 16, 23))};
{sizes(size, tool_size)}'''


def tool_case(mesh, stroke=STROKE, increments=20, friction='', contact='', more=''):
    """Input of W3 with keys of its &friction and &contact, and more groups."""
    return f"""&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = '{mesh}.msh' /
&body name = 'billet', material = 'steel', group = 'BILLET' /
&body name = 'tool', material = 'tool_steel', group = 'TOOL' /
&material name = 'steel', law = 'j2', young = 200000, poisson = 0.3, flow_stress = 'steel' /
&flow_stress name = 'steel', kind = 'linear', yield_stress = 200, hardening_modulus = 300 /
&material name = 'tool_steel', law = 'elastic', young = 210000, poisson = 0.3 /
&boundary name = 'x', kind = 'symmetry', group = 'XMIN' /
&boundary name = 'y', kind = 'symmetry', group = 'YMIN' /
&boundary name = 'z', kind = 'symmetry', group = 'BOTTOM' /
&boundary name = 'press', kind = 'velocity', group = 'TOOL_TOP', velocity = 0, 0, -{stroke!r} /
&friction name = 'dry', kind = 'coulomb', coefficient = 0.2 {friction} /
&contact name = 'face', slave = 'SKIN', master = 'TOOL_FACE', friction = 'dry' {contact} /
&step duration = 1, increments = {increments} /
{more}
"""


def cubes_geometry(lower_size, upper_size):
    """Gmsh text of the cubes. Groups LOWER, UPPER, XMIN, YMIN, BOTTOM, TOP, LOWER_FACE and
    UPPER_FACE."""
    return f'''SetFactory("OpenCASCADE");
e = 1e-5;
Box(1) = {{0, 0, 0, 10, 10, 10}};
Box(2) = {{0, 0, 10, 10, 10, 10}};
Physical Volume("LOWER") = {{1}};
Physical Volume("UPPER") = {{2}};
Physical Surface("XMIN") = {boxed((0, 0, 0), (0, 10, 20))};
Physical Surface("YMIN") = {boxed((0, 0, 0), (10, 0, 20))};
Physical Surface("BOTTOM") = {boxed((0, 0, 0), (10, 10, 0))};
Physical Surface("TOP") = {boxed((0, 0, 20), (10, 10, 20))};
// The kernel counts the sides of a box from XMIN to ZMAX
Physical Surface("LOWER_FACE") = {{6}};
Physical Surface("UPPER_FACE") = {{11}};
{sizes(lower_size, upper_size)}'''


def cubes_case(contact='', more=''):
    """Input of W4, mesh cubes.msh, with keys of its &contact, and more groups."""
    return f"""&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = 'cubes.msh' /
&body name = 'lower', material = 'steel', group = 'LOWER' /
&body name = 'upper', material = 'steel', group = 'UPPER' /
&material name = 'steel', law = 'elastic', young = 210000, poisson = 0.3 /
&boundary name = 'x', kind = 'symmetry', group = 'XMIN' /
&boundary name = 'y', kind = 'symmetry', group = 'YMIN' /
&boundary name = 'z', kind = 'symmetry', group = 'BOTTOM' /
&boundary name = 'load', kind = 'pressure', group = 'TOP', pressure = 100 /
&contact name = 'middle', slave = 'UPPER_FACE', master = 'LOWER_FACE' {contact} /
&step duration = 1, increments = 1 /
&output double_precision = .true., fields = 'stress' /
{more}
"""


def error_of_cubes(run):
    """Largest error of the stress of W4 in a run."""
    stress = run.results().step(-1).cell_fields['stress']
    return float(abs(stress[:, 2] + 100).max()) / 100
