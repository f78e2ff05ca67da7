!> The public face of Swage: what a program that drives simulations needs, under one name.
!>
!>     call environment_start(comm)
!>     call simulation%start('case.nml', comm, status)
!>     if (.not. status%failed()) call simulation%run(status)
!>     call simulation%finish(status)
!>     call environment_stop()
module swage
  use swage_build_info, only: BUILD_COMPILER, BUILD_FLAGS, BUILD_LIBRARIES, BUILD_TYPE, &
                              SWAGE_VERSION
  use swage_comm, only: comm_create, comm_t
  use swage_environment, only: environment_start, environment_stop
  use swage_input_reference, only: explain_all_groups, explain_group
  use swage_kinds, only: gp, wp
  use swage_signals, only: watch_signals
  use swage_simulation, only: simulation_t
  use swage_status, only: status_t, EXIT_CONVERGENCE, EXIT_DONE, EXIT_FILE, EXIT_INPUT, &
                          EXIT_MESH, EXIT_SOLVER, EXIT_STOPPED, STATUS_ERROR, STATUS_OK, &
                          STATUS_RETRY
  implicit none(type, external)
  private

  public :: simulation_t
  public :: comm_create, comm_t, environment_start, environment_stop, watch_signals
  public :: explain_all_groups, explain_group
  public :: gp, wp
  public :: status_t, STATUS_ERROR, STATUS_OK, STATUS_RETRY
  public :: EXIT_CONVERGENCE, EXIT_DONE, EXIT_FILE, EXIT_INPUT, EXIT_MESH, EXIT_SOLVER, &
            EXIT_STOPPED
  public :: BUILD_COMPILER, BUILD_FLAGS, BUILD_LIBRARIES, BUILD_TYPE, SWAGE_VERSION

end module swage
