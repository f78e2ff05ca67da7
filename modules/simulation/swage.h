/* Swage for C and C++: the twin of the Fortran module `swage`.
 *
 *     swage_simulation *run;
 *     int world = swage_environment_start();
 *     int code = swage_start("case.nml", NULL, world, &run);
 *     if (code == 0) code = swage_run(run);
 *     if (code != 0) fprintf(stderr, "%s\n", swage_message(run));
 *     swage_finish(&run);
 *     swage_environment_stop();
 *
 * All functions that take a run are collective over its communicator, but for the queries. Those
 * that can fail return 0 or the exit code of the program for the same fault; after a failure only
 * the queries and swage_finish may follow. Link by the Fortran compiler, or as `pkg-config --libs
 * swage` says.
 */
#ifndef SWAGE_H
#define SWAGE_H

#ifdef __cplusplus
extern "C" {
#endif

/* Exit codes. */
#define SWAGE_DONE 0
#define SWAGE_INPUT 2
#define SWAGE_MESH 3
#define SWAGE_CONVERGENCE 4
#define SWAGE_SOLVER 5
#define SWAGE_FILE 6
#define SWAGE_STOPPED 75

typedef struct swage_simulation swage_simulation;

/* Start MPI unless the caller has done so; all processes, as MPI_Comm_c2f would give them. */
int swage_environment_start(void);

/* End MPI, whoever has started it. */
void swage_environment_stop(void);

/* Read the input, build the problem, open the files, write the start. `prefix` is the start of the
 * names of the result files, NULL for that of the input; `comm` comes from MPI_Comm_c2f or from
 * swage_environment_start. `*run` is to be given to swage_finish also when this fails. */
int swage_start(const char *path, const char *prefix, int comm, swage_simulation **run);

/* Advance by one accepted increment, until a time, which is met exactly, or to the end. */
int swage_advance(swage_simulation *run);
int swage_advance_to(swage_simulation *run, double time);
int swage_run(swage_simulation *run);

/* Write the fields of the present state. */
int swage_write(swage_simulation *run);

/* Components and items (nodes or cells of this rank) of a field. */
int swage_field_shape(swage_simulation *run, const char *name, int *n_component, int *n_item);

/* Copy a field of this rank: n_component numbers for each item, n = n_component * n_item in all. */
int swage_field(swage_simulation *run, const char *name, double *values, int n);

/* Present time, end of the last step, accepted increments, whether all steps are done. */
double swage_time(const swage_simulation *run);
double swage_end(const swage_simulation *run);
int swage_increment(const swage_simulation *run);
int swage_is_done(const swage_simulation *run);

/* What went wrong, empty when nothing did; valid until the next call. */
const char *swage_message(const swage_simulation *run);

/* Write the last state and the totals, close everything, free the run and set it to NULL. Returns
 * how the run went. Harmless for NULL. */
int swage_finish(swage_simulation **run);

#ifdef __cplusplus
}
#endif

#endif
