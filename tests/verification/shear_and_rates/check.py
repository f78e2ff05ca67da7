"""Simple shear (elastic, perfectly plastic), rates and relaxation in tension: closed forms.

Shear. One square of two triangles, all nodes prescribed. The Jaumann rate gives s12 = G sin(g),
s11 = -s22 = G (1 - cos g) for the elastic law; errors by G. The update is of order 2: slope 2 +-
0.1. At dg = 0.01 the error, 7.4e-6 at g = 2 in an independent program, stays below 1e-5; it grows
with g (the spin of a step is right but for dg^2/24), so that at pi, 1.25e-5, the same limit is for
dg = 0.005. In perfect plasticity the end is s11 = k^2/G, s12 = k sqrt(1 - k^2/G^2), k = Y/sqrt(3):
0.16667 and 115.46993 for Y = 200, G = 80000. The yield condition fixes s12: 1e-6. s11 is what is
left of the last steps' rotation; the return is that of the end of the step: order 1, and the limit
by Richardson extrapolation.

Rates. A bar at constant rate, small strain, drawn until nothing changes: the stress is a root of
the law, so 1e-6 is the tolerance of Newton. The table in MPa for K = 100, m = 0.2, R = 50 (0 in
the last two columns):

  rate   chenot_eq3   perzyna   chenot_eq3, R = 0   norton_hoff
  0.01    86.3086     89.8107        43.1736          76.9614
  0.1    110.6751    113.0957        68.4255         121.9755
  1      150.0000    150.0000       108.4472         193.3182

Relaxation. perzyna with m = 1 from 200 MPa at constant length: R + 150 exp(-E t/K), exact; order 1
of a rate that counts at the end of the step, and the limit by Richardson extrapolation.
"""
import math

SHEAR = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'square.msh' /
&body name = 'square' material = 'metal' group = 'BODY' /
&material name = 'metal' {law} young = 208000 poisson = 0.3 /
{flow_stress}
&boundary name = 'bottom' kind = 'fixed' group = 'BOTTOM' /
&boundary name = 'top' kind = 'displacement' group = 'TOP' displacement = {shear}, 0, 0
  time = 0, 1 factor = 0, 1 /
&step duration = 1 increments = {steps} /
&solver tolerance = 1e-10 pressure_tolerance = 1e-10 /
&output every = {steps} fields = 'stress' double_precision = .true. /
"""
MODULUS = 80000.0

BAR = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' geometry = 'fixed' /
&mesh file = 'bar.msh' /
&body name = 'bar' material = 'metal' group = 'BODY' /
&material name = 'metal' {law} /
&boundary name = 'bottom' kind = 'symmetry' group = 'BOTTOM' /
&boundary name = 'top' kind = 'displacement' group = 'TOP' components = 'y'
  displacement = 0, {strain}, 0 time = {time} factor = {factor} /
{steps}
&solver tolerance = 1e-10 pressure_tolerance = 1e-10 /
&output fields = 'displacement' /
"""
ELASTIC = 'young = 200000 poisson = 0.3'


def run(context):
    context.rectangle('square', 1, 1)
    context.rectangle('bar', 1, 1)
    yield from elastic_shear(context)
    yield from plastic_shear(context)
    yield from rates(context)
    yield from relaxation(context)


def elastic_shear(context):
    for end, title in ((1.0, '1'), (2.0, '2'), (math.pi, 'pi')):
        increments, errors = [0.02, 0.01, 0.005], []
        for increment in increments:
            steps = round(end / increment)
            stress = shear(context, "law = 'elastic'", '', end, steps)
            errors.append(max(abs(stress[3] / MODULUS - math.sin(end)),
                              abs(stress[0] / MODULUS - 1 + math.cos(end)),
                              abs(stress[1] / MODULUS + 1 - math.cos(end))))
        judged = 1 if end <= 2 else 2
        yield context.zero(f'elastic shear to {title}, dg {increments[judged]}: error by G',
                           errors[judged], 1e-5)
        yield context.order(f'elastic shear to {title}: order, dg 0.02 to 0.01', increments[:2],
                            errors[:2], 2.0, 0.1, two_sided=True)
        yield context.order(f'elastic shear to {title}: order, dg 0.01 to 0.005', increments[1:],
                            errors[1:], 2.0, 0.1, two_sided=True)


