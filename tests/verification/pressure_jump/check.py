"""Bodies that share nodes: one displacement, and a pressure for each material where they meet.

Jump: layers bonded along y = constant, shear moduli 1 and 10, incompressible, strained uniformly by
eps_yy = -0.01, with `geometry = 'fixed'`; free above. The normal stress -p + 2 G eps_yy is the same
in both layers, so p1 - p2 = 2 (G1 - G2) eps_yy = -0.18. The solution lies in the space of the
elements on any mesh: 1e-10. In plane strain eps_xx = 0.01; in axial symmetry, y the axis, and in 3D
the two other strains are 0.005. A block of three materials that meet in a line, with eps_xx =
eps_yy = -0.01, has p = 2 G eps_yy in each of them likewise.

Bending: two layers of moduli 70 and 210 GPa, thick 1 and 2, bent to a curvature: with equal
Poisson's ratios the stress is E/(1 - nu^2) kappa (y - y_n) everywhere, and M = sum E_i I_i/(1 -
nu^2) kappa. Linear displacements over 12 cells a layer are 0.7 % too stiff: 1 %, falling with
order 2.

Interfaces: layers whose mesh has nodes of its own for each of them, at the same places, are bonded by
`&interface`, and give the same jump; layers that share nodes are parted by `treatment = 'contact'`,
and the upper one, drawn off, moves without any force.

A billet of two metals that flow, pressed under friction: saved, it goes on to the same bits on one
rank, on another number of ranks to 1e-8; its energies balance (tools/verify holds them to 1e-3).
"""
import itertools

import swage_mesh_writer
import swage_process
from swage_process import deviation, differences, run as run_case, write_case

TRIANGLE, TETRAHEDRON = 5, 10
STRAIN = -0.01
MODULI = {'soft': 1.0, 'stiff': 10.0, 'third': 4.0}
JUMP = 2 * (MODULI['stiff'] - MODULI['soft']) * STRAIN
TOLERANCE = 1e-10

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' geometry = 'fixed' /
&mesh file = '{mesh}.msh' /
{bodies}
{boundaries}
&step duration = 1 increments = 1 /
&solver tolerance = 1e-12 pressure_tolerance = 1e-12 linear_solver = '{solver}' /
&output double_precision = .true. /
"""

BILLET = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' /
&mesh file = 'billet.msh' /
&body name = 'core' material = 'steel' group = 'core' /
&body name = 'coat' material = 'copper' group = 'coat' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'steel' /
&material name = 'copper' law = 'j2' young = 120000 poisson = 0.34 flow_stress = 'copper' /
&flow_stress name = 'steel' kind = 'swift' strength = 500 prestrain = 0.01 exponent = 0.2 /
&flow_stress name = 'copper' kind = 'linear' yield_stress = 100 hardening_modulus = 100 /
&boundary name = 'bottom' kind = 'symmetry' group = 'BOTTOM' /
&tool name = 'upper' shape = 'plane' point = 0, 15, 0 normal = 0, -1, 0 motion = 'press' /
&motion name = 'press' direction = 0, -1, 0 time = 0, 1 displacement = 0, 1.5 /
&friction name = 'friction' kind = 'coulomb' coefficient = 0.12 /
&contact name = 'top' slave = 'TOP' master = 'upper' friction = 'friction' /
&step duration = 1 increments = 12 /
&solver tolerance = 1e-11 pressure_tolerance = 1e-10 maximum_iterations = 30 /
&output double_precision = .true. every = 3 /
&restart {restart} /
"""


def run(context):
    for name, make in (('rows', structured_plane), ('free', unstructured_plane)):
        make(context, name)
        for solver, ranks in itertools.product(('mumps', 'mumps_lagged'), (1, 2, 3)):
            yield jump(context, 'plane_strain', name, solver, ranks)
        for ranks in (1, 2, 3):
            yield jump(context, 'axisymmetric', name, 'mumps_lagged', ranks)
    for name, make in (('boxes', structured_solid), ('free_solid', unstructured_solid)):
        make(context, name)
        for ranks in (1, 2, 3):
            yield jump(context, '3d', name, 'mumps_lagged', ranks)
    context.box('three', 4, 4, 2, name_cell=lambda x, y, z: (
        'soft' if y < 0.5 else 'stiff' if x < 0.5 else 'third'))
    for ranks in (1, 2, 3):
        yield jump(context, '3d', 'three', 'mumps_lagged', ranks, names=('soft', 'stiff', 'third'),
                   strains=(STRAIN, -2 * STRAIN))
    yield from interfaces(context)
    yield from bending(context)
    yield from billet(context)


