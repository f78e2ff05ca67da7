"""Kinematic hardening: cyclic tension, large shear: closed forms.

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

Source of the latter: J. C. Nagtegaal and J. E. de Jong, Some aspects of nonisotropic work-hardening
in finite strain plasticity, in: Plasticity of Metals at Finite Strain, Stanford University (1982).
"""
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
YOUNG, KINEMATIC, ISOTROPIC, YIELD = 200000.0, 3000.0, 1000.0, 200.0


def run(context):
    context.rectangle('square', 1, 1)
    context.rectangle('bar', 1, 1)
    yield from cyclic_tension(context)
    yield from large_shear(context)


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
