"""A tool that rotates: torsion of an elastic cylinder held by two plates, and half a rigid turn."""
import math

import swage_mesh_writer

RADIUS, HEIGHT = 10.0, 30.0
YOUNG, POISSON = 200e3, 0.3
ANGLE = 1e-3

CASE = """&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = '{mesh}.msh' /
&body name = 'bar', material = 'steel', group = 'BODY' /
&material name = 'steel', law = 'elastic', young = {young}, poisson = {poisson} /
&tool name = 'upper', shape = 'plane', point = 0, 0, {height}, normal = 0, 0, -1, motion = 'turn' /
&tool name = 'lower', shape = 'plane', point = 0, 0, 0, normal = 0, 0, 1, motion = '{lower}' /
&motion name = 'turn', axis_point = 0, 0, 0, axis_direction = 0, 0, 1, angular_velocity = {angle} /
&friction name = 'weld', kind = 'sticking' /
&contact name = 'top', slave = 'TOP', master = 'upper', friction = 'weld', separation = .false.,
  penalty_factor = 1e3, tangential_factor = 1 /
&contact name = 'bottom', slave = 'BOTTOM', master = 'lower', friction = 'weld',
  separation = .false., penalty_factor = 1e3, tangential_factor = 1 /
&step duration = 1, increments = {increments} /
&solver tolerance = {tolerance}, pressure_tolerance = {tolerance} /
&output double_precision = .true. /
"""


def cylinder(path, n, m):
    """Rings of 6, 12, ... 6 n points around the axis, in m layers of prisms of three tetrahedra."""
    ring = [0] + [1 + 3 * k * (k - 1) for k in range(1, n + 2)]
    flat = [(0.0, 0.0)]
    for k in range(1, n + 1):
        turns = [math.pi * i / (3 * k) for i in range(6 * k)]
        flat += [(RADIUS * k / n * math.cos(a), RADIUS * k / n * math.sin(a)) for a in turns]

    def at(k, i):
        return ring[k] + i % (6 * k) if k else 0

    triangles = []
    for k in range(n):
        for side in range(6):
            for i in range(k + 1):
                inner, outer = side * k + i, side * (k + 1) + i
                triangles.append((at(k, inner), at(k + 1, outer), at(k + 1, outer + 1)))
                if i < k:
                    triangles.append((at(k, inner), at(k + 1, outer + 1), at(k, inner + 1)))
    count = len(flat)
    points = [(x, y, HEIGHT * layer / m) for layer in range(m + 1) for x, y in flat]
    cells = []
    for layer in range(m):
        for triangle in triangles:
            # Neighbours cut their common face alike when each prism starts at its lowest number
            a, b, c = (p + layer * count for p in sorted(triangle))
            cells += [(a, b, c, c + count), (a, b, b + count, c + count),
                      (a, a + count, b + count, c + count)]
    return swage_mesh_writer.write_msh(path, points, [
        ('BODY', 3, swage_mesh_writer.oriented(points, cells)),
        ('BOTTOM', 2, [(a, c, b) for a, b, c in triangles]),
        ('TOP', 2, [tuple(p + m * count for p in triangle) for triangle in triangles])])


def case(mesh, lower, angle, increments, tolerance):
    return CASE.format(mesh=mesh, lower=lower, angle=repr(angle), increments=increments,
                       tolerance=repr(tolerance), young=YOUNG, poisson=POISSON, height=HEIGHT)


def run(context):
    shear_modulus = YOUNG / (2 * (1 + POISSON))
    torque = shear_modulus * math.pi * RADIUS**4 / 2 * ANGLE / HEIGHT
    sizes, errors = [], []
    # The layers matter most: the displacement is bilinear along the axis
    for n, m in ((3, 16), (6, 32)):
        cylinder(context.folder / f'rings_{n}.msh', n, m)
        history = context.run_swage(case(f'rings_{n}', 'fixed', ANGLE, 2, 1e-7),
                                    name=f'torsion_{n}').history
        computed = -history['torque_upper_z'][-1]
        sizes.append(RADIUS / n)
        errors.append(abs(computed / torque - 1))
        yield context.row(f'torque, {n} rings', computed, torque, 0.02 if n == 6 else 0.1)
        yield context.row(f'torque of the other plate, {n} rings', history['torque_lower_z'][-1],
                          computed, 1e-6)
        yield context.row(f'angle of the tool, {n} rings', history['angle_upper'][-1], ANGLE, 1e-15)
    yield context.order('order of the torque', sizes, errors, 2, 0.2)

    done = context.run_swage(case('rings_3', 'turn', math.pi, 6, 1e-7), name='half_turn')
    yield context.row('half a turn: angle', done.history['angle_upper'][-1], math.pi, 1e-15)
    yield context.row('half a turn: angle in the middle', done.history['angle_upper'][3],
                      math.pi / 2, 1e-15)
    results = done.results()
    start, end = results.step(0), results.step(-1)
    yield context.zero('half a turn: stress by 0.001 E',
                       abs(end.cell_fields['stress']).max() / (YOUNG * 1e-3), 1e-6)
    yield context.zero('half a turn: torque by that of the torsion',
                       done.history['torque_upper_z'][-1] / torque, 1e-6)
    # Points of the body alone: the tools are drawn too
    apart = (end.points - start.points * [-1.0, -1.0, 1.0])[end.cells[10]]
    yield context.zero('half a turn: points by the radius', abs(apart).max() / RADIUS, 1e-6)
