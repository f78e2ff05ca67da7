"""The upsetting that benchmarks share: a whole billet between two tools, with friction.

Radius 10, height 30 mm, Coulomb-Tresca friction 0.2, 1 % of the height an increment.
"""
import swage_mesh_writer

# Cell sizes for about 2, 10 and 30 thousand nodes
SIZES = {'2k': 1.7855, '10k': 0.9486, '30k': 0.6491}

CASE = """&job units = 'mm-tonne-s', dimension = '3d' /
&mesh file = '{mesh}.msh' /
&body name = 'billet', material = 'steel', group = 'BODY' /
&material name = 'steel', law = 'j2', young = 200000, poisson = 0.3, flow_stress = 'steel' /
&flow_stress name = 'steel', kind = 'linear', yield_stress = 200, hardening_modulus = 300 /
&tool name = 'upper', shape = 'plane', point = 0, 0, 30, normal = 0, 0, -1, motion = 'press' /
&tool name = 'lower', shape = 'plane', point = 0, 0, 0, normal = 0, 0, 1 /
&motion name = 'press', velocity = 0, 0, -30 /
&friction name = 'dry', kind = 'coulomb_tresca', coefficient = 0.2 /
&contact name = 'top', slave = 'billet', master = 'upper', friction = 'dry' /
&contact name = 'bottom', slave = 'billet', master = 'lower', friction = 'dry' /
&step duration = {end}, increments = {increments} /
&output every = {every} /
{solver}
"""


def make_mesh(context, name):
    """NAME.msh of the size called so."""
    size = SIZES[name]
    geometry = swage_mesh_writer.cylinder_geometry(10.0, 30.0, size)
    geometry += f'Mesh.MeshSizeMin = {size};\nMesh.MeshSizeMax = {size};\nMesh.Algorithm3D = 1;\n'
    return context.make_mesh(geometry, 3, name)


def text(mesh, reduction, solver='', every=5):
    """Input file of the upsetting to a reduction of height; `solver`: keys of &solver."""
    return CASE.format(mesh=mesh, end=reduction, increments=round(100 * reduction), every=every,
                       solver=f'&solver {solver} /' if solver else '')
