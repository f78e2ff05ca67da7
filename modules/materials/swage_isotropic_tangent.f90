!> The form that the tangent of every isotropic law has.
module swage_isotropic_tangent
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: set_isotropic_tangent

contains

  !> \(a\,\mathbb P + b\,n \otimes n\), with \(\mathbb P\) the deviatoric projector.
  pure subroutine set_isotropic_tangent(secant, factor, direction, tangent)
    !> \(a\) [stress].
    real(wp), intent(in) :: secant
    !> \(b\) [stress].
    real(wp), intent(in) :: factor
    !> \(n\), a deviator [1].
    real(wp), intent(in) :: direction(6)
    !> [stress].
    real(wp), intent(out) :: tangent(6, 6)

    integer :: i, j

    do j = 1, 6
      do i = 1, 6
        tangent(i, j) = factor * direction(i) * direction(j)
      end do
      tangent(j, j) = tangent(j, j) + secant
    end do
    do j = 1, 3
      do i = 1, 3
        tangent(i, j) = tangent(i, j) - secant / 3.0_wp
      end do
    end do

  end subroutine set_isotropic_tangent

end module swage_isotropic_tangent
