!> How long the parts of a run take: CPU and wall-clock seconds of this rank, by phase.
module swage_phase_times
  use swage_kinds, only: gp, wp
  implicit none(type, external)
  private

  public :: phase_times_t, PHASE_NAMES
  public :: PHASE_CELLS, PHASE_CONTACT, PHASE_ORDERING, PHASE_FACTORISATION, PHASE_SOLUTION, &
    PHASE_OUTPUT

  integer, parameter :: PHASE_CELLS = 1
  integer, parameter :: PHASE_CONTACT = 2
  !> Elimination order and analysis of the pattern.
  integer, parameter :: PHASE_ORDERING = 3
  integer, parameter :: PHASE_FACTORISATION = 4
  integer, parameter :: PHASE_SOLUTION = 5
  !> Results, history and checkpoints.
  integer, parameter :: PHASE_OUTPUT = 6

  !> What reports call the phases, in the order of their numbers.
  character(len=*), parameter :: PHASE_NAMES(*) = [character(len=13) :: 'cells', 'contact', &
                                                   'ordering', 'factorisation', 'solution', &
                                                   'output']

  !> Sums since the start. Phases follow each other: one that begins inside another is no fault,
  !> but counts twice. No decision may depend on these numbers.
  type :: phase_times_t
    !> [s]; shape (n_phase).
    real(wp) :: cpu(size(PHASE_NAMES)) = 0.0_wp
    real(wp) :: wall(size(PHASE_NAMES)) = 0.0_wp
    real(wp), private :: cpu_start(size(PHASE_NAMES)) = 0.0_wp
    integer(gp), private :: wall_start(size(PHASE_NAMES)) = 0_gp
  contains
    !> A phase begins.
    procedure :: begin => phase_times_begin
    !> It ends.
    procedure :: end => phase_times_end
  end type phase_times_t

contains

  subroutine phase_times_begin(self, phase)
    class(phase_times_t), intent(inout) :: self
    !> One of the constants above.
    integer, intent(in) :: phase

    call cpu_time(self%cpu_start(phase))
    call system_clock(self%wall_start(phase))

  end subroutine phase_times_begin

  subroutine phase_times_end(self, phase)
    class(phase_times_t), intent(inout) :: self
    integer, intent(in) :: phase

    integer(gp) :: count, count_rate
    real(wp) :: cpu

    call cpu_time(cpu)
    call system_clock(count, count_rate)
    self%cpu(phase) = self%cpu(phase) + cpu - self%cpu_start(phase)
    self%wall(phase) = self%wall(phase) &
      + real(count - self%wall_start(phase), wp) / real(count_rate, wp)

  end subroutine phase_times_end

end module swage_phase_times
