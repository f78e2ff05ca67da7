"""Contact between two bodies: nanoseconds a facet of the slave, by what is done and by size.

Two wavy sheets of triangles that do not match, from 512 to 32 768 facets of the slave: a factor 64.
bench_contact.f90 says what the phases are. A search that costs N log N takes nanoseconds a facet
that grow as log N; the last column compares: time of the search at the largest size by that at the
smallest, and what N log N gives.
"""
import math

PHASES = ('start of step', 'positions', 'search', 'conditions', 'own stiffness', 'forces', 'matrix')


def run(context):
    least, most = (16, 64) if context.quick else (16, 128)
    context.title('formulation', 'facets', *PHASES)
    growth = []
    for formulation in ('nodal', 'l2'):
        text = context.run_benchmark('bench_contact', formulation, str(least), str(most))
        rows = [[float(word) for word in line.split()] for line in text.splitlines()]
        for facets, *times in rows:
            context.line(formulation, int(facets), *(f'{time:.0f} ns' for time in times))
        small, large = rows[0], rows[-1]
        factor = large[0] / small[0]
        growth.append((formulation, factor, large[3] / small[3] * factor,
                       factor * math.log(large[0]) / math.log(small[0]),
                       sum(large[2:]) / sum(small[2:]) * factor))
    context.title('formulation', 'facets', 'search', 'N log N', 'a whole iteration')
    for row in growth:
        context.line(*row)
