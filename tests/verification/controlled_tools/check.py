"""Tools whose position follows from forces: force, torque, spring, free, and no body in the way.

Billet: a plane presses a cylinder of steel with a force that rises in time; then a plane that is
moved to the same places in the same increments needs the same forces (1e-6: the tolerance of Newton
is 1e-9, the force hardens slowly with the stroke). The force balances in every increment, the
iterations converge quadratically, and ranks do not matter.

Spring: a block of stiffness E A / h (Poisson's ratio 0) and a spring share a displacement d of 0.01
mm in series: k (d - u) = E A ln(h / (h - u)), with u the share of the block, to the square of the
strain of an increment. The contact is an augmented Lagrangian, which has no compliance of its own.

Cushion: the same billet between a press and a die on a spring, pressed and let go, which is the
example of the user's guide: both tools carry the force, in every increment, and the spring gives
way by it.

Torsion: a bar between two plates that it sticks to, one of which is turned by a torque, then by the
angle that came out: the same torque. A torsion spring as stiff as the bar, turned by that angle,
leaves half of the torque, to the square of the angle of 1.4e-3.

Roll: a strip that is pulled past a free roll, pressed by a force, turns it: no torque remains, and
the surface of the roll keeps up with the strip but for the creep of regularised friction, far below
1 % of the way. A plate in place of the roll, free to move along the strip, rides on it without any
friction. On 2 and 3 ranks it goes the same way, to 1e-8 at a Newton tolerance of 1e-8, and a
run that was saved in the middle and goes on ends in the same bits: the coordinates of tools and
their rates are in the restart file.

A force that drives a tool away from the bodies ends the run with exit code 4 and says so.
"""
import math
import re

import swage_mesh_writer
from swage_process import Fault, differences, run as run_case, write_case

STEEL = """
&material name = 'steel' law = 'j2' young = 200000 poisson = 0.3 flow_stress = 'linear' /
&flow_stress name = 'linear' kind = 'linear' yield_stress = 200 hardening_modulus = 300 /
"""

BILLET = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' /
&mesh file = 'billet.msh' /
&body name = 'billet' material = 'steel' group = 'BODY' /
&boundary name = 'middle' kind = 'symmetry' group = 'BOTTOM' /
&tool name = 'upper' shape = 'plane' point = 0, {top}, 0 normal = 0, -1, 0 {drive} /
{moved}
&friction name = 'dry' kind = 'coulomb_tresca' coefficient = 0.2 regularisation_velocity = 0.01 /
&contact name = 'top' slave = 'billet' master = 'upper' friction = 'dry' /
&step duration = 1 increments = 20 /
&solver tolerance = 1e-9 pressure_tolerance = 1e-9 linear_solver = 'mumps' /
""" + STEEL

CUSHION = """
&job units = 'mm-tonne-s' dimension = 'axisymmetric' /
&mesh file = 'billet.msh' /
&body name = 'billet' material = 'steel' group = 'BODY' /
&tool name = 'upper' shape = 'plane' point = 0, 15, 0 normal = 0, -1, 0 controls = 'press' /
&tool name = 'cushion' shape = 'plane' point = 0, 0, 0 normal = 0, 1, 0 controls = 'spring' /
&control name = 'press' kind = 'force' direction = 0, -1, 0
  time = 0, 1, 1.2 force = 0, 1.5e5, 0 /
