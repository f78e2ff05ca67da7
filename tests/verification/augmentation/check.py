"""Multipliers of contact between bodies: what they cost, and that the penalty has no part in them.

A steel punch with a rounded nose, radius 8, is pressed by 0.2 mm into a block of aluminium that
yields, in 24 increments: the contact grows from a point to some twelve nodes. Half of it is computed,
in plane strain, without friction and with Coulomb's. With penalties of 1, 10 and 100 E/h the
augmented Lagrangian must bring the penetration below 1e-4 of a cell, Lagrange multipliers below 1e-8,
for at most so many Newton iterations more than the plain penalty takes, and with forces that agree.
(A penalty of more than 10 stiffnesses of cells is taken for 10 where multipliers are unknowns.)
On three ranks the history is that of one; a run that goes on from the middle ends with the same bits.
"""
import swage_mesh_writer
import swage_process

CASE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'punch.msh' /
&body name = 'block' material = 'aluminium' group = 'BLOCK_BODY' /
&body name = 'punch' material = 'steel' group = 'PUNCH_BODY' /
&material name = 'steel' law = 'elastic' young = 210000 poisson = 0.3 /
&material name = 'aluminium' law = 'j2' young = 70000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 150 hardening_modulus = 500 /
&boundary name = 'base' kind = 'fixed' group = 'BLOCK_BOTTOM' components = 'y' /
&boundary name = 'middle_of_block' kind = 'symmetry' group = 'BLOCK_LEFT' /
&boundary name = 'middle_of_punch' kind = 'symmetry' group = 'PUNCH_LEFT' /
&boundary name = 'press' kind = 'displacement' group = 'PUNCH_TOP' displacement = 0, -0.2, 0
  time = 0, 1 factor = 0, 1 /
&friction name = 'dry' kind = 'coulomb' coefficient = 0.15 method = 'return_mapping' /
&contact name = 'nose' slave = 'PUNCH_BOTTOM' master = 'BLOCK_TOP' friction = '{friction}'
  enforcement = '{enforcement}' penalty_factor = {factor} /
&step duration = 1 increments = 24 /
&solver {solver} /
&output double_precision = .true. every = 24 fields = 'displacement', 'contact_pressure' /
&restart {restart} /
"""
RADIUS = 8.0
# 3G/h of a cell by E/h.
STIFFNESS = 3 / (2 * 1.3)
PENALTIES = (1, 10, 100)
# More Newton iterations than the penalty alone, by its own.
MORE_ITERATIONS = {1: 1.5, 10: 0.5, 100: 0.2}
# Of the penetration by the cell.
LIMITS = {'augmented_lagrangian': 1e-4, 'lagrange': 1e-8}
EXACT = 'tolerance = 1e-10 pressure_tolerance = 1e-9 maximum_iterations = 40'


def run(context):
    context.bodies('punch', {'BLOCK': block(20, 10), 'PUNCH': punch(14, 8)})
    for friction in ('none',) if context.quick else ('none', 'dry'):
        forces = {}
        for penalty in PENALTIES:
            plain = history(context, 'penalty', penalty, friction)
            for enforcement, limit in LIMITS.items():
                title = f'friction {friction}, {enforcement}, {penalty} E/h'
                found = history(context, enforcement, penalty, friction)
                yield context.below(f'{title}: penetration by the cell', max(
                    abs(value) for value in found['penetration_by_cell_nose']), limit)
                yield context.below(f'{title}: iterations beyond the penalty\'s', sum(
                    found['iterations']) / sum(plain['iterations']) - 1, MORE_ITERATIONS[penalty])
                forces[title] = found['reaction_press_y'][-1]
        reference = forces[f'friction {friction}, lagrange, 10 E/h']
        for title, force in forces.items():
            yield context.row(f'{title}: force', force, reference, 5e-4)

    text = case('lagrange', 10, 'dry', solver=EXACT)
    whole = context.run_swage(text, name='whole')
    ranks = context.run_swage(text, name='ranks', ranks=3)
    yield context.zero('3 ranks: history', swage_process.deviation(ranks.history, whole.history), 1e-8)
    swage_process.write_case(context, 'part', case(
        'lagrange', 10, 'dry', solver=EXACT, restart='every = 13'))
    swage_process.run(context, 'part')
    swage_process.run(context, 'part', ['--restart'])
    yield context.zero('from the middle of a step of contact: results that differ in a bit', len(
        swage_process.differences(context.folder / 'part', context.folder / 'whole')), 0)


def case(enforcement, penalty, friction, **changes):
    return CASE.format(**{'solver': '', 'restart': '', **changes}, enforcement=enforcement,
                       friction=friction, factor=penalty / STIFFNESS)


def history(context, enforcement, penalty, friction):
    return context.run_swage(case(enforcement, penalty, friction),
                             name=f'{enforcement}_{penalty}_{friction}').history


def block(n, m):
    """Finer towards the middle and the top."""
    return swage_mesh_writer.rectangle_mesh(
        n, m, lambda x, y: (12 * x**1.4, -8 * (1 - y)**1.3))


def punch(n, m):
    def place(x, y):
        along = 6 * x**1.2
        nose = RADIUS - (RADIUS**2 - along**2)**0.5
        return along, nose + (10 - nose) * y**1.2
    return swage_mesh_writer.rectangle_mesh(n, m, place)
