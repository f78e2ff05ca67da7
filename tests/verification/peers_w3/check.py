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

import swage_peer_works

# Force on the whole billet [kN] by the way of the press over 15 mm; CPU seconds of CalculiX.
FORCE = {0.08: 79.25, 0.16: 97.87, 0.2: 108.95}
SECONDS = 50.4
# Size of cells: about how many thousand nodes of the billet.
MESHES = {0.89: 2, 0.4866: 10}
TOOL_CELL = 1.25

SOLVER = '&solver tolerance = 1e-10, pressure_tolerance = 1e-10 /'
# Largest error of the stress: formulation, its tolerance, what the peer has, and which that is.
PATCH = {'l2': ('', 1e-8, 0.046, "Kratos' mortar"),
         'nodal': ("formulation = 'master_slave'", 0.2, 0.172, "CalculiX' node to surface")}


def run(context):
    for size, thousand in MESHES.items():
        if context.quick and thousand > 2:
            continue
        name = f'nodes_{thousand}k'
        context.make_mesh(swage_peer_works.tool_geometry(size, TOOL_CELL), 3, name)
        for formulation, keys in (('l2', ''), ('nodal', "formulation = 'master_slave'")):
            if formulation == 'nodal' and thousand > 2:
                continue
            case = swage_peer_works.tool_case(name, contact=keys, more='&output every = 20 /')
            done = context.run_swage(case, name=f'{name}_{formulation}', timeout=7200)
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
    context.make_mesh(swage_peer_works.cubes_geometry(3.3, 2.3), 3, 'cubes')
    for name, (keys, tolerance, peer, whose) in PATCH.items():
        done = context.run_swage(swage_peer_works.cubes_case(keys, SOLVER), name=f'cubes_{name}')
        error = swage_peer_works.error_of_cubes(done)
        yield context.zero(f'cubes, {name}: largest error of the stress', error, tolerance)
        if name == 'nodal':
            yield context.above('cubes, nodal: it fails the test', error, 1e-3)
        yield context.row(f'cubes, {name}: beside {whose}', error, peer, math.inf)
