!> Newton's iterations near the solution, at three states of a run: quadratic convergence.
!>
!> usage: verify_newton CASE.nml LABEL
!>
!> The error e is the larger of the relative errors of forces and volume. Full corrections are
!> taken; a pair (e_k, e_k+1) counts when e_k^2 is above rounding and no node changed contact in
!> its two evaluations. The last two such pairs must have e_k+1 <= C e_k^2 with one C for all.
program verify_newton
  use swage, only: comm_t, environment_start, environment_stop, simulation_t, status_t, wp
  use swage_test_rows, only: print_row
  use swage_text, only: text
  implicit none(type, external)

  !> C. A tangent that lacks a term makes e fall by a factor of about 10 an iteration: with e_k
  !> about 1e-5 before the last pair that is a C of 1e4.
  real(wp), parameter :: LARGEST_FACTOR = 100.0_wp
  !> Squares of errors below this one are lost in rounding.
  real(wp), parameter :: LEAST_ERROR = 1.0e-6_wp
  !> Corrections at each state, and how small the last error must be.
  integer, parameter :: N_CORRECTION = 12
  real(wp), parameter :: FINISHED = 1.0e-10_wp
  !> What the solution of a correction may leave, of its right-hand side.
  real(wp), parameter :: EXACT = 1.0e-10_wp
  !> States, by the end of the run.
  real(wp), parameter :: STATES(3) = [0.2_wp, 0.5_wp, 0.8_wp]
  type(comm_t) :: comm
  type(simulation_t) :: simulation
  type(status_t) :: status
  integer :: i

  call environment_start(comm)
  call simulation%start(argument(1), comm, status)
  do i = 1, size(STATES)
    if (status%failed()) exit
    call simulation%advance_to(STATES(i) * simulation%get_end(), status)
    if (.not. status%failed()) call try_step(simulation, 0.02_wp * simulation%get_end(), status)
  end do
  call simulation%finish(status)
  call environment_stop()
  if (status%failed()) error stop status%message

contains

  !> Iterate at one step without taking it.
  subroutine try_step(simulation, dt, status)
    type(simulation_t), intent(inout) :: simulation
    !> [time]
    real(wp), intent(in) :: dt
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: name
    real(wp) :: error(0:N_CORRECTION), factor
    integer :: changed(0:N_CORRECTION), i, k, n, n_pair

    associate (problem => simulation%mechanics, time => simulation%get_time())
      ! Twice as long as the steps before: the extrapolated rate would leave too little to correct
      call problem%begin_step(time, time + 2.0_wp * dt, .true., status)
      n = -1
      do k = 0, N_CORRECTION
        if (status%failed()) return
        if (k > 0) then
          problem%linear_tolerance = EXACT
          call problem%correct(status)
          call problem%move(1.0_wp)
        end if
        call problem%evaluate(status)
        error(k) = maxval(problem%errors)
        changed(k) = 0
        do i = 1, size(problem%contacts)
          changed(k) = changed(k) &
            + count(problem%contacts(i)%active .neqv. problem%contacts(i)%was_active)
        end do
        n = k
        if (error(k) < FINISHED) exit
      end do
      call problem%reject_step()
      name = argument(2)//' at '//text(time)//' s: '
    end associate
    if (status%failed()) return

    call print_row(name//'error after '//text(n)//' corrections', error(n), 0.0_wp, error(n), &
                   FINISHED)
    factor = 0.0_wp
    n_pair = 0
    do k = n - 1, 0, -1
      if (n_pair == 2 .or. changed(k + 1) > 0 .or. (k > 0 .and. changed(k) > 0)) exit
      if (error(k) < LEAST_ERROR) cycle
      n_pair = n_pair + 1
      factor = max(factor, error(k + 1) / error(k)**2)
    end do
    call print_row(name//'pairs with contact unchanged', real(n_pair, wp), 2.0_wp, &
                   real(2 - n_pair, wp), 0.0_wp)
    call print_row(name//'C of e(k+1) = C e(k)^2', factor, LARGEST_FACTOR, &
                   max(factor - LARGEST_FACTOR, 0.0_wp), 0.0_wp)

  end subroutine try_step

  !> Of the command line.
  function argument(i) result(word)
    integer, intent(in) :: i
    character(len=:), allocatable :: word

    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(len=length) :: word)
    call get_command_argument(i, word)

  end function argument

end program verify_newton
