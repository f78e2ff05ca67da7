"""Contact patch test: uniform pressure through non-matching meshes, by every formulation.

Two elastic blocks of E = 100, nu = 0.3, one on the other, pressed by 1 on top, free to spread; small
strain. The stress is uniform, -1, in both blocks: what differs is the error of the formulation
(Taylor and Papadopoulos, 1991). Penalties are 1, 100 and 1e4 times E/h; the factor of `&contact`
counts in the stiffness 3G/h of cells.

Integrals on the pieces that facets have in common are exact, whatever the penalty. On whole facets
of the slave they are wrong by a percent, less with more points. Nodal contact fails by some per cent:
that it does, and by how much, is checked too. The force goes through whole but for `half_pass`,
which has no reactions.
"""
import swage_mesh_writer

CASE = """
&job units = 'mm-tonne-s' dimension = '{dimension}' geometry = 'fixed' /
&mesh file = '{mesh}.msh' /
&body name = 'lower' material = 'soft' group = 'LOWER_BODY' /
&body name = 'upper' material = 'soft' group = 'UPPER_BODY' /
&material name = 'soft' law = 'elastic' young = 100 poisson = 0.3 /
{supports}
&boundary name = 'load' kind = 'pressure' group = 'UPPER_{top}' pressure = 1 /
&contact name = 'middle' slave = 'UPPER_{bottom}' master = 'LOWER_{top}' {keys}
  penalty_factor = {factor} /
&step duration = 1 increments = 1 /
&output double_precision = .true. fields = 'stress' /
&solver tolerance = {tolerance} pressure_tolerance = {tolerance} /
"""
PLANE = {'dimension': 'plane_strain', 'top': 'TOP', 'bottom': 'BOTTOM', 'sides': ['LEFT']}
SPACE = {'dimension': '3d', 'top': 'ZMAX', 'bottom': 'ZMIN', 'sides': ['XMIN', 'YMIN']}
# Nodes of the lower block's top, 2D.
LOWER = (0, .13, .31, .47, .62, .83, 1)
PENALTIES = (1, 100, 1e4)
# 3G/h of a cell by E/h.
STIFFNESS = 3 / (2 * 1.3)


def run(context):
    lower = swage_mesh_writer.rectangle_mesh(
        len(LOWER) - 1, 4, lambda x, y: (LOWER[round(x * (len(LOWER) - 1))], 0.5 * y))
    upper = swage_mesh_writer.rectangle_mesh(9, 4, lambda x, y: (x, 0.5 + 0.5 * y))
    context.bodies('plane', {'LOWER': lower, 'UPPER': upper})
    context.bodies('space', {
        'LOWER': swage_mesh_writer.box_mesh(4, 4, 2, lambda x, y, z: (x, y, 0.5 * z)),
        'UPPER': swage_mesh_writer.box_mesh(6, 6, 2, lambda x, y, z: (x, y, 0.5 + 0.5 * z))})

    exact = "formulation = 'quasi_symmetric'"
    for shape, mesh in ((PLANE, 'plane'), (SPACE, 'space')):
        title = '2D' if mesh == 'plane' else '3D'
        for penalty in PENALTIES:
            error = patch(context, shape, mesh, exact, penalty)
            yield context.zero(f'{title}, l2, clipped, penalty {penalty:g} E/h', error, 1e-10)
            error = patch(context, shape, mesh, "formulation = 'master_slave'", penalty)
            yield context.above(f'{title}, master/slave at nodes, penalty {penalty:g} E/h', error,
                                1e-3)
            yield context.below(f'{title}, master/slave at nodes, penalty {penalty:g} E/h', error,
                                0.2)

    yield context.zero('2D, lumped, penalty 100 E/h',
                       patch(context, PLANE, 'plane', exact + " projection = 'lumped'", 100), 1e-10)
    errors = [patch(context, PLANE, 'plane', f"{exact} quadrature = 'slave' quadrature_points = {n}",
                    100) for n in (2, 3, 5)]
    for n, error in zip((2, 3, 5), errors):
        yield context.zero(f'2D, l2 on facets of the slave, {n} points', error, 0.02)
    yield context.below('2D, l2 on facets of the slave, 5 points against 2', errors[2], errors[0])
    for name, keys in (('one point', "formulation = 'master_slave' variant = 'one_point'"),
                       ('full', "formulation = 'master_slave' variant = 'full'"),
                       ('symmetric', "formulation = 'symmetric'")):
        error = patch(context, PLANE, 'plane', keys, 100)
        yield context.below(f'2D, {name}, penalty 100 E/h', error, 0.2)


def patch(context, shape, mesh, keys, penalty):
    """Largest error of the stress across the interface."""
    supports = [f"&boundary name = 'base' kind = 'symmetry' group = 'LOWER_{shape['bottom']}' /"]
    supports += [f"&boundary name = '{body}_{side}' kind = 'symmetry' group = '{body}_{side}' /"
                 for body in ('LOWER', 'UPPER') for side in shape['sides']]
    # Rounding grows with the penalty
    tolerance = 1e-11 if penalty < 1e3 else 1e-10
    done = context.run_swage(CASE.format(
        **{key: shape[key] for key in ('dimension', 'top', 'bottom')}, mesh=mesh, keys=keys,
        supports='\n'.join(supports), factor=penalty / STIFFNESS, tolerance=tolerance))
    across = 1 if mesh == 'plane' else 2
    stress = done.results().step(-1).cell_fields['stress']
    return float(abs(stress[:, across] + 1).max())