def plastic_shear(context):
    yield_shear = 200 / math.sqrt(3)
    counts, found = (250, 500, 1000), []
    for steps in counts:
        found.append(shear(context, "law = 'j2' flow_stress = 'perfect'", "&flow_stress name = "
                           "'perfect' kind = 'linear' yield_stress = 200 /", 0.05, steps))
    limit = yield_shear**2 / MODULUS
    yield context.row('plastic shear: s12', found[-1][3],
                      yield_shear * math.sqrt(1 - (yield_shear / MODULUS)**2), 1e-6)
    yield context.row('plastic shear: s11, dg to 0',
                      extrapolated([stress[0] for stress in found]), limit, 1e-4)
    yield context.order('plastic shear: order of s11', [1 / n for n in counts],
                        [abs(stress[0] - limit) for stress in found], 1.0, 0.05)


def extrapolated(values):
    """Richardson's limit of values at steps halved each time, errors in powers of the step."""
    values, power = list(values), 1
    while len(values) > 1:
        values = [fine + (fine - coarse) / (2**power - 1)
                  for coarse, fine in zip(values, values[1:])]
        power += 1
    return values[0]


def shear(context, law, flow_stress, end, steps):
    """Stress of a cell: 11, 22, 33, 12, ..."""
    done = context.run_swage(SHEAR.format(law=law, flow_stress=flow_stress, shear=repr(end),
                                          steps=steps), name=f'shear_{end:.2f}_{steps}')
    return done.results().step(-1).cell_fields['stress'][0]


def rates(context):
    cases = (('chenot_eq3', 50), ('perzyna', 50), ('chenot_eq3', 0), ('norton_hoff', None))
    for rate in (0.01, 0.1, 1.0):
        for law, threshold in cases:
            text = f"law = '{law}' consistency = 100 rate_sensitivity = 0.2 "
            if threshold is not None:
                text += f'{ELASTIC} threshold = {threshold}'
            duration = 0.01 / rate
            history = draw(context, f'rate_{rate}_{law}_{threshold}', text, 0.01,
                           ((0, 0), (duration, 1)), [(duration, 50)])
            yield context.row(f'rate {rate}, {law}' + (', R = 0' if threshold == 0 else ''),
                              history['stress'][-1], steady_stress(law, rate, threshold), 1e-6)


def steady_stress(law, rate, threshold):
    if law == 'perzyna':
        return threshold + 100 * rate**0.2
    if law == 'norton_hoff':
        return math.sqrt(3) * 100 * (math.sqrt(3) * rate)**0.2
    low, high = float(threshold), 1000.0
    while high - low > 1e-12 * high:
        middle = (low + high) / 2
        if 2 / 3 * middle / 100 * ((middle - threshold) / 100)**4 < rate:
            low = middle
        else:
            high = middle
    return low


def relaxation(context):
    """K/E = 0.5 s; loaded within 1e-8 s, which loses 1e-8 of the stress."""
    ends, counts = [], (25, 50, 100, 200)
    for count in counts:
        history = draw(context, f'relaxation_{count}',
                       f"law = 'perzyna' {ELASTIC} consistency = 1e5 rate_sensitivity = 1 "
                       'threshold = 50', 0.001, ((0, 0), (1e-8, 1), (2, 1)),
                       [(1e-8, 1), (0.5, count)])
        ends.append(history['stress'][-1])
    exact = 50 + 150 * math.exp(-1)
    yield context.order('relaxation: order in time', [1 / n for n in counts],
                        [abs(end - exact) for end in ends], 1.0, 0.05)
    yield context.row('relaxation after K/E, dt to 0', extrapolated(ends), exact, 1e-6)


def draw(context, name, law, strain, table, steps):
    """History of a bar of unit radius and length, with a column `stress`."""
    history = context.run_swage(BAR.format(
        law=law, strain=strain, time=', '.join(repr(time) for time, _ in table),
        factor=', '.join(repr(factor) for _, factor in table),
        steps='\n'.join(f'&step duration = {duration!r} increments = {count} /'
                        for duration, count in steps)), name=name).history
    history['stress'] = [force / math.pi for force in history['reaction_top_y']]
    return history
