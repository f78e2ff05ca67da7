/* The same from C. */
#include <stdio.h>
#include <stdlib.h>
#include "swage.h"

int main(void)
{
    swage_simulation *run;
    int n_component, n_item, code = swage_start("bar.nml", NULL, swage_environment_start(), &run);
    while (code == 0 && !swage_is_done(run)) code = swage_advance(run);
    if (code == 0) code = swage_field_shape(run, "displacement", &n_component, &n_item);
    if (code != 0) { fprintf(stderr, "%s\n", swage_message(run)); return code; }
    double largest = 0, *u = malloc(n_component * n_item * sizeof *u);
    swage_field(run, "displacement", u, n_component * n_item);
    for (int i = 0; i < n_component * n_item; i++) if (u[i] > largest) largest = u[i];
    printf("time %.4f displacement .%06d\n", swage_time(run), (int)(largest * 1e6 + 0.5));
    free(u);
    code = swage_finish(&run);
    swage_environment_stop();
    return code;
}
