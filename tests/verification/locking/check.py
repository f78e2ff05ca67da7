"""Locking of contact under stiff penalties, bodies that exchange roles, and coarse slaves.

A slab of 1 x 0.1 on a block of 1 x 0.5, E = 100, nu = 0.3, held at the sides and below, pressed on
top by 1 + 0.9 cos 2 pi x (times 1e-4); plane strain, small strain, no friction. 16 cells of the slab
meet 11 of the block. What counts is the first cosine of the deflection of the slab's underside:
2.428652e-3 on fine meshes that match.

A formulation with more conditions than the surfaces can follow keeps the interface straight once the
penalty is stiff: the ratio of deflections at penalties of 1e6 and of 100 E/h on the same mesh tells
it. The factor of `&contact` counts in the stiffness 3G/h of cells, h the mean of both sides. The
contact may not separate: it is compressive all over in the exact solution, but formulations that lock
have tension, and opening would let them go.

Each facet has one pressure, such that the forces of the nodes are those of the cosine: with c the
cosine in the middle of a facet of length h, 1 + 0.9 c (sin(pi h)/(pi h))^2/cos(pi h).

The load is small because the surfaces turn: what a facet that turns by t adds to the gap, t^2 h, times
a stiff penalty, must not exceed the pressure. The interface is drawn at 0, where places are rounded
least. At 1e6 E/h displacements are 2e6 times the penetrations, so that doubles tell forces to 3e-10 at
best, and Newton stops there.

The force on the base is the load: 1e-10 for all but `half_pass`, without reactions, and
`interpolation`, whose projection does not keep the sum.

Last, a slave of 11 facets on a master of 32, and its like in space, 4 x 4 on 12 x 12. Nodal
master/slave lets nodes of the master into facets of the slave; with quasi-symmetric contact no node
of either side gets a tenth as deep.
"""
import math

import numpy

