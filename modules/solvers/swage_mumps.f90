!> Direct solution with MUMPS in double precision, the reference among the strategies: the matrix
!> of each iteration is factorised, and its pattern analysed when it has grown.
module swage_mumps
  use swage_block_matrix, only: block_matrix_t
  use swage_comm, only: comm_t
  use swage_factor_layout, only: factor_layout_create, factor_layout_t, UNSYMMETRIC
  use swage_halo, only: halo_t
  use swage_kinds, only: wp
  use swage_linear_solver, only: analysis_text, linear_solver_t
  use swage_mumps_double, only: mumps_factor_t
  use swage_phase_times, only: PHASE_FACTORISATION, PHASE_ORDERING, PHASE_SOLUTION
  use swage_status, only: status_t
  use swage_text, only: text
  use swage_unknowns, only: unknowns_t
  implicit none(type, external)
  private

  public :: mumps_solver_t, mumps_solver_create

  type, extends(linear_solver_t) :: mumps_solver_t
    private
    type(factor_layout_t) :: layout
    type(mumps_factor_t) :: factor
    character(len=:), allocatable :: decisions
  contains
    procedure, public :: factorise => mumps_factorise
    procedure, public :: solve => mumps_solve
    procedure, public :: report => mumps_report
    procedure, public :: free => mumps_free
    procedure, private :: analyse => mumps_analyse
  end type mumps_solver_t

contains

  !> Number the unknowns.
  subroutine mumps_solver_create(comm, halo, unknowns, n_negative, solver, status)
    type(comm_t), intent(in) :: comm
    !> Exchange of the unknown nodes between ranks.
    type(halo_t), intent(in) :: halo
    type(unknowns_t), intent(in) :: unknowns
    !> Of no use to factors that pivot.
    integer, intent(in) :: n_negative
    class(linear_solver_t), allocatable, intent(out) :: solver
    !> `STATUS_ERROR`, the same on all ranks, when there are too many unknowns.
    type(status_t), intent(inout) :: status

    type(mumps_solver_t), allocatable :: mumps

    associate (unused => n_negative)
    end associate
    allocate (mumps)
    call factor_layout_create(comm, halo, unknowns, mumps%layout, status)
    if (status%failed()) return
    mumps%decisions = 'linear solver: MUMPS, '//text(mumps%layout%n_unknown)// &
      ' unknowns, METIS ordering'
    call move_alloc(mumps, solver)

  end subroutine mumps_solver_create

  subroutine mumps_factorise(self, matrix, status)
    class(mumps_solver_t), intent(inout) :: self
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    if (.not. self%factor%fits(matrix)) call self%analyse(matrix, status)
    if (status%failed()) return
    call self%times%begin(PHASE_FACTORISATION)
    call self%factor%factorise(self%layout, matrix, status)
    call self%times%end(PHASE_FACTORISATION)
    if (.not. status%failed()) self%n_factorisation = self%n_factorisation + 1

  end subroutine mumps_factorise

  !> Collective. Order the unknowns and analyse the pattern.
  subroutine mumps_analyse(self, matrix, status)
    class(mumps_solver_t), intent(inout) :: self
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    call self%times%begin(PHASE_ORDERING)
    call self%factor%create(self%layout, matrix, matrix%version(), UNSYMMETRIC, 0.0_wp, status)
    call self%times%end(PHASE_ORDERING)
    if (status%failed()) return
    self%n_analysis = self%n_analysis + 1
    if (self%decisions /= '') self%decisions = self%decisions//new_line('a')
    self%decisions = self%decisions//'linear solver: '// &
      analysis_text(self%n_analysis, self%factor%get_memory())

  end subroutine mumps_analyse

  subroutine mumps_solve(self, matrix, right_hand_side, weight, tolerance, solution, status)
    class(mumps_solver_t), intent(inout) :: self
    type(block_matrix_t), target, intent(in) :: matrix
    real(wp), contiguous, intent(in) :: right_hand_side(:, :)
    real(wp), contiguous, intent(in) :: weight(:)
    real(wp), intent(in) :: tolerance
    real(wp), contiguous, intent(out) :: solution(:, :)
    type(status_t), intent(inout) :: status

    ! The factors of the matrix are at hand, and the solution is exact whatever is asked for
    associate (unused_1 => matrix, unused_2 => weight, unused_3 => tolerance)
    end associate

    call self%times%begin(PHASE_SOLUTION)
    solution = 0.0_wp
    call self%factor%solve(self%layout, right_hand_side, solution, status)
    call self%layout%halo%update(solution)
    call self%times%end(PHASE_SOLUTION)
    self%n_solution = self%n_solution + 1

  end subroutine mumps_solve

  subroutine mumps_report(self, text)
    class(mumps_solver_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: text

    character(len=:), allocatable :: notes

    text = ''
    if (.not. allocated(self%decisions)) return
    call self%factor%take_notes(notes)
    text = self%decisions
    if (text == '' .and. notes /= '') notes = notes(2:)
    text = text//notes
    self%decisions = ''

  end subroutine mumps_report

  subroutine mumps_free(self)
    class(mumps_solver_t), intent(inout) :: self

    call self%factor%free()

  end subroutine mumps_free

end module swage_mumps
