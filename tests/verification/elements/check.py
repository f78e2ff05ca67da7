"""Element and laws: A1 patch, A2 rotation, A3 convergence, A4 inf-sup, A5 condensation, A6 tangents."""


def run(context):
    for program in ('verify_element', 'verify_laws', 'verify_convergence', 'verify_inf_sup'):
        yield from context.run_program(program)
