!> Start and end of MPI, for programs; a library that runs inside another program uses its own.
module swage_environment
  use mpi_f08, only: MPI_Comm, MPI_COMM_WORLD, MPI_Finalize, MPI_Finalized, MPI_Init, &
                     MPI_Initialized
  use swage_comm, only: comm_create, comm_t
  implicit none(type, external)
  private

  public :: environment_start, environment_stop, comm_of_handle

contains

  !> Collective over all processes. Start MPI unless the caller has done so.
  subroutine environment_start(comm)
    !> All processes.
    type(comm_t), intent(out) :: comm

    logical :: is_started

    call MPI_Initialized(is_started)
    if (.not. is_started) call MPI_Init()
    comm = comm_create(MPI_COMM_WORLD)

  end subroutine environment_start

  !> Collective over all processes. Nothing collective may follow. Harmless when called twice.
  subroutine environment_stop()

    logical :: is_stopped

    call MPI_Finalized(is_stopped)
    if (.not. is_stopped) call MPI_Finalize()

  end subroutine environment_stop

  !> Wrap a communicator that another language hands over.
  function comm_of_handle(handle) result(comm)
    !> What `MPI_Comm_c2f` gives.
    integer, intent(in) :: handle
    type(comm_t) :: comm

    type(MPI_Comm) :: wrapped

    wrapped%mpi_val = handle
    comm = comm_create(wrapped)

  end function comm_of_handle

end module swage_environment
