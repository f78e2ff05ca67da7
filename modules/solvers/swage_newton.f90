!> Newton iterations with a line search, for any problem that can evaluate itself.
module swage_newton
  use swage_kinds, only: wp
  use swage_status, only: EXIT_CONVERGENCE, status_t, STATUS_RETRY
  implicit none(type, external)
  private

  public :: newton_control_t, newton_problem_t, newton_report_t, newton_solve, N_FIELD

  !> Fields with an error of their own: equilibrium and volume.
  integer, parameter :: N_FIELD = 2
  !> Longest history of a report.
  integer, parameter :: MAXIMUM_HISTORY = 100
  !> Halvings of a correction before the last one is taken for better or worse.
  integer, parameter :: MAXIMUM_HALVINGS = 5

  !> Most that the solution of a correction may leave of its right-hand side, and the share of the
  !> tolerance that it may leave of an error.
  real(wp), parameter :: LARGEST_SHARE = 1.0e-2_wp
  real(wp), parameter :: MARGIN = 0.1_wp
  !> Errors from which corrections are uncertain enough [1], and what their solution may leave then,
  !> and of one that imposes motion. What is left there sends soft parts astray: with 1e-4 the first
  !> step of a plastic billet takes the 9 iterations that exact solutions take, under an elastic
  !> tool (30 thousand nodes) and under a rigid one (10 thousand). With 1e-3 the latter was cut
  !> once, with 3e-3, and 0.1 for the motion, the former three times.
  real(wp), parameter :: FAR = 0.1_wp
  real(wp), parameter :: FAR_SHARE = 1.0e-4_wp

  !> When to stop.
  type :: newton_control_t
    !> Largest error of each field [1]; the first one holds for the work, too.
    real(wp) :: tolerance(N_FIELD) = 1.0e-4_wp
    !> Iterations after which the step is given up, or since the last change of the problem by
    !> [[newton_problem_t:augment]].
    integer :: maximum_iterations = 20
  end type newton_control_t

  !> What happened.
  type :: newton_report_t
    !> Corrections computed.
    integer :: n_iteration = 0
    !> Relative errors before the first and after each correction; shape (N_FIELD, 0:).
    real(wp) :: errors(N_FIELD, 0:MAXIMUM_HISTORY) = 0.0_wp
    !> Share of each correction that was taken.
    real(wp) :: step_length(MAXIMUM_HISTORY) = 0.0_wp
  end type newton_report_t

  !> A problem in the unknowns of one step. It holds its unknowns, residual and tangent.
  type, abstract :: newton_problem_t
    !> Relative errors of the last evaluation [1].
    real(wp) :: errors(N_FIELD) = 0.0_wp
    !> Work of the residual over the step by that of the step [1]: what a balance of energy misses.
    !> Large where a body moves much and strains little; it is no merit of a correction.
    real(wp) :: work_error = 0.0_wp
    !> What the errors are relative to: sizes of forces and volumes, positive.
    real(wp) :: scales(N_FIELD) = 1.0_wp
    !> What the next correction may leave of its right-hand side [1], 0 for nothing.
    real(wp) :: linear_tolerance = 1.0e-10_wp
    !> True while prescribed values wait to be imposed by the next correction.
    logical :: has_pending_values = .false.
    !> True when the problem has a safe tangent besides the exact one, which may lead nowhere.
    logical :: has_safe_tangent = .false.
    !> True when the next correction shall take it: the last one, however short, did not reduce the
    !> errors.
    logical :: needs_safe_tangent = .false.
    !> True when converged unknowns that were refused need a correction, however small their errors;
    !> until it is made.
    logical :: asks_for_correction = .false.
  contains
    !> Collective. Residual, errors and tangent at the present unknowns.
    procedure(evaluate_problem), deferred :: evaluate
    !> Collective. Solve for the correction, and remember the present unknowns.
    procedure(correct_problem), deferred :: correct
    !> Set the unknowns to the remembered ones plus a share of the correction.
    procedure(move_unknowns), deferred :: move
    !> Collective. Where the error is worst, for messages.
    procedure(worst_place), deferred :: describe_worst
    !> Collective. Judge converged unknowns.
    procedure :: augment => accept_converged
    !> Collective. Largest share of the last correction that can be trusted [1], at most 1.
    procedure :: trusted_share => whole_correction
  end type newton_problem_t

  abstract interface
    subroutine evaluate_problem(self, status)
      import :: newton_problem_t, status_t
      implicit none(type, external)
      class(newton_problem_t), intent(inout) :: self
      !> `STATUS_RETRY`, the same on all ranks, when a cell is inverted or a law fails.
      type(status_t), intent(inout) :: status
    end subroutine evaluate_problem

    subroutine correct_problem(self, status)
      import :: newton_problem_t, status_t
      implicit none(type, external)
      class(newton_problem_t), intent(inout) :: self
      type(status_t), intent(inout) :: status
    end subroutine correct_problem

    subroutine move_unknowns(self, step_length)
      import :: newton_problem_t, wp
      implicit none(type, external)
      class(newton_problem_t), intent(inout) :: self
      !> 1 for the whole correction.
      real(wp), intent(in) :: step_length
    end subroutine move_unknowns

    function worst_place(self) result(place)
      import :: newton_problem_t
      implicit none(type, external)
      class(newton_problem_t), intent(in) :: self
      character(len=:), allocatable :: place
    end function worst_place
  end interface

