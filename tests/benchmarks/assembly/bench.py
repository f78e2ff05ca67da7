"""Residual and tangent of J2 plasticity: nanoseconds a tetrahedron, phase by phase.

The billet of the upsetting in plastic flow; bench_assembly.f90 says what the phases are. Share of
contact and output in the CPU time of a run: benchmark `phases`.
"""
import upsetting_work


def run(context):
    mesh = '2k' if context.quick else '10k'
    upsetting_work.make_mesh(context, mesh)
    case = context.folder / 'assembly.nml'
    case.write_text(upsetting_work.text(mesh, 0.05), encoding='utf-8')
    context.say(context.run_benchmark('bench_assembly', case).rstrip())