# --- Jump

def jump(context, dimension, mesh, solver, ranks, names=('soft', 'stiff'), strains=None, rest=''):
    """Largest error of the pressures in all cells, and of the jump at nodes, by the jump."""
    along_x, along_z = strains or {'plane_strain': (-STRAIN, 0), 'axisymmetric': (-STRAIN / 2, 0),
                                   '3d': (-STRAIN / 2, -STRAIN / 2)}[dimension]
    if dimension == '3d':
        moved = [('XMIN', 'x', 0), ('XMAX', 'x', along_x), ('YMIN', 'y', 0), ('ZMIN', 'z', 0),
                 ('ZMAX', 'z', along_z)]
    else:
        moved = [('LEFT', 'x', 0), ('RIGHT', 'x', along_x), ('BOTTOM', 'y', 0)]
    # Stretched sides prescribe the strain; the height follows
    case = CASE.format(dimension=dimension, mesh=mesh, solver=solver,
                       bodies='\n'.join(incompressible(name) for name in names),
                       boundaries='\n'.join(motion(*entry) for entry in moved) + rest)
    done = context.run_swage(case, ranks=ranks, name=f'{mesh}_{dimension}_{solver}_{ranks}')
    step = done.results().step(-1)
    numbers = step.numbers[TETRAHEDRON if dimension == '3d' else TRIANGLE]
    pressure = -step.cell_fields['stress'].reshape(step.n_cell, -1)[numbers, :3].mean(axis=1)
    body_of = step.cell_fields['body'].ravel()[numbers]
    parts = [pressure[body_of == i] for i in range(1, len(names) + 1)]
    errors = [abs(part - 2 * MODULI[name] * STRAIN).max() for part, name in zip(parts, names)]
    errors.append(abs(step.point_fields['pressure_jump'].max() + JUMP))
    return context.row(f'{dimension}, {mesh}, {solver}, {ranks} ranks: p1 - p2',
                       parts[1].mean() - parts[0].mean(), JUMP, TOLERANCE, max(errors) / abs(JUMP))


def incompressible(name):
    return (f"&body name = '{name}' material = '{name}' group = '{name}' /\n"
            f"&material name = '{name}' law = 'elastic' young = {3 * MODULI[name]} poisson = 0.5 /")


def motion(group, axis, value):
    """The displacement at the end, along one axis."""
    vector = ', '.join(repr(float(value)) if axis == other else '0' for other in 'xyz')
    return (f"&boundary name = '{group}' kind = 'velocity' group = '{group}' components = '{axis}' "
            f"velocity = {vector} /")


def layer(x, y, *_):
    return 'soft' if y < 0.5 else 'stiff'


def structured_plane(context, name):
    context.rectangle(name, 5, 6, name_cell=layer)


def structured_solid(context, name):
    context.box(name, 3, 4, 3, name_cell=layer)


def unstructured_plane(context, name):
    """Triangles by Gmsh, the lower layer finer than the upper one."""
    context.make_mesh('''
Point(1) = {0, 0, 0, 0.12}; Point(2) = {1, 0, 0, 0.12};
Point(3) = {1, 0.43, 0, 0.15}; Point(4) = {0, 0.43, 0, 0.15};
Point(5) = {1, 1, 0, 0.25}; Point(6) = {0, 1, 0, 0.25};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Line(5) = {3, 5}; Line(6) = {5, 6}; Line(7) = {6, 4};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Curve Loop(2) = {-3, 5, 6, 7}; Plane Surface(2) = {2};
Physical Surface("soft") = {1}; Physical Surface("stiff") = {2};
Physical Curve("LEFT") = {4, 7}; Physical Curve("RIGHT") = {2, 5};
Physical Curve("BOTTOM") = {1}; Physical Curve("TOP") = {6};
''', 2, name)


