"""Edges and corners of bodies in contact: overhang, sliding off, release, going through.

A block overhangs the one that it is pressed on, by one cell on either side; the forces on both
balance, and depend little on the formulation: 0.5 %. A block that is pressed by 0.02 mm is dragged
off the edge of the other one: the force falls to nothing with the length in contact, without
a jump, and is 0 beyond. Just before, the wall beside the corner of the one and the wall beside the
edge of the other lie in each other over a sliver that carries nothing. Pressed, drawn away and
pressed again, elastic blocks get the same force again, and none in between.

A block driven through a face by three cells in one increment has no condition left at its end: that
must not pass for free flight. The increment is cut, and the log says why.

The corner of a square that leans by 30 degrees, or the edge of such a bar in space, is pressed on a
level face without friction: whichever side is the slave, the force stands on that face. What is left
is the tilt of the face, which is pressed in beside its middle: 1e-4, and 1e-2 where facets stay flat
(the facet under the corner tilts by that) or the force follows the slope of curved ones (the
variational `nodal`). All these formulations have the force of the corner node alone, that of
master/slave contact. A square that leans by 3 degrees touches with a part of a face, and pushes
aside by its tilt at most, 5 %.

A block that stands on a longer one has the corners of its foot at the ends of the contact. Cut in
half by its plane of symmetry, without friction, nothing but the contact could push it aside: that
plane carries no force. The strain of 1e-4 tilts what is level by as much.
"""
import math