import swage_mesh_writer

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' geometry = 'fixed' /
&mesh file = '{mesh}.msh' /
&material name = 'soft' law = 'elastic' young = 100 poisson = 0.3 /
{bodies}
{boundaries}
{contact}
&step duration = 1 increments = 1 /
&output double_precision = .true. fields = 'displacement', 'body' /
&solver tolerance = {tolerance} pressure_tolerance = {tolerance} maximum_iterations = 40 /
"""
# 3G/h of a cell by E/h.
STIFFNESS = 3 / (2 * 1.3)
EXACT = 2.428652e-3
SCALE = 1e-4
SLAB, BLOCK = 0, 1
TRIANGLE, TETRAHEDRON = 5, 10
L2 = {'l2': "formulation = 'quasi_symmetric'",
      'l2, averaged gap': "formulation = 'quasi_symmetric' gap = 'averaged'"}
FREE = {'l2 on facets of the slave': "formulation = 'quasi_symmetric' quadrature = 'slave'",
        'lumped, averaged gap':
            "formulation = 'quasi_symmetric' projection = 'lumped' gap = 'averaged'",
        'lumped': "formulation = 'quasi_symmetric' projection = 'lumped' smoothing = .false.",
        'interpolation': "formulation = 'quasi_symmetric' projection = 'interpolation'",
        'nodal projection': "formulation = 'quasi_symmetric' projection = 'nodal'",
        'master/slave, nodal': "formulation = 'master_slave'",
        'master/slave, one point': "formulation = 'master_slave' variant = 'one_point'"}
LOCKING = {'master/slave, full': "formulation = 'master_slave' variant = 'full'",
           'symmetric': "formulation = 'symmetric'",
           'half-pass': "formulation = 'half_pass'"}
UNBALANCED = ('interpolation', 'half-pass')


def run(context):
    slab_on_block(context, 'plane', 16, 11)
    yield from matching(context)
    for name, keys in (L2 | FREE | LOCKING).items():
        if context.quick and name not in ('l2', 'l2, averaged gap', 'symmetric'):
            continue
        found = {}
        for slave, penalty in ((SLAB, 1e2), (SLAB, 1e6), (BLOCK, 1e2), (BLOCK, 1e6)):
            done = press(context, 'plane', 16, slave, keys, penalty,
                         {'symmetric': 1e-10, 'half-pass': 3e-9}.get(name, 3e-10))
            found[slave, penalty] = deflection(done)
            if name not in UNBALANCED:
                yield context.zero(f'{name}, {("slab", "block")[slave]} slave, {penalty:g} E/h: '
                                   'force on the base', lost(done.history), 1e-10)
        yield from judge(context, name, found)
    yield from coarse_slave(context)


def judge(context, name, found):
    """Deflections by role and penalty."""
    title = f'{name}: deflection, '
    if name != 'half-pass':
        yield context.row(title + '1e2 E/h', found[SLAB, 1e2], EXACT, 0.15)
    stiff = found[SLAB, 1e6] / found[SLAB, 1e2]
    change = abs(found[BLOCK, 1e2] / found[SLAB, 1e2] - 1)
    if name in LOCKING:
        yield context.below(title + '1e6 by 1e2', stiff, 0.1)
        return
    yield context.above(title + '1e6 by 1e2', stiff, 0.98)
    yield context.above(title + '1e6 by 1e2, roles exchanged', found[BLOCK, 1e6] / found[BLOCK, 1e2], 0.98)
    yield context.below(title + 'roles exchanged', change, 0.01 if name in L2 else 0.2)


def matching(context):
    slab_on_block(context, 'matching', 48, 48, 8, 32)
    found = deflection(press(context, 'matching', 48, SLAB, L2['l2'], 1e4))
    yield context.row('fine meshes that match: deflection', found, EXACT, 0.02)


def coarse_slave(context):
    """The block as the slave of a slab of finer cells."""
    slab_on_block(context, 'fine_master', 32, 11)
    box_on_box(context, 'space', 12, 4)
    for title, mesh, n in (('2D', 'fine_master', 32), ('3D', 'space', 12)):
        deepest = {}
        for name, keys in (('master/slave, nodal', "formulation = 'master_slave'"), *L2.items()):
            done = press(context, mesh, n, BLOCK, keys, 1e2)
            deepest[name] = max(penetrations(done))
        for name in L2:
            yield context.above(f'{title}, coarse slave: penetration, nodal by {name}',
                                deepest['master/slave, nodal'] / deepest[name], 10)


def slab_on_block(context, name, upper, lower, upper_layers=3, lower_layers=8):
    def group(side, x, y):
        return f'{side}_{int(x * upper)}' if side == 'TOP' else side

    context.bodies(name, {
        'LOWER': swage_mesh_writer.rectangle_mesh(lower, lower_layers, lambda x, y: (x, 0.5 * y - 0.5)),
        'UPPER': swage_mesh_writer.rectangle_mesh(upper, upper_layers, lambda x, y: (x, 0.1 * y),
                                                  name_edge=group)})


def box_on_box(context, name, upper, lower):
    """As slab_on_block; the pressure is one for each strip of the top."""
    slab = swage_mesh_writer.box_mesh(upper, upper, 2, lambda x, y, z: (x, y, 0.1 * z))
    points, groups = slab
    strips = {}
    for group, dimension, cells in groups:
        if group == 'ZMAX':
            for cell in cells:
                middle = sum(points[p][0] for p in cell) / 3
                strips.setdefault(f'TOP_{int(middle * upper)}', []).append(cell)
    groups = [group for group in groups if group[0] != 'ZMAX']
    groups += [(strip, 2, cells) for strip, cells in strips.items()]
    context.bodies(name, {
        'LOWER': swage_mesh_writer.box_mesh(lower, lower, 4, lambda x, y, z: (x, y, 0.5 * z - 0.5)),
        'UPPER': (points, groups)})


def boundaries(planes, body, n):
    """Planes of symmetry, and pressures on the n strips of the top of a body."""
    h = 1 / n
    amplitude = 0.9 * (math.sin(math.pi * h) / (math.pi * h))**2 / math.cos(math.pi * h)
    lines = [f"&boundary name = '{plane}' kind = 'symmetry' group = '{plane}' /" for plane in planes]
    for i in range(n):
        pressure = SCALE * (1 + amplitude * math.cos(2 * math.pi * (i + 0.5) * h))
        lines.append(f"&boundary name = 'pressure_{i}' kind = 'pressure' group = '{body}TOP_{i}' "
                     f'pressure = {pressure!r} /')
    return '\n'.join(lines)


def press(context, mesh, n, slave, keys, penalty, tolerance=3e-10):
    plane = mesh != 'space'
    base, top, sides = (('BOTTOM', 'TOP', ('LEFT', 'RIGHT')) if plane else
                        ('ZMIN', 'ZMAX', ('XMIN', 'XMAX', 'YMIN', 'YMAX')))
    surfaces = f'UPPER_{base}', f'LOWER_{top}'
    return context.run_swage(CASE.format(
        dimension='plane_strain' if plane else '3d', mesh=mesh,
        bodies='\n'.join(f"&body name = '{body}' material = 'soft' group = '{body}_BODY' /"
                         for body in ('LOWER', 'UPPER')),
        boundaries=boundaries([f'LOWER_{base}', *(f'{body}_{side}' for body in ('LOWER', 'UPPER')
                                                  for side in sides)], 'UPPER_', n),
        contact=f"&contact name = 'middle' slave = '{surfaces[slave]}' "
                f"master = '{surfaces[1 - slave]}' {keys} separation = .false. "
                f'penalty_factor = {penalty / STIFFNESS!r} /',
        tolerance=1e-11 if penalty < 1e3 else tolerance))


def lost(history):
    """What the base does not get of the load."""
    across = 'z' if any(name.startswith('reaction_LOWER_ZMIN') for name in history) else 'y'
    base = next(name for name in (f'reaction_LOWER_BOTTOM_{across}', f'reaction_LOWER_ZMIN_{across}')
                if name in history)
    load = sum(values[-1] for name, values in history.items()
               if name.startswith('load_pressure') and name.endswith('_' + across))
    return history[base][-1] / load + 1


def deflection(done):
    """First cosine of the deflection of the slab's underside by the load."""
    step = done.results().step(-1)
    x, u, _ = surface(step, 2 if step.cell_fields['body'].max() > 1 else 1)
    order = numpy.argsort(x[:, 0])
    x, cosine = x[order, 0], u[order] * numpy.cos(2 * math.pi * x[order, 0])
    return -float(((cosine[1:] + cosine[:-1]) * numpy.diff(x)).sum()) / SCALE


