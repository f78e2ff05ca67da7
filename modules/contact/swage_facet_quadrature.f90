!> Quadrature on lines and triangles.
module swage_facet_quadrature
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: facet_quadrature, has_facet_quadrature, LINE_POINTS, TRIANGLE_POINTS

  !> Numbers of points there are rules for.
  integer, parameter :: LINE_POINTS(*) = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]
  integer, parameter :: TRIANGLE_POINTS(*) = [1, 3, 6, 7, 12]

contains

  !> True when there is a rule of so many points.
  pure function has_facet_quadrature(n_dim, n_point) result(has)
    integer, intent(in) :: n_dim
    integer, intent(in) :: n_point
    logical :: has

    if (n_dim == 2) then
      has = any(LINE_POINTS == n_point)
    else
      has = any(TRIANGLE_POINTS == n_point)
    end if

  end function has_facet_quadrature

  !> A rule on a line (2 corners) or triangle (3 corners).
  !>
  !> Lines: Gauss and Legendre, exact to degree 2n - 1. Triangles: exact to degree 1, 2, 4, 5, 6.
  !> Source: D. A. Dunavant, Int. J. Numer. Methods Eng. 21 (1985) 1129–1148.
  subroutine facet_quadrature(n_dim, n_point, barycentric, weight)
    !> Corners of the facet.
    integer, intent(in) :: n_dim
    !> One of `LINE_POINTS` or `TRIANGLE_POINTS`.
    integer, intent(in) :: n_point
    !> Weights of the corners; the third is zero on a line; shape (3, n_point).
    real(wp), allocatable, intent(out) :: barycentric(:, :)
    !> Of the points; their sum is 1; shape (n_point).
    real(wp), allocatable, intent(out) :: weight(:)

    integer :: n

    allocate (barycentric(3, n_point), weight(n_point), source=0.0_wp)
    if (n_dim == 2) then
      call set_line()
    else
      n = 0
      select case (n_point)
      case (1)
        call add_centre(1.0_wp)
      case (3)
        call add_three(1.0_wp / 6.0_wp, 1.0_wp / 3.0_wp)
      case (6)
        call add_three(0.445948490915965_wp, 0.223381589678011_wp)
        call add_three(0.091576213509771_wp, 0.109951743655322_wp)
      case (7)
        call add_centre(0.225_wp)
        call add_three((6.0_wp - sqrt(15.0_wp)) / 21.0_wp, (155.0_wp - sqrt(15.0_wp)) / 1200.0_wp)
        call add_three((6.0_wp + sqrt(15.0_wp)) / 21.0_wp, (155.0_wp + sqrt(15.0_wp)) / 1200.0_wp)
      case (12)
        call add_three(0.249286745170910_wp, 0.116786275726379_wp)
        call add_three(0.063089014491502_wp, 0.050844906370207_wp)
        call add_six(0.053145049844817_wp, 0.310352451033784_wp, 0.082851075618374_wp)
      case default
        ! No rule: all weights 0
        return
      end select
    end if
    weight = weight / sum(weight)

  contains

    !> Roots of the Legendre polynomial by Newton's method.
    subroutine set_line()
      integer :: i, iteration, k
      real(wp) :: above, below, polynomial, slope, z

      do i = 1, n_point
        z = cos(acos(-1.0_wp) * (i - 0.25_wp) / (n_point + 0.5_wp))
        do iteration = 1, 10
          polynomial = 1.0_wp
          below = 0.0_wp
          do k = 1, n_point
            above = ((2 * k - 1) * z * polynomial - (k - 1) * below) / k
            below = polynomial
            polynomial = above
          end do
          slope = n_point * (z * polynomial - below) / (z**2 - 1.0_wp)
          z = z - polynomial / slope
        end do
        barycentric(1, i) = 0.5_wp * (1.0_wp + z)
        barycentric(2, i) = 0.5_wp * (1.0_wp - z)
        weight(i) = 1.0_wp / ((1.0_wp - z**2) * slope**2)
      end do

    end subroutine set_line

    subroutine add_centre(w)
      real(wp), intent(in) :: w

      n = n + 1
      barycentric(:, n) = 1.0_wp / 3.0_wp
      weight(n) = w

    end subroutine add_centre

    !> Three points with two weights that are the same.
    subroutine add_three(a, w)
      real(wp), intent(in) :: a
      real(wp), intent(in) :: w

      integer :: k

      do k = 1, 3
        n = n + 1
        barycentric(:, n) = a
        barycentric(k, n) = 1.0_wp - 2.0_wp * a
        weight(n) = w
      end do

    end subroutine add_three

    !> Six points with three weights.
    subroutine add_six(a, b, w)
      real(wp), intent(in) :: a
      real(wp), intent(in) :: b
      real(wp), intent(in) :: w

      integer :: k, l

      do k = 1, 3
        do l = 1, 3
          if (k == l) cycle
          n = n + 1
          barycentric(:, n) = 1.0_wp - a - b
          barycentric(k, n) = a
          barycentric(l, n) = b
          weight(n) = w
        end do
      end do

    end subroutine add_six

  end subroutine facet_quadrature

end module swage_facet_quadrature
