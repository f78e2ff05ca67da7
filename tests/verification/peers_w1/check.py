"""Sticking upsetting of one eighth of a billet to 50 %, against CalculiX: forces and CPU seconds."""
import math
import re

import swage_mesh_writer

RADIUS, HALF_HEIGHT = 10.0, 15.0
# Force on the whole billet [kN] at 10, 20, 30 %: CalculiX 2.20, C3D10, 10627 nodes. Beyond, the
# side passes the plane of the end face and the mesh decides on the force.
FORCE = {0.1: 84.29, 0.2: 110.29, 0.3: 145.45}
# Size of cells: (about how many thousand nodes, tolerance, CPU s of CalculiX with linear
# tetrahedra, seconds with quadratic ones and what they are for)
MESHES = {
    0.89: (2, 0.015, 12.5, 17.0, 'CPU s'),
    0.4866: (10, 0.01, 218.0, 2.08, 'CPU s an iteration'),
}

CASE = """&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = '{mesh}.msh' /
&body name = 'billet', material = 'steel', group = 'BODY' /
&material name = 'steel', law = 'j2', young = 200000, poisson = 0.3, flow_stress = 'steel' /
&flow_stress name = 'steel', kind = 'linear', yield_stress = 200, hardening_modulus = 300 /
&boundary name = 'x', kind = 'symmetry', group = 'XMIN' /
&boundary name = 'y', kind = 'symmetry', group = 'YMIN' /
&boundary name = 'z', kind = 'symmetry', group = 'BOTTOM' /
&boundary name = 'press', kind = 'velocity', group = 'TOP', velocity = 0, 0, -7.5 /
&step duration = 1, increments = 50 /
&output every = 50 /
"""


def run(context):
    for size, (thousand, tolerance, linear, quadratic, meaning) in MESHES.items():
        if context.quick and thousand > 2:
            continue
        name = f'nodes_{thousand}k'
        geometry = swage_mesh_writer.cylinder_geometry(RADIUS, HALF_HEIGHT, size, quarter=True)
        # Uniform, by Delaunay
        geometry += (f'Mesh.MeshSizeMin = {size};\nMesh.MeshSizeMax = {size};\n'
                     'Mesh.Algorithm3D = 1;\n')
        context.make_mesh(geometry, 3, name)
        done = context.run_swage(CASE.format(mesh=name), name=name, timeout=7200)
        history = done.history

        for reduction, reference in FORCE.items():
            # The face goes down by 7.5 mm of 15 in a unit of time
            i = min(range(len(history['time'])),
                    key=lambda j: abs(history['time'][j] - 2 * reduction))
            force = -4e-3 * history['reaction_press_z'][i]
            yield context.row(f'{thousand}k nodes: force [kN] at {reduction:.0%}', force, reference,
                              tolerance)
        yield context.row(f'{thousand}k nodes: end [s]', history['time'][-1], 1, 1e-12)
        for row in costs(context, done, thousand, linear, quadratic, meaning):
            yield row


def costs(context, done, thousand, linear, quadratic, meaning):
    """CPU seconds beside those of CalculiX, on another machine: no tolerance."""
    total, cells, contact, *solver, output = (float(word) for word in re.search(
        r'CPU (\S+) s: cells (\S+) s, contact (\S+) s, ordering (\S+) s, factorisation (\S+) s, '
        r'solution (\S+) s, output (\S+) s', done.output).groups())
    increments, iterations, cuts, lost = (int(word) for word in re.search(
        r'(\d+) increments to .*?, (\d+) iterations .*?, (\d+) cuts \((\d+) iterations lost',
        done.output).groups())
    name = f'{thousand}k nodes:'
    mine = total if meaning == 'CPU s' else total / (iterations + lost)
    yield context.row(f'{name} CPU s (reference: linear tetrahedra)', total, linear, math.inf)
    yield context.row(f'{name} {meaning} (reference: quadratic ones)', mine, quadratic, math.inf)
    yield context.row(f'{name} share of the linear solver', sum(solver) / total, 1, math.inf)
    yield context.row(f'{name} share of the cells', cells / total, 1, math.inf)
    yield context.row(f'{name} share of contact and output', (contact + output) / total, 1,
                      math.inf)
    yield context.row(f'{name} iterations an increment', iterations / increments, 2, math.inf)
    yield context.row(f'{name} cut increments', cuts, 0, math.inf)