&control name = 'spring' kind = 'spring' direction = 0, 1, 0 stiffness = 1.0e5 /
&friction name = 'dry' kind = 'coulomb_tresca' coefficient = 0.1 regularisation_velocity = 0.05 /
&contact name = 'top' slave = 'billet' master = 'upper' friction = 'dry' /
&contact name = 'bottom' slave = 'billet' master = 'cushion' friction = 'dry' /
&step duration = 1 increments = 50 /
&step duration = 0.19 increments = 10 /
""" + STEEL

BLOCK = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'block.msh' /
&body name = 'block' material = 'stiff' group = 'BODY' /
&material name = 'stiff' law = 'elastic' young = 200000 poisson = 0 /
&boundary name = 'ground' kind = 'fixed' group = 'ZMIN' /
&tool name = 'punch' shape = 'plane' point = 0, 0, 10 normal = 0, 0, -1 motion = 'down'
  controls = 'spring' /
&motion name = 'down' velocity = 0, 0, -0.01 /
&control name = 'spring' kind = 'spring' direction = 0, 0, 1 stiffness = {stiffness} /
&contact name = 'top' slave = 'ZMAX' master = 'punch' enforcement = 'augmented_lagrangian'
  penetration_tolerance = 1e-9 multiplier_tolerance = 1e-7 /
&step duration = 1 increments = 2 /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
"""

BAR = """
&job units = 'mm-tonne-s' dimension = '3d' /
&mesh file = 'bar.msh' /
&body name = 'bar' material = 'stiff' group = 'BODY' /
&material name = 'stiff' law = 'elastic' young = 200000 poisson = 0.3 /
&boundary name = 'ground' kind = 'fixed' group = 'ZMIN' /
&tool name = 'head' shape = 'plane' point = 0, 0, 30 normal = 0, 0, -1 {drive} /
{moved}
&friction name = 'weld' kind = 'sticking' /
&contact name = 'top' slave = 'ZMAX' master = 'head' friction = 'weld' separation = .false. /
&step duration = 1 increments = 2 /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
"""

STRIP = """
&job units = 'mm-tonne-s' dimension = 'plane_strain' /
&mesh file = 'strip.msh' /
&body name = 'strip' material = 'stiff' group = 'BODY' /
&material name = 'stiff' law = 'elastic' young = 200000 poisson = 0.3 /
&boundary name = 'pull' kind = 'displacement' group = 'BOTTOM' displacement = 2, 0
  time = 0.1, 0.3 factor = 0, 1 /
&control name = 'press' kind = 'force' direction = 0, -1, 0 time = 0, 0.1 force = 0, 500 /
{tool}
&friction name = 'dry' kind = 'coulomb' coefficient = 0.3 regularisation_velocity = 0.1 /
&contact name = 'top' slave = 'TOP' master = 'tool' friction = 'dry' /
&step duration = 0.1 increments = 5 /
&step duration = 0.2 increments = 40 /
&solver tolerance = 1e-8 pressure_tolerance = 1e-8 /
&output double_precision = .true. every = 15 /
{restart}
"""

ROLL = """
&tool name = 'tool' shape = 'cylinder' axis_point = 0, 25, 0 radius = 20
  controls = 'press', 'bearing' /
&control name = 'bearing' kind = 'free_rotation' axis_point = 0, 25, 0 /
"""

PLATE = """
&tool name = 'tool' shape = 'plane' point = 0, 5, 0 normal = 0, -1, 0 controls = 'press', 'slide' /
&control name = 'slide' kind = 'free' direction = 1, 0, 0 /
"""


def run(context):
    yield from billet(context)
    yield from cushion(context)
    yield from spring(context)
    yield from torsion(context)
    yield from roll(context)


