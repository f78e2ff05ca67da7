!> Values handed to assertions, whatever their type, kind and rank.
!>
!> `pf_process` wraps the arguments of an assertion in `test_value`, so that each assertion is
!> written once. (Assumed-rank arguments would do without; but gfortran 12 gives them a wrong rank
!> where the actual argument is the result of an intrinsic function such as `spread`.)
module swage_test_value
  use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
  implicit none(type, external)
  private

  public :: test_value_t, test_value
  public :: KIND_INTEGER, KIND_REAL, KIND_TEXT

  integer, parameter :: KIND_INTEGER = 1
  integer, parameter :: KIND_REAL = 2
  integer, parameter :: KIND_TEXT = 3

  !> A value in the widest kind of its type; the elements in array element order.
  type :: test_value_t
    !> One of the `KIND_*` values, telling which component is filled.
    integer :: kind = 0
    !> Empty for a scalar.
    integer, allocatable :: shape(:)
    integer(int64), allocatable :: integers(:)
    real(real64), allocatable :: reals(:)
    !> The elements one after the other, each of `text_length` characters.
    character(len=:), allocatable :: texts
    integer :: text_length = 0
    !> Number of elements.
    integer :: size = 0
  end type test_value_t

  !> Wrap an integer, a real or a text of rank 0 to 3 (text: 0 or 1).
  interface test_value
    procedure :: integer_0
    procedure :: integer_1
    procedure :: integer_2
    procedure :: integer_3
    procedure :: long_0
    procedure :: long_1
    procedure :: long_2
    procedure :: long_3
    procedure :: single_0
    procedure :: single_1
    procedure :: single_2
    procedure :: single_3
    procedure :: real_0
    procedure :: real_1
    procedure :: real_2
    procedure :: real_3
    procedure :: text_0
    procedure :: text_1
  end interface test_value

contains

  pure function integer_0(value) result(wrapped)
    integer(int32), intent(in) :: value
    type(test_value_t) :: wrapped

    wrapped = of_integers([int(value, int64)], [integer ::])

  end function integer_0

  pure function integer_1(value) result(wrapped)
    integer(int32), intent(in) :: value(:)
    type(test_value_t) :: wrapped

    wrapped = of_integers(int(value, int64), shape(value))

  end function integer_1

  pure function integer_2(value) result(wrapped)
    integer(int32), intent(in) :: value(:, :)
    type(test_value_t) :: wrapped

    wrapped = of_integers(reshape(int(value, int64), [size(value)]), shape(value))

  end function integer_2

  pure function integer_3(value) result(wrapped)
    integer(int32), intent(in) :: value(:, :, :)
    type(test_value_t) :: wrapped

    wrapped = of_integers(reshape(int(value, int64), [size(value)]), shape(value))

  end function integer_3

  pure function long_0(value) result(wrapped)
    integer(int64), intent(in) :: value
    type(test_value_t) :: wrapped

    wrapped = of_integers([value], [integer ::])

  end function long_0

  pure function long_1(value) result(wrapped)
    integer(int64), intent(in) :: value(:)
    type(test_value_t) :: wrapped

    wrapped = of_integers(value, shape(value))

  end function long_1

  pure function long_2(value) result(wrapped)
    integer(int64), intent(in) :: value(:, :)
    type(test_value_t) :: wrapped

    wrapped = of_integers(reshape(value, [size(value)]), shape(value))

  end function long_2

  pure function long_3(value) result(wrapped)
    integer(int64), intent(in) :: value(:, :, :)
    type(test_value_t) :: wrapped

    wrapped = of_integers(reshape(value, [size(value)]), shape(value))

  end function long_3

  pure function single_0(value) result(wrapped)
    real(real32), intent(in) :: value
    type(test_value_t) :: wrapped

    wrapped = of_reals([real(value, real64)], [integer ::])

  end function single_0

  pure function single_1(value) result(wrapped)
    real(real32), intent(in) :: value(:)
    type(test_value_t) :: wrapped

    wrapped = of_reals(real(value, real64), shape(value))

  end function single_1

  pure function single_2(value) result(wrapped)
    real(real32), intent(in) :: value(:, :)
    type(test_value_t) :: wrapped

    wrapped = of_reals(reshape(real(value, real64), [size(value)]), shape(value))

  end function single_2

  pure function single_3(value) result(wrapped)
    real(real32), intent(in) :: value(:, :, :)
    type(test_value_t) :: wrapped

    wrapped = of_reals(reshape(real(value, real64), [size(value)]), shape(value))

  end function single_3

  pure function real_0(value) result(wrapped)
    real(real64), intent(in) :: value
    type(test_value_t) :: wrapped

    wrapped = of_reals([value], [integer ::])

  end function real_0

  pure function real_1(value) result(wrapped)
    real(real64), intent(in) :: value(:)
    type(test_value_t) :: wrapped

    wrapped = of_reals(value, shape(value))

  end function real_1

  pure function real_2(value) result(wrapped)
    real(real64), intent(in) :: value(:, :)
    type(test_value_t) :: wrapped

    wrapped = of_reals(reshape(value, [size(value)]), shape(value))

  end function real_2

  pure function real_3(value) result(wrapped)
    real(real64), intent(in) :: value(:, :, :)
    type(test_value_t) :: wrapped

    wrapped = of_reals(reshape(value, [size(value)]), shape(value))

  end function real_3

  pure function text_0(value) result(wrapped)
    character(len=*), intent(in) :: value
    type(test_value_t) :: wrapped

    wrapped = of_texts([value], [integer ::])

  end function text_0

  pure function text_1(value) result(wrapped)
    character(len=*), intent(in) :: value(:)
    type(test_value_t) :: wrapped

    wrapped = of_texts(value, shape(value))

  end function text_1

  pure function of_texts(values, extents) result(wrapped)
    character(len=*), intent(in) :: values(:)
    integer, intent(in) :: extents(:)
    type(test_value_t) :: wrapped

    integer :: i, length

    length = len(values)
    wrapped%kind = KIND_TEXT
    wrapped%size = size(values)
    wrapped%text_length = length
    allocate (wrapped%shape, source=extents)
    allocate (character(len=length * size(values)) :: wrapped%texts)
    do i = 1, size(values)
      wrapped%texts((i - 1) * length + 1:i * length) = values(i)
    end do

  end function of_texts

  pure function of_integers(values, extents) result(wrapped)
    integer(int64), intent(in) :: values(:)
    integer, intent(in) :: extents(:)
    type(test_value_t) :: wrapped

    wrapped%kind = KIND_INTEGER
    wrapped%size = size(values)
    allocate (wrapped%shape, source=extents)
    allocate (wrapped%integers, source=values)

  end function of_integers

  pure function of_reals(values, extents) result(wrapped)
    real(real64), intent(in) :: values(:)
    integer, intent(in) :: extents(:)
    type(test_value_t) :: wrapped

    wrapped%kind = KIND_REAL
    wrapped%size = size(values)
    allocate (wrapped%shape, source=extents)
    allocate (wrapped%reals, source=values)

  end function of_reals

end module swage_test_value
