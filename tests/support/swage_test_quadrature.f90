!> Points and weights on a triangle or a tetrahedron, exact for polynomials of high degree.
module swage_test_quadrature
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: simplex_rule

contains

  !> A product rule of Gauss and Legendre on the collapsed square or cube: exact to the degree
  !> 2 n - n_dim. Weights sum to 1.
  pure subroutine simplex_rule(n_dim, n, barycentric, weight)
    !> 2 or 3.
    integer, intent(in) :: n_dim
    !> Points in each direction.
    integer, intent(in) :: n
    !> Shape (n_dim + 1, n**n_dim).
    real(wp), allocatable, intent(out) :: barycentric(:, :)
    real(wp), allocatable, intent(out) :: weight(:)

    real(wp) :: line(n), line_weight(n), r, s, t
    integer :: i, j, k, point

    allocate (barycentric(n_dim + 1, n**n_dim), weight(n**n_dim), source=0.0_wp)
    call gauss_legendre(line, line_weight)
    point = 0
    do i = 1, n
      do j = 1, n
        s = line(i)
        t = (1.0_wp - s) * line(j)
        if (n_dim == 2) then
          point = point + 1
          barycentric(:, point) = [1.0_wp - s - t, s, t]
          weight(point) = 2.0_wp * line_weight(i) * line_weight(j) * (1.0_wp - s)
          cycle
        end if
        do k = 1, n
          r = (1.0_wp - s - t) * line(k)
          point = point + 1
          barycentric(:, point) = [1.0_wp - s - t - r, s, t, r]
          weight(point) = 6.0_wp * line_weight(i) * line_weight(j) * line_weight(k) &
            * (1.0_wp - s) * (1.0_wp - s - t)
        end do
      end do
    end do

  end subroutine simplex_rule

  !> Gauss and Legendre on (0, 1): roots of the polynomial by Newton.
  pure subroutine gauss_legendre(x, weight)
    real(wp), intent(out) :: x(:)
    real(wp), intent(out) :: weight(:)

    real(wp) :: p, previous, slope, step, swap, z
    integer :: i, iteration, k, n

    n = size(x)
    do i = 1, n
      z = cos(acos(-1.0_wp) * (i - 0.25_wp) / (n + 0.5_wp))
      do iteration = 1, 50
        p = 1.0_wp
        previous = 0.0_wp
        do k = 1, n
          swap = p
          p = ((2 * k - 1) * z * p - (k - 1) * previous) / k
          previous = swap
        end do
        slope = n * (z * p - previous) / (z * z - 1.0_wp)
        step = p / slope
        z = z - step
        if (abs(step) < 1.0e-15_wp) exit
      end do
      x(i) = 0.5_wp * (1.0_wp - z)
      weight(i) = 1.0_wp / ((1.0_wp - z * z) * slope**2)
    end do

  end subroutine gauss_legendre

end module swage_test_quadrature