contains

  !> Collective. Iterate from the present unknowns until all errors are within tolerance.
  !>
  !> How much of a correction is taken, a line search decides; all of one that imposes prescribed
  !> values.
  subroutine newton_solve(problem, control, report, status)
    class(newton_problem_t), intent(inout) :: problem
    type(newton_control_t), intent(in) :: control
    type(newton_report_t), intent(out) :: report
    !> `STATUS_RETRY` when the step must be cut; the message says where it hurts most.
    type(status_t), intent(inout) :: status

    type(status_t) :: trial
    real(wp) :: before(N_FIELD), merit, scales(N_FIELD), step_length
    integer :: iteration, last_augmentation
    logical :: done, may_grow, reduced, was_safe

    problem%needs_safe_tangent = .false.
    problem%asks_for_correction = .false.
    call problem%evaluate(status)
    if (status%failed()) return
    report%errors(:, 0) = problem%errors

    iteration = 0
    last_augmentation = 0
    do
      do while (all(problem%errors <= control%tolerance) &
                .and. problem%work_error <= control%tolerance(1) &
                .and. .not. problem%has_pending_values)
        call problem%augment(done, status)
        if (done .or. status%failed()) return
        last_augmentation = iteration
        call problem%evaluate(status)
        if (status%failed()) return
        if (problem%asks_for_correction) exit
      end do
      if (iteration - last_augmentation >= control%maximum_iterations &
          .or. iteration >= MAXIMUM_HISTORY) exit
      iteration = iteration + 1

      merit = norm2(problem%errors)
      scales = problem%scales
      ! The first correction imposes motion: errors before it tell nothing
      before = 0.0_wp
      if (iteration > last_augmentation + 2) before = report%errors(:, iteration - 2)
      problem%linear_tolerance = FAR_SHARE
      if (.not. problem%has_pending_values) then
        problem%linear_tolerance = forcing(problem%errors, before, control%tolerance)
      end if
      ! Errors are relative to the step's motion, and mean nothing before it is imposed
      may_grow = problem%has_pending_values
      call problem%correct(status)
      problem%asks_for_correction = .false.
      if (status%failed()) return

      was_safe = problem%needs_safe_tangent
      call search_line(problem, control%tolerance, merit, scales, may_grow, step_length, reduced, &
                       trial)
      problem%needs_safe_tangent = .not. reduced
      if (.not. reduced .and. problem%has_safe_tangent .and. .not. was_safe) then
        step_length = 0.0_wp
        call problem%move(step_length)
        call trial%clear()
        call problem%evaluate(trial)
      end if
      report%n_iteration = iteration
      report%errors(:, iteration) = problem%errors
      report%step_length(iteration) = step_length
      if (trial%failed()) then
        status = trial
        return
      end if
    end do

    call status%raise(STATUS_RETRY, 'newton_solve', 'no convergence: '//problem%describe_worst(), &
                      EXIT_CONVERGENCE)

  end subroutine newton_solve

  !> Collective. Find how much of the last correction to take, and take it: the largest share,
  !> halved from the trusted one, that reduces the residual.
  subroutine search_line(problem, tolerance, merit, scales, may_grow, step_length, reduced, status)
    class(newton_problem_t), intent(inout) :: problem
    real(wp), intent(in) :: tolerance(:)
    !> Norm of the errors, and the scales, before the correction.
    real(wp), intent(in) :: merit
    real(wp), intent(in) :: scales(:)
    !> Take the whole correction if it can be evaluated.
    logical, intent(in) :: may_grow
    !> The share taken [1].
    real(wp), intent(out) :: step_length
    !> False when no share was good, and the last one was taken.
    logical, intent(out) :: reduced
    !> Of the last evaluation.
    type(status_t), intent(inout) :: status

    integer :: halving

    reduced = .false.
    step_length = 1.0_wp
    if (.not. may_grow) step_length = problem%trusted_share()
    do halving = 0, MAXIMUM_HALVINGS
      call problem%move(step_length)
      call status%clear()
      call problem%evaluate(status)
      if (.not. status%failed()) then
        reduced = may_grow .or. all(problem%errors <= tolerance) &
          .or. norm2(problem%errors * growth_of(problem%scales, scales)) < merit
        if (reduced) exit
      end if
      if (halving < MAXIMUM_HALVINGS) step_length = 0.5_wp * step_length
    end do

  end subroutine search_line

  !> Factors that turn relative errors into residuals by the scales before the correction. Forces
  !> are always compared so: an error relative to those of a tool driven into the body would call
  !> that a success. The scale of volumes grows with the motion of the step, as it should; only its
  !> fall counts, as in a body that turns without strain.
  pure function growth_of(scales, before) result(factors)
    real(wp), intent(in) :: scales(N_FIELD)
    real(wp), intent(in) :: before(N_FIELD)
    real(wp) :: factors(N_FIELD)

    factors = scales / before
    factors(2) = min(factors(2), 1.0_wp)

  end function growth_of

  !> Collective. Converged unknowns are the solution, unless a problem has more to ask.
  subroutine accept_converged(self, done, status)
    class(newton_problem_t), intent(inout) :: self
    !> False when the problem has changed and the iterations must go on. They may do so
    !> `maximum_iterations` times after each change.
    logical, intent(out) :: done
    !> `STATUS_RETRY`, the same on all ranks, when the problem gives the step up.
    type(status_t), intent(inout) :: status

    done = .not. self%has_pending_values .and. .not. status%failed()

  end subroutine accept_converged

  !> How accurate the next correction must be: no more than the errors will fall by Newton's own
  !> convergence, judged by their last fall (Eisenstat and Walker, 1996), and no more than is
  !> wanted.
  pure function forcing(now, before, tolerance) result(share)
    !> Errors now and before the last correction; the latter are 0 when they tell nothing.
    real(wp), intent(in) :: now(:)
    real(wp), intent(in) :: before(:)
    real(wp), intent(in) :: tolerance(:)
    real(wp) :: share

    share = merge(FAR_SHARE, LARGEST_SHARE, maxval(now) > FAR)
    if (any(before > 0.0_wp)) then
      share = min(share, (maxval(now / tolerance) / maxval(before / tolerance))**2)
    end if
    share = max(share, MARGIN / max(maxval(now / tolerance), 1.0_wp))

  end function forcing

  !> A problem that cannot tell trusts its tangent.
  function whole_correction(self) result(share)
    class(newton_problem_t), intent(in) :: self
    real(wp) :: share

    associate (unused => self)
    end associate
    share = 1.0_wp

  end function whole_correction

end module swage_newton
