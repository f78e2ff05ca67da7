"""Flat smooth punch on a block, plane strain, perfectly plastic: Prandtl's limit 2.9685 Y.

Half width B = 1 on a block 20 B x 10 B, of which x > 0 is computed; E/Y = 1000, nu = 0.49,
`geometry = 'fixed'`; the punch goes down by 0.04 B, twice what brings it to its limit. The mean pressure of
the limit is (2 + pi) k = 2.9685 Y, k = Y/sqrt(3) (Prandtl).

A mesh is stiffer: its force lies above the limit, and falls towards it with the cells, of size B/4,
B/8, B/16 near the punch. The excess is mostly that of the punch's edge, beside which one cell is
dragged along: half a cell in B, 6 % at B/8, of order 1. Limits: excess at B/8 below 6 %, order 1 +-
0.1, and what both finest meshes extrapolate to within 0.5 % of Prandtl. An element that locks has
no limit: the force may rise by 0.1 % in the last quarter of the stroke.

With tool and contact, geometry updated: input/punch, cells of B/16, the same stroke. There the side
that rises and the cells cut otherwise add to the 4 % of the fixed geometry: below 6 %.
"""
import math

YIELD_STRESS = 200.0
LIMIT = (2 + math.pi) / math.sqrt(3)
STROKE, INCREMENTS = 0.04, 32

CASE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' geometry = 'fixed' /
&mesh file = 'block_{n}.msh' /
&body name = 'block' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.49 flow_stress = 'perfect' /
&flow_stress name = 'perfect' kind = 'linear' yield_stress = 200 /
&boundary name = 'middle' kind = 'symmetry' group = 'LEFT' /
&boundary name = 'side' kind = 'symmetry' group = 'RIGHT' /
&boundary name = 'base' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'punch' kind = 'velocity' group = 'PUNCHED' components = 'y'
  velocity = 0, {velocity}, 0 /
&step duration = 1 increments = {increments} /
&output every = {increments} fields = 'displacement' /
"""


def run(context):
    excess = {}
    for n in (4, 8, 16):
        across, down = spacing(n, 2.5), spacing(n, 1.5)
        context.rectangle(
            f'block_{n}', len(across) - 1, len(down) - 1,
            lambda x, y: (across[round(x * (len(across) - 1))],
                          -down[round((1 - y) * (len(down) - 1))]),
            name_edge=lambda side, x, y: 'PUNCHED' if side == 'TOP' and x < 1 else side)
        done = context.run_swage(CASE.format(n=n, velocity=-STROKE, increments=INCREMENTS),
                                 name=f'block_{n}')
        pressure = [-force / YIELD_STRESS for force in done.history['reaction_punch_y']]
        excess[n] = pressure[-1] / LIMIT - 1
        yield context.above(f'B/{n}: mean pressure by Y', pressure[-1], LIMIT)
        yield context.zero(f'B/{n}: rise in the last quarter',
                           pressure[-1] / pressure[3 * INCREMENTS // 4] - 1, 0.001)
    yield context.below('B/8: excess over Prandtl', excess[8], 0.06)
    for n in (4, 8):
        yield context.order(f'order of the excess, B/{n} to B/{2 * n}', (1 / n, 0.5 / n),
                            (excess[n], excess[2 * n]), 1.0, 0.1, two_sided=True)
    yield context.zero('cells to 0: excess over Prandtl', 2 * excess[16] - excess[8], 0.005)

    source = context.root / 'input' / 'punch'
    context.make_mesh((source / 'punch.geo').read_text(encoding='utf-8'), 2, 'punch')
    history = context.run_swage(source / 'punch.nml', name='punch').history
    pressure = history['force_punch_y'][-1] / 10 / YIELD_STRESS
    yield context.above('input: mean pressure by Y', pressure, LIMIT)
    yield context.below('input: excess over Prandtl', pressure / LIMIT - 1, 0.06)


def spacing(n, fine):
    """From 0 to 10: steps of 1/n up to `fine`, then growing."""
    places = [i / n for i in range(round(fine * n) + 1)]
    step, rest = 1 / n, []
    while not rest or rest[-1] < 10 - fine:
        step *= 1.3
        rest.append((rest[-1] if rest else 0.0) + step)
    return places + [fine + x * (10 - fine) / rest[-1] for x in rest]
