"""Cook's membrane, small strain, plane strain: regression, number of steps, convergence.

Corners (0, 0), (48, 44), (48, 60), (0, 44); left side clamped, a vertical force of 1 spread over
the right side, E = 1; here both are 10^5 times that, as steel in MPa. `geometry = 'fixed'`:
linear, so any number of steps must give the same.

Regression values of the corner (48, 60): the MINI element with cubic bubble and deviatoric split
(sigma = 2 G dev eps - p I) on n x n x 2 triangles cut along (i, j)-(i + 1, j + 1), computed by two
programs independent of Swage. They have seven digits: 1e-4 leaves no room for another element (the
Stokes form of the same one, 2 G eps - p I, gives 14.28862, 17.31797, 18.59839).

Converged value 19.42 +- 0.02, by Taylor-Hood elements up to n = 56, extrapolated. MINI is stiff in
bending: 18.73 at n = 32 is right for it. Its error must fall with n: between n = 16 and 32 at
least like h, the order of the energy norm of linear elements without the corner's singularity
being 2 for a displacement.
"""
REGRESSION = {8: 15.04333, 16: 17.66012, 32: 18.72596}
NEARLY_INCOMPRESSIBLE = 17.66282
CONVERGED = 19.42

CASE = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' geometry = 'fixed' /
&mesh file = 'cook_{n}.msh' /
&body name = 'membrane' material = 'rubber' group = 'BODY' /
&material name = 'rubber' law = 'elastic' young = 1e5 poisson = {poisson} /
&boundary name = 'wall' kind = 'fixed' group = 'LEFT' /
&boundary name = 'shear' kind = 'traction' group = 'RIGHT' traction = 0, 6250, 0
  time = 0, 1 factor = 0, 1 /
&step duration = 1 increments = {steps} /
&solver tolerance = 1e-10 pressure_tolerance = 1e-10 /
&output every = {steps} fields = 'displacement' double_precision = .true. /
"""


def run(context):
    for n in REGRESSION:
        context.rectangle(f'cook_{n}', n, n, place)
    error = {}
    for n, reference in REGRESSION.items():
        tip = corner(context, n, 0.5, 1)
        error[n] = abs(tip - CONVERGED)
        yield context.row(f'tip, nu 0.5, n {n}', tip, reference, 1e-4)
    yield context.row('tip, nu 0.4999, n 16', corner(context, 16, 0.4999, 1),
                      NEARLY_INCOMPRESSIBLE, 1e-4)

    # The bubble's stress has history: on the total pressure it would drift by 1.5 and 4 %. Only
    # round-off and the tolerance of Newton are left, far below 1e-6.
    for poisson in (0.5, 0.4999):
        one = corner(context, 16, poisson, 1)
        for steps in (10, 100):
            yield context.row(f'tip, nu {poisson}, n 16, {steps} steps against 1',
                              corner(context, 16, poisson, steps), one, 1e-6)

    yield context.order('order towards 19.42, n 16 to 32', (1 / 16, 1 / 32),
                        (error[16], error[32]), 1.0, 0.05)


def place(x, y):
    return 48 * x, 44 * x + y * (44 - 28 * x)


def corner(context, n, poisson, steps):
    """Vertical displacement of the corner (48, 60) at the end."""
    done = context.run_swage(CASE.format(n=n, poisson=poisson, steps=steps),
                             name=f'cook_{n}_{poisson}_{steps}')
    step = done.results().step(-1)
    moved = step.point_fields['displacement']
    # In the results points stand where they are, but for geometry = 'fixed'
    return next(u[1] for x, u in zip(step.points, moved)
                if abs(x[0] - 48) < 1e-3 and abs(x[1] - 60) < 1e-3)
