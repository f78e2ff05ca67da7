!> Signals that ask a run to save itself, noted for a moment when it can.
!>
!> `SIGUSR1` asks for a restart file, `SIGTERM` for one and the end. The handler sets a flag, which
!> is all that may be done while anything may be interrupted. The numbers are those of Linux.
module swage_signals
  use, intrinsic :: iso_c_binding, only: c_funloc, c_funptr, c_int, c_intptr_t
  implicit none(type, external)
  private

  public :: watch_signals, take_signals

  integer(c_int), parameter :: SIGUSR1 = 10_c_int
  integer(c_int), parameter :: SIGTERM = 15_c_int
  integer(c_int), parameter :: SIGXFSZ = 25_c_int

  !> C's SIG_DFL and SIG_IGN.
  integer(c_intptr_t), parameter :: DEFAULT = 0_c_intptr_t
  integer(c_intptr_t), parameter :: IGNORE = 1_c_intptr_t

  ! A handler has no arguments of its own: the exception to the rule against module variables
  integer(c_int), volatile :: save_asked = 0_c_int
  integer(c_int), volatile :: end_asked = 0_c_int

  interface
    !> C: what to do about a signal. In glibc the handler stays, and interrupted system calls go on.
    function c_signal(number, handler) result(old) bind(C, name='signal')
      import :: c_funptr, c_int
      implicit none(type, external)
      integer(c_int), value, intent(in) :: number
      type(c_funptr), value, intent(in) :: handler
      type(c_funptr) :: old
    end function c_signal
  end interface

contains

  !> Begin to note signals; a main program calls this, or does not. A file that grows beyond the
  !> limit of the shell is then an error like a full disk, and no longer the end of the program.
  subroutine watch_signals()

    type(c_funptr) :: ignored

    save_asked = 0_c_int
    end_asked = 0_c_int
    ignored = c_signal(SIGUSR1, c_funloc(note_signal))
    ignored = c_signal(SIGTERM, c_funloc(note_signal))
    ignored = c_signal(SIGXFSZ, transfer(IGNORE, ignored))

  end subroutine watch_signals

  !> What was asked for since the last call. A signal that comes afterwards is for the next one.
  subroutine take_signals(save_is_asked, end_is_asked)
    !> True when a restart file is wanted.
    logical, intent(out) :: save_is_asked
    !> True when the run is to end.
    logical, intent(out) :: end_is_asked

    save_is_asked = save_asked /= 0_c_int
    if (save_is_asked) save_asked = 0_c_int
    end_is_asked = end_asked /= 0_c_int
    if (end_is_asked) end_asked = 0_c_int

  end subroutine take_signals

  !> The handler. Who asks for the end a second time will not wait for the increment.
  subroutine note_signal(number) bind(C, name='swage_note_signal')
    integer(c_int), value, intent(in) :: number

    type(c_funptr) :: ignored

    if (number == SIGTERM) then
      end_asked = 1_c_int
      ignored = c_signal(SIGTERM, transfer(DEFAULT, ignored))
    else
      save_asked = 1_c_int
    end if

  end subroutine note_signal

end module swage_signals
