"""Kinematic hardening and measured flow stress: closed forms.

Cyclic tension. A bar at small strain, drawn, pushed and drawn again: C = 3000, H = 1000 MPa, yield
stress 200. The answer is piecewise linear: E up to the yield surface, then E h / (E + h) with
h = C + H; after a turn the surface is as wide as H has made it, 2 (200 + H ep) from side to side
(Bauschinger). Stress, back stress and plastic strain at each turn, and the stress at which it yields
on the way back, where the two straight lines meet. Backward Euler is exact for linear hardening
along a line, so 1e-8 is the tolerance of Newton. Without the grad-div term, which takes the pressure
of the step before: it would add the yield stress times the volume strain of a step.

Large shear. One square of two triangles, all nodes prescribed, with the Jaumann rate. Without
elastic strain (E/C = 1e7 here, its share of the stress is less than 1e-6) the back stress is
a12 = C/3 sin(g), a11 = -a22 = C/3 (1 - cos(g)), and s12 is by Y/sqrt(3) more: past g = pi/2 the
stress falls again, and the sine is why this rate is not for kinematic hardening at large shear. The
update is of order 2: slope 2 +- 0.1, and at dg = 0.01 an error below 1e-5 C.

Source of that: J. C. Nagtegaal and J. E. de Jong, Some aspects of nonisotropic work-hardening
in finite strain plasticity, in: Plasticity of Metals at Finite Strain, Stanford University (1982).

Flow stress on a grid. The bar drawn at rates within, below and above those of the table, at
temperatures on and between its own: the stress is that of the table, interpolated here once more, at
the plastic strain and rate reached. 1e-8, the tolerance of Newton.

Relaxation. A flow stress A + B ln(rate) at constant length, E ep' = -s': from s0 it falls as
s0 - B ln(1 + E/B r0 t), with the rate r0 of s0. Order 1 of a rate that counts at the end of the step;
the limit by Richardson extrapolation.
"""
import bisect
import math

BAR = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' geometry = 'fixed' /
&mesh file = 'bar.msh' /
&body name = 'bar' material = 'metal' group = 'BODY' /
&material name = 'metal' law = 'j2' young = {young} poisson = 0.3 flow_stress = 'isotropic'
  kinematic_modulus = {kinematic} /
&flow_stress name = 'isotropic' kind = 'linear' yield_stress = 200 hardening_modulus = {isotropic} /
&boundary name = 'bottom' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'top' kind = 'displacement' group = 'TOP' components = 'y'
  displacement = 0, 1, 0 time = 0, 1, 2, 3 factor = 0, {first}, {second}, {third} /
&step duration = 3 increments = {steps} /
&solver tolerance = 1e-11 pressure_tolerance = 1e-11 grad_div = 0 /
&output every = {every} fields = 'stress', 'back_stress', 'equivalent_plastic_strain'
  double_precision = .true. /
"""

SHEAR = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'square.msh' /
&body name = 'square' material = 'metal' group = 'BODY' /
&material name = 'metal' law = 'j2' young = 1e7 poisson = 0.3 flow_stress = 'perfect'
  kinematic_modulus = 1 /
&flow_stress name = 'perfect' kind = 'linear' yield_stress = 0.3 /
&boundary name = 'bottom' kind = 'fixed' group = 'BOTTOM' /
&boundary name = 'top' kind = 'displacement' group = 'TOP' displacement = {shear}, 0, 0
  time = 0, 1 factor = 0, 1 /
&step duration = 1 increments = {steps} /
&solver tolerance = 1e-10 pressure_tolerance = 1e-10 /
&output every = {every} fields = 'stress', 'back_stress' double_precision = .true. /
"""
GRID = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' geometry = 'fixed' temperature = {temperature} /
&mesh file = 'bar.msh' /
&body name = 'bar' material = 'metal' group = 'BODY' /
&material name = 'metal' law = 'j2' young = {young} poisson = 0.3 flow_stress = 'measured' /
&flow_stress name = 'measured' kind = 'grid' file = '{file}' /
&boundary name = 'bottom' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'top' kind = 'displacement' group = 'TOP' components = 'y'
  displacement = 0, {strain!r}, 0 time = {time} factor = {factor} /
{steps}
&solver tolerance = 1e-11 pressure_tolerance = 1e-11 grad_div = 0 /
&output every = {every} fields = 'stress', 'equivalent_plastic_strain',
  'equivalent_plastic_strain_rate' double_precision = .true. /