def penetrations(done):
    """Deepest places of nodes of the slab in facets of the block, and the other way round, by the
    load."""
    step = done.results().step(-1)
    block, slab = surface(step, 1), surface(step, 2)
    into_block = between(*block, slab[0]) - slab[1]
    into_slab = block[1] - between(*slab, block[0])
    return float(into_block.max()) / SCALE, float(into_slab.max()) / SCALE


def surface(step, body):
    """Nodes of a body at the height of the interface: places along it, displacement across; and its
    facets there, by these nodes."""
    kind = TETRAHEDRON if len(step.cells[TETRAHEDRON]) else TRIANGLE
    n = 2 if kind == TRIANGLE else 3
    cells = step.cells[kind][step.cell_fields['body'].ravel()[step.numbers[kind]] == body]
    node = numpy.unique(cells)
    node = node[abs(step.points[node, n - 1]) < 1e-9]
    number = numpy.full(len(step.points), -1)
    number[node] = numpy.arange(len(node))
    cells = number[cells]
    facets = [cell[cell >= 0] for cell in cells[(cells >= 0).sum(axis=1) == n]]
    return (step.points[node, :n - 1], step.point_fields['displacement'][node, n - 1],
            numpy.array(facets))


def between(x, value, facets, places):
    """Interpolated in facets."""
    found = numpy.full(len(places), numpy.nan)
    ones = numpy.ones((len(places), 1))
    for facet in facets:
        corners = numpy.vstack([x[facet].T, numpy.ones(len(facet))])
        weight = numpy.linalg.solve(corners, numpy.hstack([places, ones]).T)
        inside = (weight > -1e-9).all(axis=0)
        found[inside] = value[facet] @ weight[:, inside]
    return found