def billet(context):
    context.rectangle('billet', 8, 12, lambda x, y: (10 * x, 15 * y))
    press = ("&control name = 'press' kind = 'force' direction = 0, -1, 0 "
             "time = 0, 1 force = 0, 150000 /")
    forced = context.run_swage(BILLET.format(top=15.5, drive="controls = 'press'", moved=press),
                               name='forced')
    history = forced.history
    force, place = history['force_upper_y'], history['position_upper_y']
    worst = max(abs(value / (150000 * t) - 1)
                for t, value in zip(history['time'][1:], force[1:]))
    yield context.row('billet: force in all increments', worst, 0, 1e-8)
    yield context.below('billet: C of e(k+1) = C e(k)^2', quadratic_factor(forced), 100)

    # The tool and the multipliers of its nodes follow each other
    text = BILLET.format(top=15.5, drive="controls = 'press'", moved=press)
    closed = context.run_swage(text.replace(
        "master = 'upper'", "master = 'upper' enforcement = 'lagrange'"), name='closed')
    worst = max(abs(value / (150000 * t) - 1) for t, value in zip(
        closed.history['time'][1:], closed.history['force_upper_y'][1:]))
    yield context.row('billet, multipliers: force in all increments', worst, 0, 1e-8)
    yield context.below('billet, multipliers: penetration by the cell', max(
        abs(value) for value in closed.history['penetration_by_cell_top']), 1e-8)
    yield context.below('billet, multipliers: iterations an increment',
                        sum(closed.history['iterations']) / 20, 8)

    times = ', '.join(repr(t) for t in history['time'])
    strokes = ', '.join(repr(-y) for y in place)
    follow = (f"&motion name = 'follow' direction = 0, -1, 0\n  time = {times}\n"
              f"  displacement = {strokes} /")
    driven = context.run_swage(BILLET.format(top=15.5, drive="motion = 'follow'", moved=follow),
                               name='driven').history['force_upper_y']
    yield context.row('billet: the same stroke needs the same force', driven[-1], force[-1], 1e-3)

    ranks = context.run_swage(BILLET.format(top=15.5, drive="controls = 'press'", moved=press),
                              name='forced_ranks', ranks=3).history['position_upper_y'][-1]
    yield context.row('billet: stroke on 3 ranks', ranks, place[-1], 1e-7)

    away = press.replace('0, -1, 0', '0, 1, 0')
    done = context.run_swage(BILLET.format(top=15.5, drive="controls = 'press'", moved=away)
                             .replace('increments = 20', 'increments = 20 maximum_cuts = 1'),
                             name='away', expect_exit=4)
    yield context.row('billet: a force that leads away is told',
                      'along control press and touches nothing' in done.output, 1, 0)


def cushion(context):
    history = context.run_swage(CUSHION, name='cushion').history
    worst = 0.0
    for time, upper, lower, place in zip(*(history[name][1:] for name in (
            'time', 'force_upper_y', 'force_cushion_y', 'position_cushion_y'))):
        force = 1.5e5 * min(time, (1.2 - time) / 0.2)
        worst = max(worst, *(abs(value / force - 1) for value in (upper, -lower, -1e5 * place)))
    yield context.row('cushion: force on both tools and of the spring', worst, 0, 1e-5)
    yield context.below('cushion: iterations an increment',
                        sum(history['iterations']) / len(history['time'][1:]), 4)


def quadratic_factor(done):
    """Largest C in the increments that flow, after the first correction, which imposes the load,
    and down to a tenth of the tolerance of 1e-9: the linear solver is not more accurate than is
    wanted."""
    factors = []
    for line in done.path('.log').read_text(encoding='utf-8').splitlines():
        if not re.match(r'increment (1[3-9]|20),', line):
            continue
        errors = [float(pair.split('/')[0]) for pair in line.split('errors ')[1].split()][1:]
        factors += [after / before**2 for before, after in zip(errors, errors[1:])
                    if after > 1e-10 and before < 0.1]
    return max(factors)


def spring(context):
    context.box('block', 2, 2, 2, lambda x, y, z: (10 * x, 10 * y, 10 * z))
    for stiffness in (1e4, 1e6, 1e8):
        history = context.run_swage(BLOCK.format(stiffness=stiffness),
                                    name=f'spring_{stiffness:.0e}').history
        force = in_series(stiffness)
        yield context.row(f'spring of {stiffness:.0e} N/mm: force [N]',
                          history['force_punch_z'][-1], force, 1e-6)


