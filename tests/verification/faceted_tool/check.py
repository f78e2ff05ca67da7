"""A roller of 36 facets against a round one: pressed into an elastic block and rolled over it.

Plane strain, no friction, 2.6 pitches of the facets. The ripple is half the range of the ratio of
the vertical forces while the roller rolls: what the nodes of the block contribute, both have.

Facets as they are cut 0.38 % of the radius off, a quarter of the depth, and their normals turn by
10 degrees at once: a force along the path appears that is not there. These rows show how large the
error is, not that it is small. Smoothed, the radius is right to 7e-6 of itself, 5e-4 of the depth:
1e-3 for the force, its ripple (for which 1 % was asked) and the force along the path.

The first increments are small, for the balance of energies: the work of each is a trapezoid, and the
force of the roller, which comes from the side, not linear in time.
"""
import math

import swage_mesh_writer

RADIUS, DEPTH, N_FACET = 5.0, 0.08, 36
LENGTH, HEIGHT = 8.0, 2.0
PRESSING, ROLLING, STEPS = 1.0, 4.0, 40

CASE = """&job units = 'mm-tonne-s', dimension = 'plane_strain', geometry = 'fixed' /
&mesh file = 'block.msh' /
&body name = 'block', material = 'steel', group = 'BODY' /
&material name = 'steel', law = 'elastic', young = 200000, poisson = 0.3 /
&boundary name = 'ground', kind = 'fixed', group = 'BOTTOM' /
&tool name = 'roller', {shape}, motion = 'roll' /
&motion name = 'roll', velocity = {velocity}, 0, 0, direction = 0, -1, 0,
  time = 0, {pressing}, {end}, displacement = 0, {depth}, {depth},
  axis_point = {x}, {y}, 0, angular_velocity = {spin} /
&friction name = 'none', kind = 'none' /
&contact name = 'top', slave = 'TOP', master = 'roller', friction = 'none' /
&step duration = 0.02, increments = 20 /
&step duration = 0.18, increments = 18 /
&step duration = 0.8, increments = 20 /
&step duration = {rolling}, increments = {steps} /
&output every = 1000 /
"""

SHAPES = {
    'exact': "shape = 'cylinder', axis_point = {x}, {y}, 0, radius = {radius}",
    'facets': "shape = 'faceted', file = 'roller.msh'",
    'smoothed': "shape = 'faceted', file = 'roller.msh', smoothing = .true.",
}


def run(context):
    context.rectangle('block', 64, 12, lambda x, y: (LENGTH * x, HEIGHT * (1 - (1 - y)**1.5)))
    pitch = 2 * math.pi / N_FACET
    angle = 2.6 * pitch
    start, end = 0.5 * LENGTH - 0.5 * RADIUS * angle, PRESSING + ROLLING
    height = HEIGHT + RADIUS
    velocity = RADIUS * angle / end
    turns = [i * pitch for i in range(N_FACET)]
    points = [(start + RADIUS * math.cos(a), height + RADIUS * math.sin(a)) for a in turns]
    # The outside of a line is on its right
    swage_mesh_writer.write_msh(context.folder / 'roller.msh', points, [
        ('ROLLER', 1, [(i, (i + 1) % N_FACET) for i in range(N_FACET)])])

    forces = {}
    for name, shape in SHAPES.items():
        shape = shape.format(x=start, y=height, radius=RADIUS)
        case = CASE.format(shape=shape, velocity=velocity, pressing=PRESSING, rolling=ROLLING,
                           end=end, depth=DEPTH, x=start, y=height, spin=-velocity / RADIUS,
                           steps=STEPS)
        history = context.run_swage(case, name=name).history
        forces[name] = [(x, y) for t, x, y in zip(history['time'], history['force_roller_x'],
                                                  history['force_roller_y']) if t > PRESSING]
    for name in ('facets', 'smoothed'):
        ratios = [y / exact for (_, y), (_, exact) in zip(forces[name], forces['exact'])]
        ripple = (max(ratios) - min(ratios)) / 2
        mean = sum(ratios) / len(ratios)
        along = max(abs(x - exact) / y for (x, y), (exact, _) in
                    zip(forces[name], forces['exact']))
        if name == 'facets':
            yield context.above('facets: ripple, large', ripple, 0.02)
            yield context.above('facets: force along the path by the force, large', along, 0.01)
            yield context.below('facets: mean force by the exact one, low', mean, 0.9)
        else:
            yield context.zero('smoothed: ripple', ripple, 1e-3)
            yield context.zero('smoothed: force along the path by the force', along, 1e-3)
            yield context.row('smoothed: mean force by the exact one', mean, 1, 1e-3)
