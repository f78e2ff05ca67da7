"""Sticking upsetting in plane strain: force and pressure do not depend on the number of steps.

A quarter of a block of 10 x 20 mm, 10 x 20 squares of two triangles, its end held by a rough tool
(motion prescribed), 15 % shorter in 40, 160 and 640 steps; perfectly plastic, E = 200 GPa, nu =
0.3, Y = 200 MPa.

A bubble whose stress acts on the pressure increment alone loses its hold as the steps get smaller:
roughness of the pressure 0.33, 0.43, 0.48 Y at 10, 40, 160 steps, and the force drifts by per
cents (measured with a prototype). A bubble that relaxes as its cell does holds 0.125 at all three.
Roughness is the rms over all nodes of the pressure minus the mean of the neighbours', by Y.

The diagonals run to the corner of tool and side: two cells share it. Where they run the other way,
one cell fills the corner and its pressure is 3 Y, whatever the steps and the finer the mesh the
more: it is the singular corner, not roughness (all nodes 0.28, inner nodes 0.12; on the whole
block, where both kinds of corner occur, 0.36 and 0.146).

Limits, from those measurements: roughness below 0.15 and within 5 % of that of 640 steps; force
within 0.3 % of it, what a step of first order deserves (0.26 % from 25 to 200 steps in 3D).
"""
import collections

YIELD_STRESS = 200.0
STEPS = (40, 160, 640)

CASE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'block.msh' /
&body name = 'block' material = 'steel' group = 'BODY' /
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'perfect' /
&flow_stress name = 'perfect' kind = 'linear' yield_stress = 200 hardening_modulus = 0 /
&boundary name = 'middle' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'axis' kind = 'symmetry' group = 'LEFT' /
&boundary name = 'top' kind = 'velocity' group = 'TOP' velocity = 0, -1.5, 0 /
&step duration = 1 increments = {steps} /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 grad_div = {grad_div} /
&output every = {steps} fields = 'pressure' double_precision = .true. /
"""


def run(context):
    context.rectangle('block', 10, 20, lambda x, y: (5 * x, 10 * y))
    for grad_div in (0, 1):
        found = {steps: upset(context, grad_div, steps) for steps in STEPS}
        last_force, last_roughness = found[STEPS[-1]]
        for steps in STEPS:
            force, rough = found[steps]
            title = f'grad_div {grad_div}, {steps} steps'
            if steps != STEPS[-1]:
                yield context.row(f'{title}: force against {STEPS[-1]} steps', force, last_force,
                                  0.003)
                yield context.row(f'{title}: roughness against {STEPS[-1]} steps', rough,
                                  last_roughness, 0.05)
            yield context.below(f'{title}: roughness', rough, 0.15)


def upset(context, grad_div, steps):
    """Force at the end, and roughness of the pressure by the yield stress."""
    done = context.run_swage(CASE.format(grad_div=grad_div, steps=steps),
                             name=f'block_{grad_div}_{steps}')
    step = done.results().step(-1)
    return -done.history['reaction_top_y'][-1], roughness(step)


def roughness(step):
    neighbours = collections.defaultdict(set)
    for kind, cells in step.cells.items():
        for cell in cells:
            for node in cell:
                neighbours[int(node)].update(int(other) for other in cell if other != node)
    pressure = step.point_fields['pressure']
    square = [(pressure[node] - sum(pressure[other] for other in others) / len(others))**2
              for node, others in neighbours.items()]
    return (sum(square) / len(square))**0.5 / YIELD_STRESS
