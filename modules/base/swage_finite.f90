!> Numbers that are neither infinite nor NaN.
module swage_finite
  use, intrinsic :: iso_fortran_env, only: int64
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: is_finite

  !> Where the exponent of a number in double precision starts, and its value in numbers that are
  !> not finite (IEEE 754).
  integer, parameter :: FIRST_EXPONENT_BIT = 52
  integer, parameter :: N_EXPONENT_BIT = 11
  integer(int64), parameter :: NOT_FINITE = 2047_int64

contains

  !> True unless the value is infinite or NaN.
  !>
  !> Looks at bits instead of comparing: a comparison with a signalling NaN, which debug builds put
  !> into variables not yet set, would stop a program that traps invalid operations.
  elemental function is_finite(value)
    real(wp), intent(in) :: value
    logical :: is_finite

    is_finite = ibits(transfer(value, 0_int64), FIRST_EXPONENT_BIT, N_EXPONENT_BIT) /= NOT_FINITE

  end function is_finite

end module swage_finite
