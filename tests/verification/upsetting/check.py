"""The upsetting of input/upsetting: round, symmetrical, tight on its tools, without a cut step.

The billet is round and its tools are equal, the mesh is neither: what differs between the tools or
around the circumference is error of the mesh. At the end, in 24 sectors of 15 degrees: the radius
of contact is that of the outermost node on the tool, the barrel's that of the outermost node at
half height. Out-of-round is the spread of the twelve diameters by their mean. The limits, 1 %, are
an eighth of a cell by the radius. Penetration by the size of the cells at the node: 1 %.

That the side folds onto the tools is seen in the contact radius: the rim of the end face, whose
nodes are those drawn at the ends, lies inside of it.
"""
import numpy

SLOW = True
N_SECTOR = 24


def run(context):
    source = context.root / 'input' / 'upsetting'
    context.make_mesh((source / 'upsetting.geo').read_text(encoding='utf-8'), 3, 'upsetting')
    done = context.run_swage(source / 'upsetting.nml', name='upsetting', timeout=7200)
    history = done.history
    lines = done.path('.sta').read_text(encoding='utf-8').splitlines()
    yield context.row('increments', len(history['time']) - 1, 50, 0)
    yield context.zero('cut increments', sum('failed' in line for line in lines), 0)

    step = done.results().step(-1)
    radius = numpy.hypot(step.points[:, 0], step.points[:, 1])
    angle = numpy.arctan2(step.points[:, 1], step.points[:, 0])
    sector = ((angle / (2 * numpy.pi) + 0.5) * N_SECTOR).astype(int) % N_SECTOR
    height = step.points[:, 2]
    drawn = height - step.point_fields['displacement'][:, 2]
    body = numpy.zeros(len(radius), bool)
    body[step.cells[10].ravel()] = True
    touching = body & (step.point_fields['contact_pressure'].ravel() > 0)

    means = {}
    for name, nodes in (('top', touching & (height > 7.5)), ('bottom', touching & (height < 7.5)),
                        ('barrel', body & (abs(height - 7.5) < 0.5))):
        outermost = numpy.array([radius[nodes & (sector == i)].max() for i in range(N_SECTOR)])
        means[name] = outermost.mean()
        diameters = outermost[:N_SECTOR // 2] + outermost[N_SECTOR // 2:]
        yield context.below(f'{name}: out-of-round',
                            (diameters.max() - diameters.min()) / diameters.mean(), 0.01)
    yield context.row('contact radius [mm], top by bottom', means['top'], means['bottom'], 0.01)
    for name, end in (('top', 30.0), ('bottom', 0.0)):
        rim = body & (abs(drawn - end) < 1e-6)
        folded = touching & (abs(drawn - end) > 0.5) & (abs(drawn - end) < 10)
        yield context.above(f'{name}: nodes of the side on the tool', folded.sum(), N_SECTOR)
        yield context.above(f'{name}: contact radius [mm] beyond the rim of the end face',
                            means[name], radius[rim].max())
        yield context.below(f'{name}: penetration by the size of a cell, largest of the run',
                            max(history[f'penetration_by_cell_{name}']), 0.01)
    yield context.row('force [N], top by bottom', history['force_upper_z'][-1],
                      -history['force_lower_z'][-1], 1e-6)
    yield context.below('mass error', abs(history['mass_error'][-1]), 1e-4)
