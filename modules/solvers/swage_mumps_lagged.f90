!> Factors in single precision, kept over iterations and steps as the preconditioner of a GMRES in
!> double precision.
!>
!> The factors are those of the symmetric part of a matrix, without what is listed as unsymmetric;
!> the product is that of the whole matrix. They serve on when the pattern of the matrix grows, for
!> it is analysed only when a matrix with another pattern is factorised. A new matrix is factorised
!> when the iterations that the age of the factors has cost are worth a factorisation; costs are
!> counted, not timed, so that a run repeats itself. When GMRES does not get on with old factors the
!> matrix is factorised; when it does not get on with fresh ones, MUMPS in double precision solves,
!> for a while.
module swage_mumps_lagged
  use swage_block_matrix, only: block_matrix_t
  use swage_comm, only: comm_t
  use swage_factor_layout, only: factor_layout_create, factor_layout_t, SYMMETRIC, UNSYMMETRIC, &
                                 WITHOUT_PIVOTING
  use swage_gmres, only: gmres_report_t, gmres_system_t, gmres_t
  use swage_halo, only: halo_t
  use swage_kinds, only: wp
  use swage_linear_solver, only: analysis_text, linear_solver_load, linear_solver_save, &
                                 linear_solver_t
  use swage_mumps_double, only: double_factor_t => mumps_factor_t
  use swage_mumps_single, only: single_factor_t => mumps_factor_t
  use swage_number, only: number_text
  use swage_phase_times, only: PHASE_FACTORISATION, PHASE_ORDERING, PHASE_SOLUTION
  use swage_snapshot, only: OF_RANK, snapshot_t
  use swage_status, only: status_t
  use swage_text, only: text
  use swage_unknowns, only: unknowns_t
  implicit none(type, external)
  private

  public :: lagged_solver_t, lagged_solver_create

  !> Unknown nodes from which blocks of low rank pay, and how accurate they are.
  integer, parameter :: LOW_RANK_NODES = 20000
  real(wp), parameter :: LOW_RANK = 1.0e-2_wp
  !> Time of a factorisation in the time in which a solution reads an entry of the factors: so much
  !> for each entry, which is moved about, and the inverse of that for each operation. Measured with
  !> 2000 to 10 000 nodes; machines differ, the best time to factorise hardly does.
  real(wp), parameter :: READS_PER_ENTRY = 18.0_wp
  real(wp), parameter :: OPERATIONS_PER_READ = 110.0_wp
  !> Time of an analysis likewise, for each entry of the matrix.
  real(wp), parameter :: READS_PER_ENTRY_ANALYSED = 50.0_wp
  !> Fewest iterations that old factors are given, and most that fresh ones are.
  integer, parameter :: LEAST_PATIENCE = 12
  integer, parameter :: MOST_PATIENCE = 100
  !> Solutions in double precision after a failure of fresh factors.
  integer, parameter :: DIRECT_SOLUTIONS = 10
  !> Entries of a snapshot.
  character(len=*), parameter :: SAVED_VALUES = 'solver: values'
  character(len=*), parameter :: SAVED_SCALE = 'solver: scale'
  !> Smallest tolerance that iterations in double precision reach.
  real(wp), parameter :: LEAST_TOLERANCE = 1.0e-12_wp

  !> The matrix in hand with factors, residuals weighted.
  type, extends(gmres_system_t) :: weighted_system_t
    type(factor_layout_t) :: layout
    type(single_factor_t) :: factor
    !> Owned by the caller of `solve`, for the time of that call.
    type(block_matrix_t), pointer :: matrix => null()
    !> Of the slots of a residual; shape (n_slot).
    real(wp), allocatable :: weight(:)
    !> Room for a vector on all copies; shape (n_slot, n_node).
    real(wp), allocatable :: before(:, :), after(:, :)
  contains
    procedure :: multiply => weighted_system_multiply
    procedure :: precondition => weighted_system_precondition
    procedure :: sum => weighted_system_sum
  end type weighted_system_t

  type, extends(linear_solver_t) :: lagged_solver_t
    private
    type(weighted_system_t) :: system
    type(double_factor_t) :: direct
    type(gmres_t) :: gmres
    !> Negative pivots of a quasi-definite matrix; none is expected when negative.
    integer :: n_negative = -1
    !> `WITHOUT_PIVOTING` or `SYMMETRIC`.
    integer :: kind = SYMMETRIC
    real(wp) :: low_rank = 0.0_wp
    !> Costs, in entries read: of a factorisation, of an analysis, and of an iteration.
    real(wp) :: cost_of_factors = 0.0_wp
    real(wp) :: cost_of_analysis = 0.0_wp
    real(wp) :: cost_of_iteration = 1.0_wp
    !> Since the last factorisation: fewest iterations for a digit, iterations beyond that,
    !> solutions and iterations.
    real(wp) :: rate = huge(1.0_wp)
    real(wp) :: excess = 0.0_wp
    integer :: n_solution_since = 0
    integer :: n_iteration_since = 0
    !> The factors are to be renewed with the next matrix.
    logical :: is_due = .true.
    !> The factors are those of the matrix in hand.
    logical :: is_fresh = .false.
    !> Solutions that are still to be made in double precision.
    integer :: n_direct = 0
    character(len=:), allocatable :: decisions
  contains
    procedure, public :: factorise => lagged_factorise
    procedure, public :: solve => lagged_solve
    procedure, public :: report => lagged_report
    procedure, public :: save => lagged_save
    procedure, public :: load => lagged_load
    procedure, public :: free => lagged_free
    procedure, private :: analyse => lagged_analyse
    procedure, private :: renew => lagged_renew
    procedure, private :: iterate => lagged_iterate
    procedure, private :: cost_of_renewal => lagged_cost_of_renewal
    procedure, private :: factorise_directly => lagged_factorise_directly
    procedure, private :: solve_directly => lagged_solve_directly
  end type lagged_solver_t

