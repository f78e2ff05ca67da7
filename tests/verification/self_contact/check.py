"""A U-shaped strip closed between two plates until its legs press on each other (self-contact).

Legs of 8 mm, 1 mm thick, 3 mm apart, stick to rigid plates that close by 3.04 mm: the bend folds
sharply, the slot closes from its whole length at once, and the legs are squeezed by 2 %. Master and
slave of the contact are the whole surface of the strip, which is only two cells thick: no wall may
take its own other side, or its neighbours, for something it has entered.

No closed form, but what must hold: no cell is inverted (the run ends, and all areas are positive),
the penetration stays below 1 % of a cell, the plates' forces balance, the answer is as symmetric as
the strip, energies balance, ranks agree and a run that goes on ends with the same bits. The root of
the fold, where walls meet at every angle, is as sharp as the mesh: forces of two formulations agree
to a facet at either end of the contact, 2 of 22, and on a mesh twice as fine to half of that. As a
ring about the axis, and as a slice in space, the same strip closes the same way.
"""
import math

import numpy
import swage_mesh_writer
import swage_process

THICKNESS, BORE, LEG = 1.0, 1.5, 8.0
ALONG, ACROSS = 56, 2
TRIANGLE, TETRAHEDRON = 5, 10

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' /
&mesh file = '{mesh}.msh' /
&body name = 'strip' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 210000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 200 hardening_modulus = 1000 /
{boundaries}
&tool name = 'lower' shape = 'plane' point = 0, -2.5, 0 normal = 0, 1, 0 motion = 'up' /
&tool name = 'upper' shape = 'plane' point = 0, 2.5, 0 normal = 0, -1, 0 motion = 'down' /
&motion name = 'down' velocity = 0, -1, 0 /
&motion name = 'up' velocity = 0, 1, 0 /
&friction name = 'stick' kind = 'sticking' /
&contact name = 'bottom' slave = '{outside}' master = 'lower' friction = 'stick' separation = .false. /
&contact name = 'top' slave = '{outside}' master = 'upper' friction = 'stick' separation = .false. /
&contact name = 'fold' slave = 'strip' master = 'strip' {keys} /
&step duration = 0.025 increments = 10 /
&step duration = {duration} increments = {increments} /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
&output double_precision = .true. every = 100 fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
FOLDS = (('l2', ''), ('symmetric', "formulation = 'symmetric'"))
#: Of the ends of the bend, in the ring that opens outwards [mm].
RADIUS = 20.0


def run(context):
    swage_mesh_writer.write_rectangle(context.folder / 'strip.msh', ALONG, ACROSS, place,
                                      diagonal='alternating')
    forces = {}
    for name, keys in FOLDS:
        done = context.run_swage(case(keys), name=name)
        yield from judge(context, name, done)
        yield context.zero(f'{name}: positions less their mirror images, by a cell',
                           asymmetry(done), 1e-6)
        forces[name] = done.history['force_upper_y'][-1]
    yield context.row('force of symmetric on that of l2', forces['symmetric'], forces['l2'], 2 / 22)

    whole = context.read_history(context.folder / 'l2.csv')
    for ranks in (2, 3):
        other = context.run_swage(case(''), name=f'ranks_{ranks}', ranks=ranks).history
        yield context.zero(f'{ranks} ranks: history', deviation(other, whole), 1e-6)
    swage_process.write_case(context, 'part', case('', restart='every = 68'))
    swage_process.run(context, 'part')
    swage_process.run(context, 'part', ['--restart'])
    yield context.zero('from the middle of the contact: results that differ in a bit', len(
        swage_process.differences(context.folder / 'part', context.folder / 'l2')), 0)

    swage_mesh_writer.write_rectangle(
        context.folder / 'ring.msh', ALONG, ACROSS, lambda x, y: at_radius(place(x, y)),
        diagonal='alternating')
    yield from judge(context, 'ring', context.run_swage(
        case('', dimension='axisymmetric', mesh='ring'), name='ring'))
    if context.quick:
        return
    swage_mesh_writer.write_rectangle(context.folder / 'fine.msh', 2 * ALONG, 2 * ACROSS, place,
                                      diagonal='alternating')
    for name, keys in FOLDS:
        done = context.run_swage(case(keys, mesh='fine'), name=f'fine_{name}')
        yield from judge(context, f'{name}, fine', done)
        forces[name] = done.history['force_upper_y'][-1]
    yield context.row('fine: force of symmetric on that of l2', forces['symmetric'], forces['l2'],
                      1 / 22)
    swage_mesh_writer.write_box(
        context.folder / 'slice.msh', ALONG, ACROSS, 1, lambda x, y, z: (*place(x, y), 0.5 * z))
    yield from judge(context, 'slice', context.run_swage(
        case('', dimension='3d', mesh='slice', outside='YMAX', boundaries=SIDES), name='slice'))


