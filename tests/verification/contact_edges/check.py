"""Edges and corners of bodies in contact: overhang, sliding off, release, going through.

A block overhangs the one that it is pressed on, by one cell on either side; the forces on both
balance, and depend little on the formulation: 0.5 %. A block that is pressed by 0.02 mm is dragged
off the edge of the other one: the force falls to nothing with the length in contact, without
a jump, and is 0 beyond. Just before, the wall beside the corner of the one and the wall beside the
edge of the other lie in each other over a sliver that carries nothing. Pressed, drawn away and
pressed again, elastic blocks get the same force again, and none in between.

A block driven through a face by three cells in one increment has no condition left at its end: that
must not pass for free flight. The increment is cut, and the log says why.
"""
import swage_mesh_writer

CASE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = '{mesh}.msh' /
&body name = 'lower' material = 'steel' group = 'LOWER_BODY' /
&body name = 'upper' material = 'steel' group = 'UPPER_BODY' /
&material name = 'steel' law = 'elastic' young = 210000 poisson = 0.3 /
&boundary name = 'base' kind = 'fixed' group = 'LOWER_BOTTOM' /
&boundary name = 'press' kind = 'displacement' group = 'UPPER_TOP' components = {components}
  displacement = {motion} /
{more}
&contact name = 'edge' slave = 'upper' master = 'lower' {keys} /
&step duration = {duration} increments = {increments} maximum_cuts = {cuts} /
&output every = 1000 fields = 'displacement' /
"""
FORMULATIONS = {'l2': '', 'master/slave': "formulation = 'master_slave'",
                'points': "formulation = 'master_slave' variant = 'full'",
                'symmetric': "formulation = 'symmetric'"}
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


def block(n, m, left, bottom, right, top):
    return swage_mesh_writer.rectangle_mesh(
        n, m, lambda x, y: (left + (right - left) * x, bottom + (top - bottom) * y))


def solve(context, mesh, name, keys, motion, components="'x', 'y'", more='', duration=1,
          increments=10):
    text = CASE.format(mesh=mesh, keys=keys, motion=motion, components=components, more=more,
                       duration=duration, increments=increments, cuts=10)
    return context.run_swage(text, name=f'{mesh}_{name.replace("/", "_")}').history


def slide(context, name, keys):
    history = solve(
        context, 'off', name, keys, '7, 0, 0 time = 0, 0.2, 2 factor = 0, 0, 1', "'x'", duration=2,
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
    text = CASE.format(mesh='above', keys='', components="'x', 'y'", more='', duration=1,
                       motion='0, -3.5, 0 time = 0, 1 factor = 0, 1', increments=1, cuts=0)
    done = context.run_swage(text, name='through', expect_exit=4)
    yield context.zero('through in one increment: messages that do not say so',
                       int('bodies go through each other' not in done.output), 0)