contains

  !> Number the unknowns.
  subroutine lagged_solver_create(comm, halo, unknowns, n_negative, solver, status)
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

    type(lagged_solver_t), allocatable :: lagged

    allocate (lagged)
    lagged%decisions = ''
    lagged%n_negative = n_negative
    lagged%kind = merge(WITHOUT_PIVOTING, SYMMETRIC, n_negative >= 0)
    lagged%low_rank = merge(LOW_RANK, 0.0_wp, unknowns%n_node_global >= LOW_RANK_NODES)
    associate (system => lagged%system)
      call factor_layout_create(comm, halo, unknowns, system%layout, status)
      if (status%failed()) return
      allocate (system%before(unknowns%n_slot, unknowns%n_node), &
                system%after(unknowns%n_slot, unknowns%n_node), source=0.0_wp)
      call note(lagged, 'MUMPS in single precision, kept factors, '// &
                text(system%layout%n_unknown)//' unknowns, METIS ordering')
    end associate
    call move_alloc(lagged, solver)

  end subroutine lagged_solver_create

  !> The factors are renewed here only when the last solution has said so.
  subroutine lagged_factorise(self, matrix, status)
    class(lagged_solver_t), intent(inout) :: self
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    self%is_fresh = .false.
    if (self%n_direct > 0) then
      call self%factorise_directly(matrix, status)
    else if (self%is_due) then
      call self%renew(matrix, status)
    end if

  end subroutine lagged_factorise

  !> Collective. Order the unknowns and analyse a pattern.
  subroutine lagged_analyse(self, matrix, version, status)
    class(lagged_solver_t), intent(inout) :: self
    type(block_matrix_t), intent(in) :: matrix
    !> Of the pattern: the present one or one of before.
    integer, intent(in) :: version
    type(status_t), intent(inout) :: status

    call self%times%begin(PHASE_ORDERING)
    call self%system%factor%create(self%system%layout, matrix, version, self%kind, self%low_rank, &
                                   status)
    call self%times%end(PHASE_ORDERING)

  end subroutine lagged_analyse

  !> Factorise anew, and start to count.
  subroutine lagged_renew(self, matrix, status)
    class(lagged_solver_t), intent(inout) :: self
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    real(wp) :: entries, matrix_entries, operations

    ! Where this fails there are no factors to go on with
    self%is_due = .true.
    associate (factor => self%system%factor, layout => self%system%layout)
      if (.not. factor%fits(matrix)) then
        call self%analyse(matrix, matrix%version(), status)
        if (status%failed()) return
        self%n_analysis = self%n_analysis + 1
        call note(self, analysis_text(self%n_analysis, factor%get_memory()))
      end if
      call factorise_single(self, matrix, status)
      if (status%failed()) return
      if (self%n_negative >= 0 .and. self%kind == WITHOUT_PIVOTING .and. &
          self%low_rank <= 0.0_wp .and. factor%get_n_negative() /= self%n_negative) then
        call note(self, text(factor%get_n_negative())//' negative pivots in place of '// &
                  text(self%n_negative)//': factors with pivoting from now on')
        self%kind = SYMMETRIC
        call self%analyse(matrix, matrix%version(), status)
        if (status%failed()) return
        call factorise_single(self, matrix, status)
        if (status%failed()) return
      end if
      call factor%get_cost(operations, entries)
      call note(self, 'factorisation '//text(self%n_factorisation)//' after '// &
                text(self%n_solution_since)//' solutions and '//text(self%n_iteration_since)// &
                ' iterations: '//number_text(operations)//' operations, '// &
                number_text(entries)//' entries, '//text(factor%get_memory())// &
                ' MB on the largest rank')
      self%cost_of_factors = READS_PER_ENTRY * entries + operations / OPERATIONS_PER_READ
      matrix_entries = count_entries(layout%comm, matrix)
      self%cost_of_analysis = READS_PER_ENTRY_ANALYSED * matrix_entries
      self%cost_of_iteration = entries + matrix_entries
    end associate
    self%rate = huge(1.0_wp)
    self%excess = 0.0_wp
    self%n_solution_since = 0
    self%n_iteration_since = 0
    self%is_due = .false.
    self%is_fresh = .true.

  end subroutine lagged_renew

  !> Factors of the pattern analysed.
  subroutine factorise_single(solver, matrix, status)
    type(lagged_solver_t), intent(inout) :: solver
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    call solver%times%begin(PHASE_FACTORISATION)
    call solver%system%factor%factorise(solver%system%layout, matrix, status)
    call solver%times%end(PHASE_FACTORISATION)
    if (.not. status%failed()) solver%n_factorisation = solver%n_factorisation + 1

  end subroutine factorise_single

  !> Collective. Entries of a matrix on all ranks.
  function count_entries(comm, matrix) result(entries)
    type(comm_t), intent(in) :: comm
    type(block_matrix_t), intent(in) :: matrix
    real(wp) :: entries

    entries = real(matrix%n_block, wp) * matrix%n_slot**2
    if (allocated(matrix%coupling)) then
      entries = entries + real(matrix%coupling%n_block(), wp) * matrix%coupling%n_dim**2
    end if
    call comm%sum(entries)

  end function count_entries

  subroutine lagged_solve(self, matrix, right_hand_side, weight, tolerance, solution, status)
    class(lagged_solver_t), intent(inout) :: self
    type(block_matrix_t), target, intent(in) :: matrix
    real(wp), contiguous, intent(in) :: right_hand_side(:, :)
    real(wp), contiguous, intent(in) :: weight(:)
    real(wp), intent(in) :: tolerance
    real(wp), contiguous, intent(out) :: solution(:, :)
    type(status_t), intent(inout) :: status

    logical :: has_converged

    self%n_solution = self%n_solution + 1
    solution = 0.0_wp
    if (self%n_direct > 0) then
      call self%solve_directly(right_hand_side, solution, status)
      return
    end if

    call self%iterate(matrix, right_hand_side, weight, tolerance, .false., solution, &
                      has_converged, status)
    if (status%failed()) return
    if (.not. has_converged .and. .not. self%is_fresh) then
      call self%renew(matrix, status)
      call self%system%layout%comm%agree(status)
      if (status%failed()) return
      call self%iterate(matrix, right_hand_side, weight, tolerance, .true., solution, &
                        has_converged, status)
      if (status%failed()) return
    end if
    if (.not. has_converged) then
      call note(self, 'the iterations stall with fresh factors: MUMPS in double precision for '// &
                text(DIRECT_SOLUTIONS)//' solutions')
      self%n_direct = DIRECT_SOLUTIONS
      self%is_due = .true.
      call self%factorise_directly(matrix, status)
      call self%system%layout%comm%agree(status)
      if (status%failed()) return
      call self%solve_directly(right_hand_side, solution, status)
    end if

  end subroutine lagged_solve

  !> Iterate with the factors at hand, and learn what they are worth.
  subroutine lagged_iterate(self, matrix, right_hand_side, weight, tolerance, starts_from, &
                            solution, has_converged, status)
    class(lagged_solver_t), intent(inout) :: self
    type(block_matrix_t), target, intent(in) :: matrix
    real(wp), contiguous, intent(in) :: right_hand_side(:, :)
    real(wp), contiguous, intent(in) :: weight(:)
    real(wp), intent(in) :: tolerance
    !> Whether `solution` is a first guess.
    logical, intent(in) :: starts_from
    real(wp), contiguous, intent(inout) :: solution(:, :)
    logical, intent(out) :: has_converged
    type(status_t), intent(inout) :: status

    type(gmres_report_t) :: report
    real(wp), allocatable :: b(:), x(:)
    real(wp) :: digits, wanted
    integer :: n, n_own, patience

    call self%times%begin(PHASE_SOLUTION)
    wanted = max(tolerance, LEAST_TOLERANCE)
    patience = MOST_PATIENCE
    if (.not. self%is_fresh) then
      patience = max(LEAST_PATIENCE, &
                     int(min(real(MOST_PATIENCE, wp), &
                             self%cost_of_renewal(matrix) / self%cost_of_iteration)))
    end if
    associate (system => self%system)
      n_own = system%layout%n_own_node
      n = system%layout%n_slot * n_own
      system%matrix => matrix
      system%weight = weight
      allocate (b(n), x(n))
      call weigh(weight, right_hand_side(:, :n_own), b)
      x = reshape(solution(:, :n_own), [n])
      call self%gmres%solve(system, b, wanted, patience, starts_from, x, report, status)
      system%matrix => null()
      if (status%failed()) return
      solution(:, :n_own) = reshape(x, [system%layout%n_slot, n_own])
      call system%layout%halo%update(solution)
    end associate
    call self%times%end(PHASE_SOLUTION)
    has_converged = report%has_converged

    digits = -log10(min(wanted, 0.9_wp))
    self%n_iteration = self%n_iteration + report%n_iteration
    self%n_iteration_since = self%n_iteration_since + report%n_iteration
    self%n_solution_since = self%n_solution_since + 1
    self%rate = min(self%rate, report%n_iteration / digits)
    self%excess = self%excess + report%n_iteration - self%rate * digits
    self%is_due = self%excess * self%cost_of_iteration > self%cost_of_renewal(matrix)

  end subroutine lagged_iterate

  !> Of a factorisation, and of an analysis where the pattern has grown.
  pure function lagged_cost_of_renewal(self, matrix) result(cost)
    class(lagged_solver_t), intent(in) :: self
    type(block_matrix_t), intent(in) :: matrix
    real(wp) :: cost

    cost = self%cost_of_factors
    if (.not. self%system%factor%fits(matrix)) cost = cost + self%cost_of_analysis

  end function lagged_cost_of_renewal

  !> Solve with the factors in double precision of the matrix in hand.
  subroutine lagged_solve_directly(self, right_hand_side, solution, status)
    class(lagged_solver_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: right_hand_side(:, :)
    real(wp), contiguous, intent(inout) :: solution(:, :)
    type(status_t), intent(inout) :: status

    call self%times%begin(PHASE_SOLUTION)
    call self%direct%solve(self%system%layout, right_hand_side, solution, status)
    call self%system%layout%halo%update(solution)
    call self%times%end(PHASE_SOLUTION)
    self%n_direct = self%n_direct - 1
    if (self%n_direct == 0) call self%direct%free()

  end subroutine lagged_solve_directly

  !> Factorise a matrix as it is, in double precision.
  subroutine lagged_factorise_directly(self, matrix, status)
    class(lagged_solver_t), intent(inout) :: self
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    if (.not. self%direct%fits(matrix)) then
      call self%times%begin(PHASE_ORDERING)
      call self%direct%create(self%system%layout, matrix, matrix%version(), UNSYMMETRIC, 0.0_wp, &
                              status)
      call self%times%end(PHASE_ORDERING)
      if (status%failed()) return
      self%n_analysis = self%n_analysis + 1
    end if
    call self%times%begin(PHASE_FACTORISATION)
    call self%direct%factorise(self%system%layout, matrix, status)
    call self%times%end(PHASE_FACTORISATION)
    self%n_factorisation = self%n_factorisation + 1

  end subroutine lagged_factorise_directly

  subroutine lagged_report(self, text)
    class(lagged_solver_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: text

    character(len=:), allocatable :: notes

    text = ''
    if (.not. allocated(self%decisions)) return
    call self%system%factor%take_notes(notes)
    text = self%decisions//notes
    if (text /= '') text = text(2:)
    self%decisions = ''

  end subroutine lagged_report

  !> The factors as the matrix that they are of, which may have an earlier pattern, unless the next
  !> one will be factorised anyway.
  subroutine lagged_save(self, snapshot)
    class(lagged_solver_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    real(wp), allocatable :: scale(:, :), values(:)

    call linear_solver_save(self, snapshot)
    call snapshot%put('solver: counts', [self%n_solution_since, self%n_iteration_since, &
                                         self%n_direct, self%kind, self%system%factor%version])
    call snapshot%put('solver: costs', [self%cost_of_factors, self%cost_of_analysis, &
                                        self%cost_of_iteration, self%rate, self%excess])
    call snapshot%put('solver: is due', self%is_due)
    if (self%is_due .or. .not. self%system%factor%is_factorised) return
    call self%system%factor%get_matrix(values, scale)
    call snapshot%put(SAVED_VALUES, values, OF_RANK)
    call snapshot%put(SAVED_SCALE, scale, OF_RANK)

  end subroutine lagged_save

  !> With another partition the next matrix is factorised.
  subroutine lagged_load(self, snapshot, matrix, status)
    class(lagged_solver_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: scale(:, :), values(:)
    real(wp) :: costs(5)
    integer :: counts(5), lost

    call linear_solver_load(self, snapshot, matrix, status)
    counts = 0
    costs = 0.0_wp
    call snapshot%get('solver: counts', counts, status)
    call snapshot%get('solver: costs', costs, status)
    call snapshot%get('solver: is due', self%is_due, status)
    call self%system%layout%comm%agree(status)
    if (status%failed()) return
    self%n_solution_since = counts(1)
    self%n_iteration_since = counts(2)
    self%n_direct = counts(3)
    self%kind = counts(4)
    self%cost_of_factors = costs(1)
    self%cost_of_analysis = costs(2)
    self%cost_of_iteration = costs(3)
    self%rate = costs(4)
    self%excess = costs(5)

    self%is_due = self%is_due .or. .not. snapshot%has(SAVED_VALUES)
    if (self%is_due) return
    associate (factor => self%system%factor, layout => self%system%layout)
      call self%analyse(matrix, counts(5), status)
      if (status%failed()) return
      call factor%get_matrix(values, scale)
      lost = 0
      if (snapshot%count(SAVED_VALUES) /= size(values) &
          .or. snapshot%count(SAVED_SCALE) /= size(scale)) lost = 1
      call layout%comm%max(lost)
      self%is_due = lost > 0
      if (self%is_due) return
      call snapshot%get(SAVED_VALUES, values, status, OF_RANK)
      call snapshot%get(SAVED_SCALE, scale, status, OF_RANK)
      call layout%comm%agree(status)
      if (status%failed()) return
      call self%times%begin(PHASE_FACTORISATION)
      call factor%restore(values, scale, status)
      call self%times%end(PHASE_FACTORISATION)
      call layout%comm%agree(status)
    end associate

  end subroutine lagged_load

  subroutine lagged_free(self)
    class(lagged_solver_t), intent(inout) :: self

    call self%system%factor%free()
    call self%direct%free()

  end subroutine lagged_free

  !> A line for the log.
  subroutine note(solver, line)
    type(lagged_solver_t), intent(inout) :: solver
    character(len=*), intent(in) :: line

    solver%decisions = solver%decisions//new_line('a')//'linear solver: '//line

  end subroutine note

  subroutine weighted_system_multiply(self, x, y)
    class(weighted_system_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: x(:)
    real(wp), contiguous, intent(out) :: y(:)

    associate (n_own => self%layout%n_own_node)
      self%before(:, :n_own) = reshape(x, [self%layout%n_slot, n_own])
      call self%layout%halo%update(self%before)
      call self%matrix%multiply(self%layout%halo, self%before, self%after)
      call weigh(self%weight, self%after(:, :n_own), y)
    end associate

  end subroutine weighted_system_multiply

  subroutine weighted_system_precondition(self, x, y, status)
    class(weighted_system_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: x(:)
    real(wp), contiguous, intent(out) :: y(:)
    type(status_t), intent(inout) :: status

    integer :: i

    associate (n_slot => self%layout%n_slot, n_own => self%layout%n_own_node)
      do i = 1, n_own
        self%before(:, i) = x(n_slot * (i - 1) + 1:n_slot * i) / self%weight
      end do
      call self%factor%solve(self%layout, self%before, self%after, status)
      y = reshape(self%after(:, :n_own), [n_slot * n_own])
    end associate

  end subroutine weighted_system_precondition

  subroutine weighted_system_sum(self, values)
    class(weighted_system_t), intent(in) :: self
    real(wp), contiguous, intent(inout) :: values(:)

    if (self%layout%comm%size > 1) call self%layout%comm%sum(values)

  end subroutine weighted_system_sum

  !> y = weight x for each slot.
  pure subroutine weigh(weight, x, y)
    real(wp), intent(in) :: weight(:)
    real(wp), intent(in) :: x(:, :)
    !> Node by node.
    real(wp), intent(out) :: y(:)

    integer :: c, i, k

    k = 0
    do i = 1, size(x, 2)
      do c = 1, size(x, 1)
        k = k + 1
        y(k) = weight(c) * x(c, i)
      end do
    end do

  end subroutine weigh

end module swage_mumps_lagged
