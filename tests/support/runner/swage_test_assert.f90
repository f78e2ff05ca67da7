!> The assertions that `.pf` files may use, with the names and keywords of pFUnit.
!>
!> A scalar `expected` is compared with every element of `actual`. NaN equals nothing, itself
!> included, and passes no comparison.
module swage_test_assert
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  use, intrinsic :: iso_fortran_env, only: int64, real64
  use swage_test_failures, only: record_failure, SourceLocation
  use swage_test_value, only: KIND_INTEGER, KIND_REAL, test_value_t
  implicit none(type, external)
  private

  public :: assertEqual, assertRelativelyEqual
  public :: assertTrue, assertFalse
  public :: assertLessThan, assertLessThanOrEqual
  public :: assertGreaterThan, assertGreaterThanOrEqual

contains

  !> The condition holds.
  subroutine assertTrue(condition, message, location)
    logical, intent(in) :: condition
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. condition) call record_failure('expected true, got false', message, location)

  end subroutine assertTrue

  !> The condition does not hold.
  subroutine assertFalse(condition, message, location)
    logical, intent(in) :: condition
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (condition) call record_failure('expected false, got true', message, location)

  end subroutine assertFalse

  !> |expected - actual| <= tolerance
  subroutine assertEqual(expected, actual, tolerance, message, location)
    type(test_value_t), intent(in) :: expected
    type(test_value_t), intent(in) :: actual
    !> 0 when absent.
    type(test_value_t), intent(in), optional :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    real(real64) :: absolute

    absolute = 0.0_real64
    if (present(tolerance)) then
      if (.not. bounds(tolerance, message, location)) return
      absolute = tolerance%reals(1)
    end if
    call compare(expected, '==', actual, absolute, 0.0_real64, message, location)

  end subroutine assertEqual

  !> |expected - actual| <= tolerance |expected|
  subroutine assertRelativelyEqual(expected, actual, tolerance, message, location)
    type(test_value_t), intent(in) :: expected
    type(test_value_t), intent(in) :: actual
    type(test_value_t), intent(in) :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. bounds(tolerance, message, location)) return
    call compare(expected, '==', actual, 0.0_real64, tolerance%reals(1), message, location)

  end subroutine assertRelativelyEqual

  !> a < b
  subroutine assertLessThan(a, b, message, location)
    type(test_value_t), intent(in) :: a
    type(test_value_t), intent(in) :: b
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call compare(a, '<', b, 0.0_real64, 0.0_real64, message, location)

  end subroutine assertLessThan

  !> a <= b
  subroutine assertLessThanOrEqual(a, b, message, location)
    type(test_value_t), intent(in) :: a
    type(test_value_t), intent(in) :: b
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call compare(a, '<=', b, 0.0_real64, 0.0_real64, message, location)

  end subroutine assertLessThanOrEqual

  !> a > b
  subroutine assertGreaterThan(a, b, message, location)
    type(test_value_t), intent(in) :: a
    type(test_value_t), intent(in) :: b
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call compare(a, '>', b, 0.0_real64, 0.0_real64, message, location)

  end subroutine assertGreaterThan

  !> a >= b
  subroutine assertGreaterThanOrEqual(a, b, message, location)
    type(test_value_t), intent(in) :: a
    type(test_value_t), intent(in) :: b
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call compare(a, '>=', b, 0.0_real64, 0.0_real64, message, location)

  end subroutine assertGreaterThanOrEqual

  !> True when `tolerance` is one real that is not negative; records a failure otherwise.
  function bounds(tolerance, message, location) result(usable)
    type(test_value_t), intent(in) :: tolerance
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    logical :: usable

    usable = .false.
    if (tolerance%kind == KIND_REAL .and. tolerance%size == 1) then
      if (.not. ieee_is_nan(tolerance%reals(1))) usable = tolerance%reals(1) >= 0.0_real64
    end if
    if (.not. usable) then
      call record_failure('the tolerance must be one real, not negative', message, location)
    end if

  end function bounds

  !> Fail at the first pair of elements for which `left relation right` does not hold.
  subroutine compare(left, relation, right, absolute, relative, message, location)
    type(test_value_t), intent(in) :: left
    !> `==`, `<`, `<=`, `>` or `>=`; for texts only the first.
    character(len=*), intent(in) :: relation
    type(test_value_t), intent(in) :: right
    !> Reals are equal when they differ by `absolute + relative |left|` at most.
    real(real64), intent(in) :: absolute
    real(real64), intent(in) :: relative
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    character(len=:), allocatable :: fault
    logical :: conforming
    integer :: i, j

    if (left%kind /= right%kind) then
      call record_failure('values of different types cannot be compared', message, location)
      return
    end if
    conforming = size(left%shape) == 0
    if (size(left%shape) == size(right%shape)) conforming = all(left%shape == right%shape)
    if (.not. conforming) then
      call record_failure('shapes differ: expected ' // list(left%shape) // ', got ' &
                          // list(right%shape), message, location)
      return
    end if

    fault = ''
    do i = 1, right%size
      j = min(i, left%size)
      select case (left%kind)
      case (KIND_INTEGER)
        fault = fault_of_integers(left%integers(j), relation, right%integers(i))
      case (KIND_REAL)
        fault = fault_of_reals(left%reals(j), relation, right%reals(i), absolute, relative)
      case default
        fault = fault_of_texts(text_of(left, j), relation, text_of(right, i))
      end select
      if (fault == '') cycle
      call record_failure(fault // place(i, right%shape), message, location)
      return
    end do

  end subroutine compare

  !> What is wrong, or nothing.
  pure function fault_of_integers(left, relation, right) result(fault)
    integer(int64), intent(in) :: left
    character(len=*), intent(in) :: relation
    integer(int64), intent(in) :: right
    character(len=:), allocatable :: fault

    character(len=24) :: left_text, right_text
    logical :: satisfied

    select case (relation)
    case ('==')
      satisfied = left == right
    case ('<')
      satisfied = left < right
    case ('<=')
      satisfied = left <= right
    case ('>')
      satisfied = left > right
    case default
      satisfied = left >= right
    end select
    fault = ''
    if (satisfied) return
    write (left_text, '(i0)') left
    write (right_text, '(i0)') right
    fault = sentence(trim(left_text), relation, trim(right_text))

  end function fault_of_integers

  !> Written so that no NaN is compared and no infinities are subtracted: debug builds trap both.
  pure function fault_of_reals(left, relation, right, absolute, relative) result(fault)
    real(real64), intent(in) :: left
    character(len=*), intent(in) :: relation
    real(real64), intent(in) :: right
    real(real64), intent(in) :: absolute
    real(real64), intent(in) :: relative
    character(len=:), allocatable :: fault

    real(real64) :: bound
    logical :: finite, satisfied

    finite = ieee_is_finite(left) .and. ieee_is_finite(right)
    bound = absolute
    if (finite) bound = absolute + relative * abs(left)

    satisfied = .false.
    if (.not. ieee_is_nan(left) .and. .not. ieee_is_nan(right)) then
      select case (relation)
      case ('==')
        if (finite) then
          satisfied = abs(right - left) <= bound
        else
          satisfied = left >= right .and. left <= right
        end if
      case ('<')
        satisfied = left < right
      case ('<=')
        satisfied = left <= right
      case ('>')
        satisfied = left > right
      case default
        satisfied = left >= right
      end select
    end if

    fault = ''
    if (satisfied) return
    fault = sentence(number(left), relation, number(right))
    if (relation == '==' .and. finite) then
      fault = fault // ', difference ' // number(right - left) // ', tolerance ' // number(bound)
    end if

  end function fault_of_reals

  !> Trailing blanks do not count, as in Fortran's own comparison.
  pure function fault_of_texts(left, relation, right) result(fault)
    character(len=*), intent(in) :: left
    character(len=*), intent(in) :: relation
    character(len=*), intent(in) :: right
    character(len=:), allocatable :: fault

    fault = ''
    if (relation /= '==') then
      fault = 'texts have no order'
    else if (left /= right) then
      fault = sentence('"' // trim(left) // '"', relation, '"' // trim(right) // '"')
    end if

  end function fault_of_texts

  !> The text at a position, from 1.
  pure function text_of(value, position) result(text)
    type(test_value_t), intent(in) :: value
    integer, intent(in) :: position
    character(len=:), allocatable :: text

    text = value%texts((position - 1) * value%text_length + 1:position * value%text_length)

  end function text_of

  !> What was wanted of the two values and is not so.
  pure function sentence(left, relation, right) result(words)
    character(len=*), intent(in) :: left
    character(len=*), intent(in) :: relation
    character(len=*), intent(in) :: right
    character(len=:), allocatable :: words

    if (relation == '==') then
      words = 'expected ' // left // ', got ' // right
    else
      words = 'expected ' // left // ' ' // relation // ' ' // right
    end if

  end function sentence

  !> ' at element (2,3)' of an array, nothing of a scalar.
  pure function place(position, extents) result(words)
    !> In array element order, from 1.
    integer, intent(in) :: position
    integer, intent(in) :: extents(:)
    character(len=:), allocatable :: words

    integer :: axis, left, subscripts(size(extents))

    words = ''
    if (size(extents) == 0) return
    left = position - 1
    do axis = 1, size(extents)
      subscripts(axis) = modulo(left, extents(axis)) + 1
      left = left / extents(axis)
    end do
    words = ' at element ' // list(subscripts)

  end function place

  !> '(1,2)'; '()' of a scalar's shape.
  pure function list(values) result(words)
    integer, intent(in) :: values(:)
    character(len=:), allocatable :: words

    character(len=16) :: item
    integer :: i

    words = '('
    do i = 1, size(values)
      write (item, '(i0)') values(i)
      if (i > 1) words = words // ','
      words = words // trim(item)
    end do
    words = words // ')'

  end function list

  pure function number(value) result(words)
    real(real64), intent(in) :: value
    character(len=:), allocatable :: words

    character(len=26) :: buffer

    write (buffer, '(es24.16e3)') value
    words = trim(adjustl(buffer))

  end function number

end module swage_test_assert