import swage_mesh_writer

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' /
&mesh file = '{mesh}.msh' /
&body name = 'lower' material = 'steel' group = 'LOWER_BODY' /
&body name = 'upper' material = 'steel' group = 'UPPER_BODY' /
&material name = 'steel' law = 'elastic' young = 210000 poisson = 0.3 /
&boundary name = 'base' kind = 'fixed' group = 'LOWER_{bottom}' /
&boundary name = 'press' kind = 'displacement' group = 'UPPER_{top}' components = {components}
  displacement = {motion} /
{more}
&contact name = 'edge' slave = '{slave}' master = '{master}' {keys} /
&step duration = {duration} increments = {increments} maximum_cuts = {cuts} /
&output every = 1000 fields = 'displacement' /
"""
FORMULATIONS = {'l2': '', 'master/slave': "formulation = 'master_slave'",
                'points': "formulation = 'master_slave' variant = 'full'",
                'symmetric': "formulation = 'symmetric'"}
#: Keys, and what side force the method deserves.
LEANING = {
    'l2': ('', 1e-3), 'averaged': ("gap = 'averaged'", 1e-3),
    'flat': ('smoothing = .false.', 0.02), 'slave points': ("quadrature = 'slave'", 1e-3),
    'lumped': ("projection = 'lumped'", 1e-3), 'nodal': ("projection = 'nodal'", 0.02),
    'interpolation': ("projection = 'interpolation'", 1e-3),
    'multipliers': ("enforcement = 'lagrange'", 1e-3),
    'augmented': ("enforcement = 'augmented_lagrangian'", 1e-3)}
BOTH_WAYS = ('upper', 'lower'), ('lower', 'upper')
#: Forces below this share of the largest are none: the tolerance of the equilibrium.
NONE = 1e-6


def run(context):
    lower = block(10, 6, 0, 0, 10, 6)
    for name, upper in (('overhang', block(14, 4, -2, 6, 12, 10)), ('off', block(7, 4, 4, 6, 8.3, 9)),
                        ('apart', block(7, 4, 2, 6, 8, 9)), ('above', block(7, 4, 2, 6.5, 8, 9.5))):
        context.bodies(name, {'LOWER': lower, 'UPPER': upper})
    pressed = {}
    for name, keys in FORMULATIONS.items():
        history = solve(context, 'overhang', name, keys, '0, -0.1, 0 time = 0, 1 factor = 0, 1')
        pressed[name] = -history['reaction_press_y'][-1]
        yield context.zero(f'{name}, overhang: forces that do not balance', abs(
            history['reaction_base_y'][-1] / pressed[name] - 1), NONE)
        yield context.row(f'{name}, overhang: force', pressed[name], pressed['l2'], 0.005)
        yield from slide(context, name, keys)
        yield from release(context, name, keys)
    yield from go_through(context)
    yield from lean(context)
    yield from lean_in_space(context)
    yield from stand(context)


def block(n, m, left, bottom, right, top):
    return swage_mesh_writer.rectangle_mesh(
        n, m, lambda x, y: (left + (right - left) * x, bottom + (top - bottom) * y))


def write_case(mesh, keys, motion, components="'x', 'y'", more='', duration=1, increments=10,
               cuts=10, slave='upper', master='lower', dimension='plane_strain',
               faces=('BOTTOM', 'TOP')):
    return CASE.format(mesh=mesh, keys=keys, motion=motion, components=components, more=more,
                       duration=duration, increments=increments, cuts=cuts, slave=slave,
                       master=master, dimension=dimension, bottom=faces[0], top=faces[1])


def solve(context, mesh, name, keys, motion, **more):
    name = f'{mesh}_{name}'.replace('/', '_').replace(' ', '_')
    return context.run_swage(write_case(mesh, keys, motion, **more), name=name).history


def slide(context, name, keys):
    history = solve(
        context, 'off', name, keys, '7, 0, 0 time = 0, 0.2, 2 factor = 0, 0, 1',
        components="'x'", duration=2,
        more="&boundary name = 'down' kind = 'displacement' group = 'UPPER_TOP' components = 'y'\n"
             '  displacement = 0, -0.02, 0 time = 0, 0.2, 2 factor = 0, 1, 1 /', increments=80)
    force = [-value for value in history['reaction_press_y']]
    largest = max(force)
    # An increment is 0.1 mm; the last node, corner on corner, leaves with more than its seventh
    yield context.below(f'{name}, sliding off: largest change in an increment',
                        max(abs(b - a) for a, b in zip(force[9:], force[10:])) / largest, 0.2)
    beyond = max(abs(value) for time, value in zip(history['time'], force) if time > 1.9)
    yield context.zero(f'{name}, sliding off: force beyond', beyond / largest, NONE)


def release(context, name, keys):
    history = solve(context, 'apart', name, keys,
                    '0, -0.02, 0 time = 0, 1, 2, 3 factor = 0, 1, -1, 1', duration=3,
                    increments=18)
    force = dict(zip((round(6 * time) for time in history['time']), history['reaction_press_y']))
    yield context.zero(f'{name}, drawn away: force', abs(force[12] / force[6]), NONE)
    yield context.row(f'{name}, pressed again: force', force[18], force[6], 0.001)


def go_through(context):
    text = write_case('above', '', '0, -3.5, 0 time = 0, 1 factor = 0, 1', increments=1, cuts=0)
    done = context.run_swage(text, name='through', expect_exit=4)
    yield context.zero('through in one increment: messages that do not say so',
                       int('bodies go through each other' not in done.output), 0)


def formulations(context):
    return [(name, item) for name, item in LEANING.items()
            if not context.quick or name in ('l2', 'nodal', 'multipliers')]


def turned(degrees, side, foot):
    """Where a point of the unit square is in one that leans."""
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return lambda x, y: (foot[0] + side * (cosine * x - sine * y),
                         foot[1] + side * (sine * x + cosine * y))


def lean(context):
    base = block(10, 6, 0, 0, 10, 6)
    for degrees in (3, 30):
        context.bodies(f'lean_{degrees}', {'LOWER': base, 'UPPER': swage_mesh_writer.rectangle_mesh(
            4, 4, turned(degrees, 4, (4.7, 6)))})
    _, reference = press(context, 'lean_30', 'nodes', "formulation = 'master_slave'")
    for name, (keys, tolerance) in formulations(context):
        for slave, master in BOTH_WAYS:
            label = f'{name}, {slave} as slave'
            side, force = press(context, 'lean_30', label, keys, slave=slave, master=master)
            yield context.zero(f'{label}, leaning: side force', side, tolerance)
            if name not in ('multipliers', 'augmented'):
                yield context.row(f'{label}, leaning: force', force, reference, tolerance)
    for slave, master in BOTH_WAYS:
        side, _ = press(context, 'lean_3', f'{slave} as slave', '', slave=slave, master=master)
        yield context.zero(f'l2, {slave} as slave, leaning by 3 degrees: side force', side, 0.05)


def lean_in_space(context):
    lean_by = turned(30, 3, (2.4, 3))
    base = swage_mesh_writer.box_mesh(5, 3, 3, lambda x, y, z: (5 * x, 3 * y, 3 * z))
    bar = swage_mesh_writer.box_mesh(3, 3, 2, lambda x, y, z: (*lean_by(x, y), 0.5 + 2 * z))
    context.bodies('bar', {'LOWER': base, 'UPPER': bar})
    for slave, master in BOTH_WAYS:
        side, _ = press(context, 'bar', f'{slave} as slave', '', slave=slave, master=master,
                        dimension='3d', components="'x', 'y', 'z'", faces=('YMIN', 'YMAX'))
        yield context.zero(f'l2, bar on its edge, {slave} as slave: side force', side, 1e-3)


def press(context, mesh, name, keys, **more):
    """Side force by the force, and the force."""
    history = solve(context, mesh, name, keys, '0, -0.1, 0 time = 0, 1 factor = 0, 1',
                    increments=5, **more)
    force = -history['reaction_press_y'][-1]
    return history['reaction_press_x'][-1] / force, force


def stand(context):
    context.bodies('stand', {'LOWER': block(10, 6, 0, 0, 10, 6), 'UPPER': block(4, 4, 0, 6, 4, 10)})
    for name, (keys, _) in formulations(context):
        for slave, master in BOTH_WAYS:
            label = f'{name}, {slave} as slave'
            history = solve(
                context, 'stand', label, keys, '0, -0.0004, 0 time = 0, 1 factor = 0, 1',
                components="'y'", increments=2, slave=slave, master=master,
                more="&boundary name = 'cut' kind = 'symmetry' group = 'UPPER_LEFT' /\n"
                     "&boundary name = 'cut_below' kind = 'symmetry' group = 'LOWER_LEFT' /")
            yield context.zero(f'{label}, standing: side force', history['reaction_cut_x'][-1]
                               / history['reaction_press_y'][-1], 1e-3)
