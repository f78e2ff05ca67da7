!> Numbers and logical values as users write and read them.
module swage_number
  use swage_finite, only: is_finite
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: read_real, read_integer, read_logical, number_text

  character(len=*), parameter :: DIGITS = '0123456789'

  !> Decimal magnitudes that double precision holds with all its digits: a value lies between
  !> `10**(magnitude - 1)` and `10**magnitude`.
  integer, parameter :: SMALLEST_MAGNITUDE = -306
  integer, parameter :: LARGEST_MAGNITUDE = 308

contains

  !> A real number as Fortran writes it: `5`, `-5.`, `.5`, `2.1e11`, `1d-3`; neither NaN nor
  !> infinity.
  pure subroutine read_real(word, value, fault)
    character(len=*), intent(in) :: word
    !> Unchanged when there is a fault.
    real(wp), intent(inout) :: value
    !> What the word must be; empty when all is well.
    character(len=:), allocatable, intent(out) :: fault

    real(wp) :: number
    integer :: code, magnitude
    logical :: is_number

    fault = 'must be a number'
    call examine_real(word, is_number, magnitude)
    if (.not. is_number) return

    ! Checked beforehand: reading 1e400 would stop a program that traps overflow
    if (magnitude < SMALLEST_MAGNITUDE .or. magnitude > LARGEST_MAGNITUDE) then
      fault = 'must be 0 or a number between 1e-306 and 1e308 in size'
      return
    end if
    read (word, *, iostat=code) number
    if (code /= 0) return
    value = number
    fault = ''

  end subroutine read_real

  !> A whole number: `12`, `-3`, `+4`.
  pure subroutine read_integer(word, value, fault)
    character(len=*), intent(in) :: word
    !> Unchanged when there is a fault.
    integer, intent(inout) :: value
    !> What the word must be; empty when all is well.
    character(len=:), allocatable, intent(out) :: fault

    integer :: code, first, number

    fault = 'must be a whole number'
    first = 1
    if (scan(word, '+-') == 1) first = 2
    if (first > len(word)) return
    if (verify(word(first:), DIGITS) > 0) return

    read (word, *, iostat=code) number
    if (code /= 0) then
      fault = 'must be a whole number up to '//number_text(real(huge(1), wp))//' in size'
      return
    end if
    value = number
    fault = ''

  end subroutine read_integer

  !> A logical value: `.true.`, `true`, `.t.`, `t` and their opposites, in either case.
  pure subroutine read_logical(word, value, fault)
    character(len=*), intent(in) :: word
    !> Unchanged when there is a fault.
    logical, intent(inout) :: value
    !> What the word must be; empty when all is well.
    character(len=:), allocatable, intent(out) :: fault

    fault = ''
    select case (word)
    case ('.true.', '.TRUE.', '.True.', 'true', 'TRUE', 'True', '.t.', '.T.', 't', 'T')
      value = .true.
    case ('.false.', '.FALSE.', '.False.', 'false', 'FALSE', 'False', '.f.', '.F.', 'f', 'F')
      value = .false.
    case default
      fault = 'must be .true. or .false.'
    end select

  end subroutine read_logical

  !> The shortest usual form of a number, to ten digits: `0`, `-5`, `0.3`, `2.1e11`.
  pure function number_text(value) result(string)
    real(wp), intent(in) :: value
    character(len=:), allocatable :: string

    character(len=32) :: buffer, format
    integer :: exponent, mark

    if (.not. is_finite(value)) then
      string = 'not a finite number'
      return
    end if
    if (abs(value) <= 0.0_wp) then
      string = '0'
      return
    end if

    write (buffer, '(es18.9e3)') value
    mark = index(buffer, 'E')
    read (buffer(mark + 1:), *) exponent
    if (exponent >= -3 .and. exponent <= 9) then
      write (format, '(a,i0,a)') '(f32.', 9 - exponent, ')'
      write (buffer, format) value
      string = without_zeros(buffer)
    else
      string = without_zeros(buffer(:mark - 1))
      write (buffer, '(i0)') exponent
      string = string//'e'//trim(buffer)
    end if

  end function number_text

  !> Whether a word is a real number, and the power of ten just above it.
  pure subroutine examine_real(word, is_number, magnitude)
    character(len=*), intent(in) :: word
    logical, intent(out) :: is_number
    !> 0 for zero.
    integer, intent(out) :: magnitude

    character(len=:), allocatable :: fraction, whole
    integer, parameter :: BEYOND = 1000000

    integer :: code, exponent, mark, point, start

    is_number = .false.
    magnitude = 0
    start = 1
    if (scan(word, '+-') == 1) start = 2

    mark = scan(word, 'eEdD')
    if (mark == 0) mark = len(word) + 1
    if (mark <= start) return
    point = index(word(:mark - 1), '.')
    if (point == 0) point = mark
    whole = word(start:point - 1)
    fraction = word(point + 1:mark - 1)
    if (len(whole) + len(fraction) == 0) return
    if (verify(whole//fraction, DIGITS) > 0) return

    exponent = 0
    if (mark <= len(word)) then
      start = mark + 1
      if (scan(word(start:), '+-') == 1) start = start + 1
      if (start > len(word)) return
      if (verify(word(start:), DIGITS) > 0) return
      read (word(mark + 1:), *, iostat=code) exponent
      if (code /= 0) exponent = BEYOND
      if (code /= 0 .and. word(mark + 1:mark + 1) == '-') exponent = -BEYOND
      exponent = max(-BEYOND, min(BEYOND, exponent))
    end if
    is_number = .true.

    if (verify(whole//fraction, '0') == 0) return
    start = verify(whole, '0')
    if (start > 0) then
      magnitude = exponent + len(whole) - start + 1
    else
      magnitude = exponent - verify(fraction, '0') + 1
    end if

  end subroutine examine_real

  !> A decimal without blanks, without the zeros at its end and without a point there.
  pure function without_zeros(decimal) result(short)
    character(len=*), intent(in) :: decimal
    character(len=:), allocatable :: short

    short = trim(adjustl(decimal))
    if (index(short, '.') == 0) return
    short = short(:verify(short, '0', back=.true.))
    if (short(len(short):) == '.') short = short(:len(short) - 1)

  end function without_zeros

end module swage_number