def unstructured_solid(context, name):
    """Tetrahedra by Gmsh in two boxes that share a face."""
    context.make_mesh('''
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 0.43, 1}; Box(2) = {0, 0.43, 0, 1, 0.57, 1};
BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }
e = 0.001;
Physical Volume("soft") = {1}; Physical Volume("stiff") = {2};
Physical Surface("XMIN") = Surface In BoundingBox{-e, -e, -e, e, 1+e, 1+e};
Physical Surface("XMAX") = Surface In BoundingBox{1-e, -e, -e, 1+e, 1+e, 1+e};
Physical Surface("YMIN") = Surface In BoundingBox{-e, -e, -e, 1+e, e, 1+e};
Physical Surface("YMAX") = Surface In BoundingBox{-e, 1-e, -e, 1+e, 1+e, 1+e};
Physical Surface("ZMIN") = Surface In BoundingBox{-e, -e, -e, 1+e, 1+e, e};
Physical Surface("ZMAX") = Surface In BoundingBox{-e, -e, 1-e, 1+e, 1+e, 1+e};
Mesh.MeshSizeMin = 0.25; Mesh.MeshSizeMax = 0.3;
''', 3, name)


# --- Interfaces

def interfaces(context):
    """Layers bonded that share no node, and layers parted that do."""
    sheets(context, 'doubled')
    bond = "\n&interface name = 'bond' bodies = 'soft', 'stiff' treatment = '{}' /"
    for ranks in (1, 2, 3):
        yield jump(context, 'plane_strain', 'doubled', 'mumps_lagged', ranks,
                   rest=bond.format('bonded'))
    pulled = '\n'.join(motion(*entry) for entry in (('LEFT', 'x', 0), ('BOTTOM', 'y', 0),
                                                    ('TOP', 'y', 0.01)))
    for mesh, treatment, ranks in (('rows', 'bonded', 1), ('rows', 'contact', 1),
                                   ('rows', 'contact', 2), ('rows', 'contact', 3)):
        done = context.run_swage(CASE.format(
            dimension='plane_strain', mesh=mesh, solver='mumps_lagged',
            bodies=incompressible('soft') + '\n' + incompressible('stiff'),
            boundaries=pulled + bond.format(treatment)), ranks=ranks, name=f'{treatment}_{ranks}')
        force = done.history['reaction_TOP_y'][-1]
        if treatment == 'bonded':
            # Without shear between the layers, of 4 G each in plane strain: the bound of Reuss
            yield context.above('bonded layers drawn apart: force', force,
                                0.01 * 4 / (0.5 / MODULI['soft'] + 0.5 / MODULI['stiff']))
        else:
            yield context.zero(f'parted layers drawn apart, {ranks} ranks: force', force, 1e-12)
    pulled = '\n'.join(motion(*entry) for entry in (
        ('XMIN', 'x', 0), ('YMIN', 'y', 0), ('ZMIN', 'z', 0), ('YMAX', 'y', 0.01)))
    for mesh in ('boxes', 'free_solid'):
        done = context.run_swage(CASE.format(
            dimension='3d', mesh=mesh, solver='mumps_lagged',
            bodies=incompressible('soft') + '\n' + incompressible('stiff'),
            boundaries=pulled + bond.format('contact')), name=f'contact_{mesh}')
        yield context.zero(f'3d, {mesh}: parted layers drawn apart: force',
                           done.history['reaction_YMAX_y'][-1], 1e-12)


def sheets(context, name, n=5, m=3):
    """Two layers of n x m rectangles, each with its own nodes."""
    points, groups = [], {key: [] for key in ('soft', 'stiff', 'LEFT', 'RIGHT', 'BOTTOM', 'TOP')}
    for body, base in (('soft', 0.0), ('stiff', 0.5)):
        start = len(points)
        points += [(i / n, base + 0.5 * j / m) for j in range(m + 1) for i in range(n + 1)]

        def at(i, j, start=start):
            return start + j * (n + 1) + i

        for j, i in itertools.product(range(m), range(n)):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            groups[body] += [(a, b, c), (a, c, d)]
        groups['LEFT'] += [(at(0, j + 1), at(0, j)) for j in range(m)]
        groups['RIGHT'] += [(at(n, j), at(n, j + 1)) for j in range(m)]
        edge, row = ('BOTTOM', 0) if body == 'soft' else ('TOP', m)
        groups[edge] += [(at(i, row), at(i + 1, row)) for i in range(n)]
    swage_mesh_writer.write_msh(context.folder / f'{name}.msh', points,
                                [(key, len(cells[0]) - 1, cells) for key, cells in groups.items()])


# --- Bending

YOUNG, POISSON, THICKNESS, LENGTH, CURVATURE = (70000.0, 210000.0), 0.3, (1.0, 2.0), 6.0, 1e-4


