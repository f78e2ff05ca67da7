!> A sequence of numbers without pattern that is the same on every machine and compiler.
module swage_test_random
  use swage_kinds, only: gp, wp
  implicit none(type, external)
  private

  public :: random_t

  !> The minimal standard generator of Park and Miller (1988).
  type :: random_t
    private
    integer(gp) :: seed = 20260101_gp
  contains
    !> Next number between two bounds.
    procedure :: next => random_next
    !> Next numbers between two bounds.
    procedure :: fill => random_fill
  end type random_t

contains

  subroutine random_next(self, low, high, value)
    class(random_t), intent(inout) :: self
    real(wp), intent(in) :: low
    real(wp), intent(in) :: high
    real(wp), intent(out) :: value

    integer(gp), parameter :: MODULUS = 2147483647_gp

    self%seed = mod(16807_gp * self%seed, MODULUS)
    value = low + (high - low) * (real(self%seed, wp) / real(MODULUS, wp))

  end subroutine random_next

  subroutine random_fill(self, low, high, values)
    class(random_t), intent(inout) :: self
    real(wp), intent(in) :: low
    real(wp), intent(in) :: high
    real(wp), intent(out) :: values(:)

    integer :: i

    do i = 1, size(values)
      call self%next(low, high, values(i))
    end do

  end subroutine random_fill

end module swage_test_random
