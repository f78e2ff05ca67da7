!> Outcome of an operation that can fail.
module swage_status
  implicit none(type, external)
  private

  public :: status_t
  public :: STATUS_OK, STATUS_RETRY, STATUS_ERROR
  public :: EXIT_DONE, EXIT_INPUT, EXIT_MESH, EXIT_CONVERGENCE, EXIT_SOLVER, EXIT_FILE
  public :: EXIT_STOPPED

  !> The operation succeeded.
  integer, parameter :: STATUS_OK = 0
  !> It failed, but a shorter time step may succeed: the stepper cuts back and repeats.
  integer, parameter :: STATUS_RETRY = 1
  !> It failed and repeating cannot help: the driver reports it and ends the run.
  integer, parameter :: STATUS_ERROR = 2

  !> Exit codes of the program; a failure carries the one it deserves.
  integer, parameter :: EXIT_DONE = 0
  !> Faulty input file.
  integer, parameter :: EXIT_INPUT = 2
  !> Faulty mesh.
  integer, parameter :: EXIT_MESH = 3
  !> No convergence at the smallest time step.
  integer, parameter :: EXIT_CONVERGENCE = 4
  !> The linear solver failed or memory ran out.
  integer, parameter :: EXIT_SOLVER = 5
  !> A file cannot be written or read.
  integer, parameter :: EXIT_FILE = 6
  !> Stopped on request; a restart file was written, from which the run can go on.
  integer, parameter :: EXIT_STOPPED = 75

  !> Severity, exit code, origin and message. The lengths are fixed so that a status can be raised
  !> in a `pure` procedure and broadcast without negotiating a length.
  type :: status_t
    !> One of the `STATUS_*` values.
    integer :: severity = STATUS_OK
    !> One of the `EXIT_*` values: how the program ends if nobody can help.
    integer :: exit_code = EXIT_DONE
    !> Procedure that raised it.
    character(len=64) :: origin = ''
    !> What is wrong, with the offending value, and what would be right.
    character(len=1024) :: message = ''
  contains
    !> True unless the severity is `STATUS_OK`.
    procedure :: failed => status_failed
    !> Record a failure. The first one wins: later ones are usually its consequences.
    procedure :: raise => status_raise
    !> Forget a failure that has been dealt with, as a step that was cut.
    procedure :: clear => status_clear
  end type status_t

contains

  elemental function status_failed(self) result(failed)
    class(status_t), intent(in) :: self
    logical :: failed

    failed = self%severity /= STATUS_OK

  end function status_failed

  pure subroutine status_raise(self, severity, origin, message, exit_code)
    class(status_t), intent(inout) :: self
    integer, intent(in) :: severity
    character(len=*), intent(in) :: origin
    character(len=*), intent(in) :: message
    !> `EXIT_INPUT` when absent.
    integer, intent(in), optional :: exit_code

    if (self%failed()) return
    self%severity = severity
    self%origin = origin
    self%message = message
    self%exit_code = EXIT_INPUT
    if (present(exit_code)) self%exit_code = exit_code

  end subroutine status_raise

  pure subroutine status_clear(self)
    class(status_t), intent(inout) :: self

    self%severity = STATUS_OK
    self%exit_code = EXIT_DONE
    self%origin = ''
    self%message = ''

  end subroutine status_clear

end module swage_status
