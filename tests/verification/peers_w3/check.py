"""An elastic tool on a plastic billet, and two cubes on each other, beside CalculiX and Kratos.

W3: the quarter of a block of 32 x 32 x 8 mm, elastic, is pressed by 3 mm on one eighth of a steel
billet of radius 10 and height 30 mm, with Coulomb friction 0.2; the side folds onto the tool. The
force is that of CalculiX 2.20 with quadratic tetrahedra (2062 nodes, and 1837 of the tool; contact
surface to surface), which took 50.4 CPU seconds.

W4: two elastic cubes with non-matching meshes under 100 MPa. The stress is uniform; what CalculiX
makes of it node to surface, and Kratos by its mortar method, stands in the rows as the reference.
"""
import math
import re

import swage_mesh_writer

# Force on the whole billet [kN] by the way of the press over 15 mm; CPU seconds of CalculiX.
FORCE = {0.08: 79.25, 0.16: 97.87, 0.2: 108.95}
SECONDS = 50.4
# Size of cells: about how many thousand nodes of the billet.
MESHES = {0.89: 2, 0.4866: 10}
TOOL_CELL = 1.25

CASE = """&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = '{mesh}.msh' /
&body name = 'billet', material = 'steel', group = 'BILLET' /
&body name = 'tool', material = 'tool_steel', group = 'TOOL' /
&material name = 'steel', law = 'j2', young = 200000, poisson = 0.3, flow_stress = 'steel' /
&flow_stress name = 'steel', kind = 'linear', yield_stress = 200, hardening_modulus = 300 /
&material name = 'tool_steel', law = 'elastic', young = 210000, poisson = 0.3 /
&boundary name = 'x', kind = 'symmetry', group = 'XMIN' /
&boundary name = 'y', kind = 'symmetry', group = 'YMIN' /
&boundary name = 'z', kind = 'symmetry', group = 'BOTTOM' /
&boundary name = 'press', kind = 'velocity', group = 'TOOL_TOP', velocity = 0, 0, -3 /
&friction name = 'dry', kind = 'coulomb', coefficient = 0.2 /
&contact name = 'face', slave = 'SKIN', master = 'TOOL_FACE', friction = 'dry' {keys} /
&step duration = 1, increments = 20 /
&output every = 20 /
"""

CUBES = """&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = 'cubes.msh' /
&body name = 'lower', material = 'steel', group = 'LOWER' /
&body name = 'upper', material = 'steel', group = 'UPPER' /
&material name = 'steel', law = 'elastic', young = 210000, poisson = 0.3 /
&boundary name = 'x', kind = 'symmetry', group = 'XMIN' /
&boundary name = 'y', kind = 'symmetry', group = 'YMIN' /
&boundary name = 'z', kind = 'symmetry', group = 'BOTTOM' /
&boundary name = 'load', kind = 'pressure', group = 'TOP', pressure = 100 /
&contact name = 'middle', slave = 'UPPER_FACE', master = 'LOWER_FACE' {keys} /
&step duration = 1, increments = 1 /
&output double_precision = .true., fields = 'stress' /
&solver tolerance = 1e-10, pressure_tolerance = 1e-10 /
"""
# Largest error of the stress: formulation, its tolerance, what the peer has, and which that is.
PATCH = {'l2': ('', 1e-8, 0.046, "Kratos' mortar"),
         'nodal': ("formulation = 'master_slave'", 0.2, 0.172, "CalculiX' node to surface")}


def run(context):
    for size, thousand in MESHES.items():
        if context.quick and thousand > 2:
            continue
        name = f'nodes_{thousand}k'
        context.make_mesh(swage_mesh_writer.billet_and_tool_geometry(size, TOOL_CELL), 3, name)
        for formulation, keys in (('l2', ''), ('nodal', "formulation = 'master_slave'")):
            if formulation == 'nodal' and thousand > 2:
                continue
            done = context.run_swage(CASE.format(mesh=name, keys=keys),
                                     name=f'{name}_{formulation}', timeout=7200)
            yield from forces(context, done, f'{thousand}k nodes, {formulation}')
    yield from patch(context)


def forces(context, done, name):
    history = done.history
    for way, reference in FORCE.items():
        i = min(range(len(history['time'])), key=lambda j: abs(history['time'][j] - 5 * way))
        force = -4e-3 * history['reaction_press_z'][i]
        yield context.row(f'{name}: force [kN] at {15 * way:.1f} mm', force, reference, 0.015)
    # What goes in above comes out below
    yield context.row(f'{name}: force on the base by that of the press',
                      history['reaction_z_z'][-1] / -history['reaction_press_z'][-1], 1, 1e-3)
    counts = re.search(r'(\d+) iterations .*?, (\d+) cuts', done.output)
    cpu = float(re.search(r'^CPU (\S+) s:', done.output, re.M)[1])
    yield context.row(f'{name}: CPU s', cpu, SECONDS, math.inf)
    yield context.row(f'{name}: iterations', int(counts[1]), 60, math.inf)
    yield context.row(f'{name}: cut increments', int(counts[2]), 0, 0)


def patch(context):
    context.make_mesh(swage_mesh_writer.cubes_geometry(3.3, 2.3), 3, 'cubes')
    for name, (keys, tolerance, peer, whose) in PATCH.items():
        done = context.run_swage(CUBES.format(keys=keys), name=f'cubes_{name}')
        stress = done.results().step(-1).cell_fields['stress']
        error = float(abs(stress[:, 2] + 100).max()) / 100
        yield context.zero(f'cubes, {name}: largest error of the stress', error, tolerance)
        if name == 'nodal':
            yield context.above('cubes, nodal: it fails the test', error, 1e-3)
        yield context.row(f'cubes, {name}: beside {whose}', error, peer, math.inf)