def in_series(stiffness):
    """Force of a spring and a block of 10 x 10 x 10 mm that share 0.01 mm: k (d - u) for the u of
    E A ln(h / (h - u))."""
    modulus, height, way = 200000 * 100, 10.0, 0.01
    low, high = 0.0, way
    for _ in range(100):
        u = (low + high) / 2
        if stiffness * (way - u) > -modulus * math.log1p(-u / height):
            low = u
        else:
            high = u
    return -modulus * math.log1p(-u / height)


def torsion(context):
    context.box('bar', 3, 3, 6, lambda x, y, z: (10 * x - 5, 10 * y - 5, 30 * z))
    turn = ("&control name = 'turn' kind = 'torque' axis_point = 0, 0, 0 axis_direction = 0, 0, 1 "
            "torque = 10000 /")
    history = context.run_swage(BAR.format(drive="controls = 'turn'", moved=turn),
                                name='torque').history
    angle = history['angle_head'][-1]
    yield context.row('torsion: torque [N mm]', -history['torque_head_z'][-1], 10000, 1e-7)
    # Two increments: the torque is there from the first one on
    first = history['angle_head'][1]
    follow = ("&motion name = 'follow' axis_point = 0, 0, 0 axis_direction = 0, 0, 1 "
              f"time = 0, 0.5, 1 angle = 0, {first!r}, {angle!r} /")
    driven = context.run_swage(BAR.format(drive="motion = 'follow'", moved=follow),
                               name='angle').history
    yield context.row('torsion: the same angle needs the same torque',
                      -driven['torque_head_z'][-1], 10000, 1e-7)
    held = follow + (" &control name = 'turn' kind = 'torsion_spring' "
                     f"stiffness = {10000 / angle!r} /")
    shared = context.run_swage(BAR.format(drive="motion = 'follow' controls = 'turn'", moved=held),
                               name='torsion_spring').history
    yield context.row('torsion spring as stiff as the bar: torque [N mm]',
                      -shared['torque_head_z'][-1], 5000, 1e-5)


def roll(context):
    swage_mesh_writer.write_rectangle(context.folder / 'strip.msh', 40, 5,
                                      lambda x, y: (20 * x - 12, 5 * y))
    history = context.run_swage(STRIP.format(tool=ROLL, restart=''), name='roll').history
    torque = max(abs(value) for value in history['torque_tool_z'])
    pressed = 20 * 0.3 * abs(history['force_tool_y'][-1])
    yield context.row('roll: torque by that of full friction', torque / pressed, 0, 1e-5)
    yield context.row('roll: way of its surface by that of the strip [mm]',
                      20 * history['angle_tool'][-1], 2.0, 1e-2)

    rider = context.run_swage(STRIP.format(tool=PLATE, restart=''), name='plate').history
    rub = max(abs(value) for value in rider['force_tool_x']) / (0.3 * 500)
    yield context.row('plate: friction by that of sliding', rub, 0, 1e-5)
    yield context.row('plate: way by that of the strip [mm]', rider['position_tool_x'][-1], 2.0,
                      1e-5)

    for ranks in (2, 3):
        other = context.run_swage(STRIP.format(tool=ROLL, restart=''), ranks=ranks,
                                  name=f'roll_{ranks}')
        columns = ('force_tool_x', 'force_tool_y', 'position_tool_y', 'angle_tool')
        worst = max(abs(a - b) / max(abs(b) for b in history[name]) for name in columns
                    for a, b in zip(other.history[name], history[name]))
        yield context.zero(f'roll: force, place and angle on {ranks} ranks', worst, 1e-8)
    write_case(context, 'part', STRIP.format(tool=ROLL, restart='&restart every = 29 /'))
    for options in ([], ['--restart']):
        code, output = run_case(context, 'part', options)
        if code != 0:
            raise Fault(f'part: exit code {code}\n{output[-2000:]}')
    yield context.zero('roll: results that differ in a bit after a restart',
                       len(differences(context.folder / 'part', context.folder / 'roll')), 0)
