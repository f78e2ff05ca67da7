"""A block dragged over another one: Coulomb friction between bodies, ranks, restart.

A plastic block is pressed on an elastic one by 0.3 mm, then dragged by 6 mm over its mesh, ten times
as long as it is fine. While it slides the forces are in the ratio of the coefficient; what one body
gets the other gives. Ranks share the conditions of contact: the history is that of one rank, 1e-8 at
a Newton tolerance of 1e-10. A run that goes on from the middle of sliding ends with the same bits.
"""
import swage_mesh_writer
import swage_process

CASE = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'blocks.msh' /
&body name = 'lower' material = 'steel' group = 'LOWER_BODY' /
&body name = 'upper' material = 'aluminium' group = 'UPPER_BODY' /
&material name = 'steel' law = 'elastic' young = 210000 poisson = 0.3 /
&material name = 'aluminium' law = 'j2' young = 70000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 100 hardening_modulus = 100 /
&boundary name = 'base' kind = 'fixed' group = 'LOWER_ZMIN' /
&boundary name = 'press' kind = 'displacement' group = 'UPPER_ZMAX' components = 'z'
  displacement = 0, 0, -0.3 time = 0, 0.2, 1 factor = 0, 1, 1 /
&boundary name = 'drag' kind = 'displacement' group = 'UPPER_ZMAX' components = 'x', 'y'
  displacement = 6, 0, 0 time = 0, 0.2, 1 factor = 0, 0, 1 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.2 method = 'return_mapping' /
&contact name = 'middle' slave = 'upper' master = 'lower' friction = 'dry' {keys} /
&step duration = 1 increments = 20 /
&solver tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 40 /
&output double_precision = .true. every = 5 fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
COEFFICIENT = 0.2


def run(context):
    context.bodies('blocks', {
        'LOWER': swage_mesh_writer.box_mesh(10, 4, 3, lambda x, y, z: (20 * x, 8 * y, 5 * z)),
        'UPPER': swage_mesh_writer.box_mesh(
            4, 3, 3, lambda x, y, z: (2 + 8 * x, 1 + 6 * y, 5 + 6 * z))})

    whole = context.run_swage(CASE.format(keys='', restart=''), name='whole').history
    for name, history in (('l2', whole),
                          ('master/slave', context.run_swage(CASE.format(
                              keys="formulation = 'master_slave'", restart=''),
                              name='nodal').history)):
        pull, weight = history['reaction_drag_x'][-1], -history['reaction_press_z'][-1]
        yield context.row(f'{name}: force along by force across', pull / weight, COEFFICIENT, 0.002)
        yield context.row(f'{name}: force on the base', -history['reaction_base_x'][-1], pull, 1e-8)
        yield context.row(f'{name}: weight on the base', history['reaction_base_z'][-1], weight, 1e-8)
    yield context.below('l2: largest penetration by the cell', max(
        whole['penetration_by_cell_middle']), 1e-3)

    ranks = context.run_swage(CASE.format(keys='', restart=''), name='ranks', ranks=3).history
    yield context.zero('3 ranks: history', swage_process.deviation(ranks, whole), 1e-8)
    swage_process.write_case(context, 'part', CASE.format(keys='', restart='every = 13'))
    swage_process.run(context, 'part')
    swage_process.run(context, 'part', ['--restart'])
    yield context.zero('from the middle of sliding: results that differ in a bit', len(
        swage_process.differences(context.folder / 'part', context.folder / 'whole')), 0)
