!> What the assertions of the running test have found on this rank.
!>
!> The assertions of pFUnit's syntax get no object to write to, hence the only module variables of
!> the project: the list of failures belongs to the process, as the running test does.
module swage_test_failures
  use, intrinsic :: iso_fortran_env, only: output_unit
  implicit none(type, external)
  private

  public :: SourceLocation, anyExceptions, clear_failures, label_failures, record_failure

  !> Place of an assertion in its `.pf` file.
  type :: SourceLocation
    character(len=128) :: file = ''
    integer :: line = 0
  end type SourceLocation

  integer :: n_failure = 0
  character(len=64) :: label = ''

contains

  !> True once an assertion of the running test has failed on this rank.
  function anyExceptions() result(any_failed)
    logical :: any_failed

    any_failed = n_failure > 0

  end function anyExceptions

  !> Forget the failures of the previous test.
  subroutine clear_failures()

    n_failure = 0

  end subroutine clear_failures

  !> Words that tell the rank, printed with each failure from now on; blank for none.
  subroutine label_failures(text)
    character(len=*), intent(in) :: text

    label = text

  end subroutine label_failures

  !> Count a failed assertion and print it at once, so that it is seen even if another rank then
  !> waits for ever in a collective that this one has left.
  subroutine record_failure(what, message, location)
    character(len=*), intent(in) :: what
    !> The author's own words, from the directive.
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    character(len=:), allocatable :: line
    character(len=16) :: number

    n_failure = n_failure + 1
    line = '  '
    if (present(location)) then
      write (number, '(i0)') location%line
      line = line // trim(location%file) // ':' // trim(number) // ': '
    end if
    if (label /= '') line = line // trim(label) // ': '
    line = line // what
    if (present(message)) then
      if (message /= '') line = line // ' (' // trim(message) // ')'
    end if
    write (output_unit, '(a)') line
    flush (output_unit)

  end subroutine record_failure

end module swage_test_failures