def bending(context):
    """The moment of two layers, from the reactions at the end."""
    edges = (0.0, THICKNESS[0], sum(THICKNESS))
    layers = list(zip(YOUNG, edges, edges[1:]))
    axis = (sum(e * (b**2 - a**2) / 2 for e, a, b in layers)
            / sum(e * (b - a) for e, a, b in layers))
    stiffness = sum(e * ((b - axis)**3 - (a - axis)**3) / 3 for e, a, b in layers) \
        / (1 - POISSON**2)
    errors = []
    for n in (6, 12):
        heights = beam(context, f'beam_{n}', n)
        boundaries = [motion(f'END{i}', 'x', -CURVATURE * LENGTH * (y - axis))
                      for i, y in enumerate(heights)]
        boundaries += ["&boundary name = 'middle' kind = 'symmetry' group = 'LEFT' /",
                       "&boundary name = 'pin' kind = 'fixed' group = 'PIN' components = 'y' /"]
        bodies = '\n'.join(
            f"&body name = '{name}' material = '{name}' group = '{name}' /\n&material name = "
            f"'{name}' law = 'elastic' young = {young} poisson = {POISSON} /"
            for name, young in zip(('lower', 'upper'), YOUNG))
        done = context.run_swage(CASE.format(
            dimension='plane_strain', mesh=f'beam_{n}', solver='mumps_lagged', bodies=bodies,
            boundaries='\n'.join(boundaries)), name=f'beam_{n}')
        moment = -sum(done.history[f'reaction_END{i}_x'][-1] * (y - axis)
                      for i, y in enumerate(heights))
        errors.append(abs(moment / (stiffness * CURVATURE) - 1))
        if n == 12:
            yield context.row(f'two layers of {n} cells: moment by the curvature',
                              moment / CURVATURE, stiffness, 0.01)
    yield context.order('moment, 6 to 12 cells a layer', (1 / 6, 1 / 12), errors, 2.0, 0.2)


def beam(context, name, n):
    """Half of a beam, n cells over each layer. Groups lower, upper, LEFT, PIN, END0, END1 and so on
    up the end; returns the heights of those."""
    heights = [THICKNESS[0] * i / n for i in range(n)] \
        + [THICKNESS[0] + THICKNESS[1] * i / n for i in range(n + 1)]
    m = 3 * n
    points = [(LENGTH * i / m, y) for y in heights for i in range(m + 1)]
    cells = {'lower': [], 'upper': []}
    for j, i in itertools.product(range(2 * n), range(m)):
        a, b, c, d = (k * (m + 1) + l for k, l in ((j, i), (j, i + 1), (j + 1, i + 1), (j + 1, i)))
        cells['lower' if j < n else 'upper'] += \
            [(a, b, c), (a, c, d)] if (i + j) % 2 else [(a, b, d), (b, c, d)]
    left = [((j + 1) * (m + 1), j * (m + 1)) for j in range(2 * n)]
    groups = [(body, 2, triangles) for body, triangles in cells.items()]
    groups += [('LEFT', 1, left), ('PIN', 0, [(0,)])]
    groups += [(f'END{j}', 0, [(j * (m + 1) + m,)]) for j in range(2 * n + 1)]
    swage_mesh_writer.write_msh(context.folder / f'{name}.msh', points, groups)
    return heights


# --- Two metals

def billet(context):
    """A run that is saved half way goes on as the whole one."""
    context.rectangle('billet', 6, 9, lambda x, y: (10 * x, 15 * y),
                      name_cell=lambda x, y: 'core' if x < 20 / 3 else 'coat')
    done = context.run_swage(BILLET.format(restart=''), name='whole')
    whole = context.folder / 'whole'
    for before, after in ((1, 1), (1, 2), (2, 3), (3, 1)):
        write_case(context, 'part', BILLET.format(restart='every = 7'))
        expect(context, 'part', [], before)
        expect(context, 'part', ['--restart'], after)
        title = f'saved on {before}, gone on with on {after} ranks'
        if before == after:
            yield context.zero(f'{title}: results that differ in a bit',
                               len(differences(context.folder / 'part', whole)), 0)
        else:
            history = context.read_history(context.folder / 'part.csv')
            yield context.zero(f'{title}: history', deviation(history, done.history), 1e-8)


def expect(context, name, options, ranks):
    code, output = run_case(context, name, options, ranks)
    if code:
        raise swage_process.Fault(f'{name}: exit code {code}\n{output[-2000:]}')
