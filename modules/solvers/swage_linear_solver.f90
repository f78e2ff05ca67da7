!> What every solver of the linearised equations offers.
module swage_linear_solver
  use swage_block_matrix, only: block_matrix_t
  use swage_kinds, only: wp
  use swage_memory, only: peak_memory
  use swage_phase_times, only: phase_times_t
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: linear_solver_t, linear_solver_load, linear_solver_save, SOLVER_SAVED, analysis_text

  !> Entry of a snapshot that says that a solver has saved itself.
  character(len=*), parameter :: SOLVER_SAVED = 'solver'

  !> A solver with its factors. Owns handles: call `free`; do not copy. All bindings are collective.
  type, abstract :: linear_solver_t
    !> Factorisations, solutions and the iterations in them, and analyses of patterns, since the
    !> start, for reports.
    integer :: n_factorisation = 0
    integer :: n_solution = 0
    integer :: n_iteration = 0
    integer :: n_analysis = 0
    !> Time spent on ordering, factorisation and solution.
    type(phase_times_t) :: times
  contains
    !> Take new values of the matrix.
    procedure(factorise_matrix), deferred :: factorise
    !> Solve with the last matrix, which is given again: a solver may iterate.
    procedure(solve_system), deferred :: solve
    !> What the solver decided since the last call, for the log; blank if nothing.
    procedure(report_decisions), deferred :: report
    !> Put into a snapshot what the next solution depends on; a solver that keeps anything but
    !> counters overrides both.
    procedure :: save => linear_solver_save
    !> Collective. Take it back: the next solution has the bits it would have had.
    procedure :: load => linear_solver_load
    !> Release every handle. Harmless when called twice.
    procedure(free_handles), deferred :: free
  end type linear_solver_t

  abstract interface
    subroutine factorise_matrix(self, matrix, status)
      import :: block_matrix_t, linear_solver_t, status_t
      implicit none(type, external)
      class(linear_solver_t), intent(inout) :: self
      !> Constrained rows and columns are those of the identity. Its pattern may have grown.
      type(block_matrix_t), intent(in) :: matrix
      !> `STATUS_RETRY` when the matrix is singular, `STATUS_ERROR` when memory is short.
      type(status_t), intent(inout) :: status
    end subroutine factorise_matrix

    subroutine solve_system(self, matrix, right_hand_side, weight, tolerance, solution, status)
      import :: block_matrix_t, linear_solver_t, status_t, wp
      implicit none(type, external)
      class(linear_solver_t), intent(inout) :: self
      !> The matrix of the last call to `factorise`.
      type(block_matrix_t), target, intent(in) :: matrix
      !> Complete on the owner of each node; shape (n_slot, n_node).
      real(wp), contiguous, intent(in) :: right_hand_side(:, :)
      !> Of each slot of a residual in its norm, positive; shape (n_slot).
      real(wp), contiguous, intent(in) :: weight(:)
      !> Norm of the residual that may be left, by that of the right-hand side [1]; 0: exact.
      real(wp), intent(in) :: tolerance
      !> On every copy; shape (n_slot, n_node).
      real(wp), contiguous, intent(out) :: solution(:, :)
      type(status_t), intent(inout) :: status
    end subroutine solve_system

    subroutine report_decisions(self, text)
      import :: linear_solver_t
      implicit none(type, external)
      class(linear_solver_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: text
    end subroutine report_decisions

    subroutine free_handles(self)
      import :: linear_solver_t
      implicit none(type, external)
      class(linear_solver_t), intent(inout) :: self
    end subroutine free_handles
  end interface

contains

  !> Counters; for overrides too.
  subroutine linear_solver_save(self, snapshot)
    class(linear_solver_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put(SOLVER_SAVED, [self%n_factorisation, self%n_solution, self%n_iteration, &
                                     self%n_analysis])

  end subroutine linear_solver_save

  subroutine linear_solver_load(self, snapshot, matrix, status)
    class(linear_solver_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> With the pattern of the matrices to come, as it was saved; its values do not count.
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    integer :: counts(4)

    associate (unused => matrix)
    end associate
    counts = [self%n_factorisation, self%n_solution, self%n_iteration, self%n_analysis]
    call snapshot%get(SOLVER_SAVED, counts, status)
    self%n_factorisation = counts(1)
    self%n_solution = counts(2)
    self%n_iteration = counts(3)
    self%n_analysis = counts(4)

  end subroutine linear_solver_load

  !> What the log tells of an analysis.
  function analysis_text(number, memory) result(line)
    !> Of analyses so far.
    integer, intent(in) :: number
    !> Estimated for the factors on the largest rank [MB].
    integer, intent(in) :: memory
    character(len=:), allocatable :: line

    line = 'analysis '//text(number)//': '//text(memory)//' MB estimated on the largest rank; '// &
      'peak of rank 0 '//text(peak_memory())//' MB'

  end function analysis_text

end module swage_linear_solver
