!> Names of the linear solvers. A new one is one new file and one line in `registry`.
module swage_linear_solver_registry
  use swage_blas_memory, only: claim_blas_memory
  use swage_comm, only: comm_t
  use swage_halo, only: halo_t
  use swage_linear_solver, only: linear_solver_t
  use swage_mumps, only: mumps_solver_create
  use swage_mumps_lagged, only: lagged_solver_create
  use swage_status, only: status_t
  use swage_unknowns, only: unknowns_t
  implicit none(type, external)
  private

  public :: linear_solver_create, linear_solver_names, LINEAR_SOLVER_NAME_LENGTH

  !> Longest name of a solver.
  integer, parameter :: LINEAR_SOLVER_NAME_LENGTH = 32

  abstract interface
    !> Prepare a solver for matrices of some unknowns, whatever their pattern.
    subroutine create_solver(comm, halo, unknowns, n_negative, solver, status)
      import :: comm_t, halo_t, linear_solver_t, status_t, unknowns_t
      implicit none(type, external)
      type(comm_t), intent(in) :: comm
      !> Exchange of the unknown nodes between ranks.
      type(halo_t), intent(in) :: halo
      type(unknowns_t), intent(in) :: unknowns
      !> Unknowns of all ranks with a negative definite block, when the symmetric part of the matrix
      !> is quasi-definite: factors then need no pivoting. Negative when nothing is known.
      integer, intent(in) :: n_negative
      class(linear_solver_t), allocatable, intent(out) :: solver
      !> `STATUS_ERROR`, the same on all ranks, when there are too many unknowns.
      type(status_t), intent(inout) :: status
    end subroutine create_solver
  end interface

  type :: entry_t
    character(len=LINEAR_SOLVER_NAME_LENGTH) :: name = ''
    procedure(create_solver), pointer, nopass :: make => null()
  end type entry_t

contains

  !> All solvers, the default first. The only place where their names are written.
  function registry() result(entries)
    type(entry_t), allocatable :: entries(:)

    entries = [ &
      entry_t('mumps_lagged', lagged_solver_create), &
      entry_t('mumps', mumps_solver_create)]

  end function registry

  !> What the key `linear_solver` may be, the default first.
  function linear_solver_names() result(names)
    character(len=LINEAR_SOLVER_NAME_LENGTH), allocatable :: names(:)

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    allocate (names(size(entries)))
    do i = 1, size(entries)
      names(i) = entries(i)%name
    end do

  end function linear_solver_names

  !> Collective. Make the solver of a name; see `create_solver`.
  subroutine linear_solver_create(name, comm, halo, unknowns, n_negative, solver, status)
    !> One of [[linear_solver_names]].
    character(len=*), intent(in) :: name
    type(comm_t), intent(in) :: comm
    type(halo_t), intent(in) :: halo
    type(unknowns_t), intent(in) :: unknowns
    integer, intent(in) :: n_negative
    !> Allocated unless `status` failed.
    class(linear_solver_t), allocatable, intent(out) :: solver
    type(status_t), intent(inout) :: status

    type(entry_t), allocatable :: entries(:)
    integer :: i

    call claim_blas_memory(status)
    call comm%agree(status)
    if (status%failed()) return
    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name /= name) cycle
      call entries(i)%make(comm, halo, unknowns, n_negative, solver, status)
      return
    end do

  end subroutine linear_solver_create

end module swage_linear_solver_registry