SIDES = """&boundary name = 'front' kind = 'symmetry' group = 'ZMIN' /
&boundary name = 'back' kind = 'symmetry' group = 'ZMAX' /"""


def case(keys, dimension='plane_strain', mesh='strip', outside='TOP', boundaries='', restart=''):
    return CASE.format(keys=keys, dimension=dimension, mesh=mesh, outside=outside,
                       boundaries=boundaries, restart=restart, duration=1.495, increments=60)


def place(x, y):
    """The strip unbent, from the end of the lower leg to that of the upper one; y from the slot to
    the outside."""
    total = 2 * LEG + math.pi * (BORE + THICKNESS / 2)
    along, radius = x * total, BORE + THICKNESS * y
    if along < LEG:
        return LEG - along, -radius
    if along > total - LEG:
        return along - (total - LEG), radius
    angle = (along - LEG) / (total - 2 * LEG) * math.pi
    return -radius * math.sin(angle), -radius * math.cos(angle)


def at_radius(point):
    return RADIUS + point[0], point[1]


def judge(context, name, done):
    history = done.history
    force = abs(history['force_upper_y'][-1])
    yield context.above(f'{name}: nodes in the fold', history['contact_nodes_fold'][-1], 40)
    yield context.below(f'{name}: largest penetration by the cell',
                        max(history['penetration_by_cell_fold']), 0.01)
    yield context.zero(f'{name}: forces of the plates, by one of them',
                       abs(history['force_upper_y'][-1] + history['force_lower_y'][-1]) / force,
                       1e-6)
    step = done.results().step(-1)
    yield context.above(f'{name}: smallest volume of a cell by that at the start', min(
        volumes(step, step.points) / volumes(step, step.points - step.point_fields['displacement'])),
        0.2)


def volumes(step, points):
    """Of all cells, with their sign."""
    corner = points[step.cells[TETRAHEDRON if len(step.cells[TETRAHEDRON]) else TRIANGLE]]
    edges = corner[:, 1:] - corner[:, :1]
    if edges.shape[1] == 2:
        return numpy.cross(edges[:, 0], edges[:, 1])[:, 2]
    return numpy.linalg.det(edges)


def asymmetry(done):
    """Largest distance of a node from the mirror image of its partner, by the cell size."""
    step = done.results().step(-1)
    start = step.points - step.point_fields['displacement']
    mirror = numpy.array([1.0, -1.0, 1.0])
    partner = [numpy.argmin(numpy.linalg.norm(start - point * mirror, axis=1)) for point in start]
    return abs(step.points[partner] * mirror - step.points).max() / (THICKNESS / ACROSS)


def deviation(history, reference):
    """Of what is not zero but for rounding."""
    if len(history['time']) != len(reference['time']):
        return math.inf
    return max(abs(numpy.array(history[name]) - numpy.array(reference[name])).max()
               / max(abs(value) for value in reference[name])
               for name in ('force_upper_y', 'contact_area_fold', 'penetration_fold',
                            'plastic_work', 'elastic_energy'))