"""
YOUNG, KINEMATIC, ISOTROPIC, YIELD = 200000.0, 3000.0, 1000.0, 200.0


def run(context):
    context.rectangle('square', 1, 1)
    context.rectangle('bar', 1, 1)
    yield from cyclic_tension(context)
    yield from large_shear(context)
    yield from grid_rates(context)
    yield from logarithmic_relaxation(context)


def cyclic_tension(context):
    turns, steps = (0.02, -0.01, 0.015), 120
    each = steps // 3
    done = context.run_swage(BAR.format(
        young=YOUNG, kinematic=KINEMATIC, isotropic=ISOTROPIC, steps=steps, every=each,
        first=turns[0], second=turns[1], third=turns[2]), name='cyclic')
    stress = [force / math.pi for force in done.history['reaction_top_y']]
    # The history may start with the time 0
    stress = stress[-steps:]
    strain_old, sign = 0.0, 1.0
    plastic = accumulated = 0.0
    for i, strain in enumerate(turns):
        title = f'cyclic tension, turn {i + 1}'
        radius = YIELD + ISOTROPIC * accumulated
        start = KINEMATIC * plastic + sign * radius
        increment = sign * (strain - start / YOUNG - plastic) * YOUNG / (
            YOUNG + KINEMATIC + ISOTROPIC)
        branch = [stress[i * each - 1] if i else 0.0] + stress[i * each:(i + 1) * each]
        delta = (strain - strain_old) / each
        slope = branch[-1] - branch[-2]
        # Straight lines through the ends of the branch, over the number of steps
        crossing = (branch[0] - branch[-1] + slope * each) / (slope - YOUNG * delta)
        yield context.row(f'{title}: yields at', branch[0] + YOUNG * delta * crossing, start, 1e-8)
        plastic, accumulated = plastic + sign * increment, accumulated + increment
        fields = done.results().step(i + 1).cell_fields
        yield context.row(f'{title}: stress', branch[-1], YOUNG * (strain - plastic), 1e-8)
        yield context.row(f'{title}: back stress', 1.5 * fields['back_stress'][0][1],
                          KINEMATIC * plastic, 1e-8)
        yield context.row(f'{title}: plastic strain', fields['equivalent_plastic_strain'][0],
                          accumulated, 1e-8)
        strain_old, sign = strain, -sign


def large_shear(context):
    end, increments, errors = 5.0, [0.02, 0.01, 0.005], []
    for increment in increments:
        steps = round(end / increment)
        done = context.run_swage(SHEAR.format(shear=end, steps=steps, every=steps // 5),
                                 name=f'shear_{steps}')
        worst = 0.0
        for i in range(1, 6):
            fields = done.results().step(i).cell_fields
            back, angle = fields['back_stress'][0], float(i)
            worst = max(worst, abs(back[3] - math.sin(angle) / 3),
                        abs(back[0] - (1 - math.cos(angle)) / 3), abs(back[0] + back[1]))
            if increment == 0.01:
                yield context.row(f'large shear {i}: s12', fields['stress'][0][3],
                                  0.3 / math.sqrt(3) + math.sin(angle) / 3, 1e-4)
        errors.append(worst)
    yield context.zero('large shear to 5, dg 0.01: error of the back stress by C', errors[1], 1e-5)
    yield context.order('large shear: order, dg 0.02 to 0.01', increments[:2], errors[:2], 2.0, 0.1,
                        two_sided=True)
    yield context.order('large shear: order, dg 0.01 to 0.005', increments[1:], errors[1:], 2.0,
                        0.1, two_sided=True)


def grid_rates(context):
    strains, rates, temperatures = (0.0, 0.05, 0.2), (0.01, 0.3, 50.0), (800.0, 950.0, 1200.0)
    table = {(e, r, t): (40 + 120 * e**0.4) * r**0.15 * math.exp(-(t - 800) / 300)
             for e in strains for r in rates for t in temperatures}
    lines = [f'{e!r},{r!r},{t!r},{stress!r}' for (e, r, t), stress in table.items()]
    (context.folder / 'grid.csv').write_text('\n'.join(['strain,rate,temperature,stress', *lines]),
                                             encoding='utf-8')

    def stress_at(e, r, t):
        """Linear in every direction, the logarithm of the rate taken."""
        sides = []
        for values, value in ((strains, e), ([math.log(rate) for rate in rates], math.log(r)),
                              (temperatures, t)):
            value = min(max(value, values[0]), values[-1])
            low = min(max(bisect.bisect_right(values, value) - 1, 0), len(values) - 2)
            share = (value - values[low]) / (values[low + 1] - values[low])
            sides.append(((low, 1 - share), (low + 1, share)))
        return sum(wi * wj * wk * table[strains[i], rates[j], temperatures[k]]
                   for i, wi in sides[0] for j, wj in sides[1] for k, wk in sides[2])

    for rate, temperature in ((1e-5, 800), (0.01, 1000), (1.0, 950), (20.0, 1133), (1e3, 1200)):
        duration = 0.1 / rate
        done = context.run_swage(GRID.format(
            temperature=temperature, young=100000, file='grid.csv', strain=0.1,
            time=f'0, {duration!r}', factor='0, 1', every=10,
            steps=f'&step duration = {duration!r} increments = 20 /'),
            name=f'grid_{rate}_{temperature}')
        for i in (1, 2):
            fields = done.results().step(i).cell_fields
            reached = fields['equivalent_plastic_strain'][0]
            flowing = fields['equivalent_plastic_strain_rate'][0]
            yield context.row(f'grid: strain {0.05 * i:g}, rate {rate:g}, {temperature} degC',
                              fields['stress'][0][1], stress_at(reached, flowing, temperature),
                              1e-8)


def logarithmic_relaxation(context):
    slope, low, base, start = 5.0, 1e-10, 50.0, 160.0
    (context.folder / 'logarithm.csv').write_text(
        'rate,strain,temperature,stress\n'
        f'{low!r},0,20,{base!r}\n100,0,20,{base + slope * math.log(100 / low)!r}\n',
        encoding='utf-8')
    ends, counts, hold = [], (50, 100, 200, 400), 5e-4
    for count in counts:
        done = context.run_swage(GRID.format(
            temperature=20, young=YOUNG, file='logarithm.csv', strain=start / YOUNG,
            time=f'0, 1e-10, {1 + hold!r}', factor='0, 1, 1', every=count + 1,
            steps='&step duration = 1e-10 increments = 1 /\n'
            f'&step duration = {hold!r} increments = {count} /'), name=f'relaxation_{count}')
        ends.append(done.history['reaction_top_y'][-1] / math.pi)
    rate = low * math.exp((start - base) / slope)
    exact = start - slope * math.log(1 + YOUNG / slope * rate * hold)
    yield context.order('logarithmic relaxation: order in time', [1 / n for n in counts],
                        [abs(end - exact) for end in ends], 1.0, 0.05)
    yield context.row('logarithmic relaxation, dt to 0', extrapolated(ends), exact, 1e-6)


def extrapolated(values):
    """Richardson's limit of values at steps halved each time, errors in powers of the step."""
    values, power = list(values), 1
    while len(values) > 1:
        values = [fine + (fine - coarse) / (2**power - 1)
                  for coarse, fine in zip(values, values[1:])]
        power += 1
    return values[0]
