"""Ironing: a stiff half roller drawn along a soft foundation by every formulation (input/ironing).

Both bodies deform, their meshes do not match, mu = 0.3. There is no closed form; what must hold:

While all of the contact slides, from a stroke of 2 mm on, the force along by the force across is mu,
3 %: more than mu by some (a/R)^2, as the track wraps around the roller (a the half width, a/R =
0.19).

Ripple: what a parabola leaves of the force across, rms, by the mean; it is made by nodes of one
surface that pass those of the other. Flat facets of the roller make it larger, so do conditions at
nodes of both sides instead of projected ones. With the quasi-symmetric formulation the forces hardly
depend on which side is the slave; with conditions at nodes they do more.

The energy balance of all runs closes to 1e-3.
"""
import numpy

FRICTION = 0.3
SLIDES = 3.0
# The keys of the contact of each run; the first four are the quick ones.
RUNS = {
    'quasi-symmetric': "formulation = 'quasi_symmetric'",
    'quasi-symmetric, flat facets': "formulation = 'quasi_symmetric' smoothing = .false.",
    'quasi-symmetric, swapped': "formulation = 'quasi_symmetric'",
    'symmetric': "formulation = 'symmetric'",
    'master/slave': "formulation = 'master_slave'",
    'master/slave, swapped': "formulation = 'master_slave'",
    'master/slave, flat facets': "formulation = 'master_slave' smoothing = .false.",
    'quasi-symmetric, augmented': "enforcement = 'augmented_lagrangian'",
}


def run(context):
    source = context.root / 'input' / 'ironing'
    context.make_mesh((source / 'ironing.geo').read_text(encoding='utf-8'), 2, 'ironing')
    text = (source / 'ironing.nml').read_text(encoding='utf-8')
    curves, ripple, mean = {}, {}, {}
    for title, keys in list(RUNS.items())[:4 if context.quick else len(RUNS)]:
        words = {"formulation = 'quasi_symmetric'": keys,
                 '&output': '&solver tolerance = 1e-6 pressure_tolerance = 1e-6 /\n&output'}
        if not context.quick:
            words['increments = 100'] = 'increments = 200'
        if 'swapped' in title:
            words |= {"slave = 'track'": "slave = 'round'", "master = 'round'": "master = 'track'"}
        name = ''.join(letter if letter.isalpha() else '_' for letter in title)
        history = context.run_swage(replaced(text, words), name=name).history
        time = numpy.array(history['time'])
        along = numpy.array(history['reaction_draw_x'])
        across = -numpy.array(history['reaction_press_y'])
        curves[title] = time, along, across
        slides = time >= SLIDES
        yield context.row(f'{title}: force along by force across',
                          (along[slides] / across[slides]).mean(), FRICTION, 0.03)
        trend = numpy.polyval(numpy.polyfit(time[slides], across[slides], 2), time[slides])
        mean[title] = across[slides].mean()
        ripple[title] = (across[slides] - trend).std() / mean[title]
        yield context.zero(f'{title}: ripple, rms', ripple[title], 0.005)
    draw(context, curves)
    for rough in ('quasi-symmetric, flat facets', 'symmetric'):
        yield context.below(f'ripple, against {rough}', ripple['quasi-symmetric'], ripple[rough])
    swap = abs(mean['quasi-symmetric, swapped'] / mean['quasi-symmetric'] - 1)
    yield context.zero('quasi-symmetric: force across, roles swapped', swap, 1e-3)
    if not context.quick:
        other = abs(mean['master/slave, swapped'] / mean['master/slave'] - 1)
        yield context.below('the same, against master/slave', swap, other)


def replaced(text, words):
    """Every word must be there: else the input is not the one this case knows."""
    for old, new in words.items():
        if old not in text:
            raise RuntimeError(f'input/ironing does not have {old}')
        text = text.replace(old, new)
    return text


def draw(context, curves):
    """ironing.png: forces against stroke."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(12, 5))
    colours = pyplot.get_cmap('tab10').colors
    for (title, (time, along, across)), colour in zip(curves.items(), colours):
        stroke = numpy.maximum(time - 1, 0)
        on = time >= 1
        left.plot(stroke[on], along[on], color=colour, label=title, linewidth=1)
        right.plot(stroke[on], across[on], color=colour, linewidth=1)
    left.set_ylabel('force along [N/mm]')
    right.set_ylabel('force across [N/mm]')
    for axes in (left, right):
        axes.set_xlabel('stroke [mm]')
    left.legend(fontsize=8)
    figure.savefig(context.folder / 'ironing.png', dpi=120, bbox_inches='tight')
    pyplot.close(figure)
