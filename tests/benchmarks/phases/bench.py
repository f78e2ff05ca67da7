"""Where the CPU time of an upsetting goes, by the number of nodes; growth exponent of the whole.

To 20 % of reduction, results written every 5 increments, one rank.
"""
import math

import upsetting_work


def run(context):
    sizes = ['2k'] if context.quick else ['2k', '10k', '30k']
    seconds, nodes = [], []
    for name in sizes:
        upsetting_work.make_mesh(context, name)
        done = context.run_swage(upsetting_work.text(name, 0.2), name=name, timeout=7200)
        counts = context.counts(done)
        phases = counts['phases']
        if not seconds:
            context.title('mesh', 'iterations', 'cuts', 'CPU [s]', *(f'{p} [%]' for p in phases))
        context.line(name, counts['iterations'], counts['cuts'], counts['cpu'],
                     *(100 * value / counts['cpu'] for value in phases.values()))
        seconds.append(counts['cpu'])
        nodes.append(done.results().step(0).points.shape[0])
    if len(seconds) > 1:
        exponent = math.log(seconds[-1] / seconds[0]) / math.log(nodes[-1] / nodes[0])
        context.say(f'growth exponent of the CPU time from {nodes[0]} to {nodes[-1]} nodes: '
                    f'{exponent:.2f}')
