!> Vectors and rotations of three-dimensional space.
module swage_rotation
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: cross_product, dyadic, IDENTITY, normalised, perpendicular, rotation_matrix
  public :: rotated_matrix, skew_matrix

  !> The unit matrix.
  real(wp), parameter :: IDENTITY(3, 3) = reshape( &
    [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

contains

  !> a × b.
  pure function cross_product(a, b) result(c)
    real(wp), intent(in) :: a(3)
    real(wp), intent(in) :: b(3)
    real(wp) :: c(3)

    c = [a(2) * b(3) - a(3) * b(2), a(3) * b(1) - a(1) * b(3), a(1) * b(2) - a(2) * b(1)]

  end function cross_product

  !> a ⊗ b, with the components a(i) b(j).
  pure function dyadic(a, b) result(m)
    real(wp), intent(in) :: a(3)
    real(wp), intent(in) :: b(3)
    real(wp) :: m(3, 3)

    integer :: j

    do j = 1, 3
      m(:, j) = a * b(j)
    end do

  end function dyadic

  !> The unit vector along `a`; the zero vector stays what it is.
  pure function normalised(a) result(unit)
    real(wp), intent(in) :: a(3)
    real(wp) :: unit(3)

    real(wp) :: largest

    ! Scaled first, so that neither tiny nor huge components leave the range when squared
    largest = maxval(abs(a))
    unit = a
    if (largest > 0.0_wp) then
      unit = a / largest
      unit = unit / norm2(unit)
    end if

  end function normalised

  !> A unit vector at right angles to `a`: along x wherever that is one.
  pure function perpendicular(a) result(unit)
    !> Not the zero vector.
    real(wp), intent(in) :: a(3)
    real(wp) :: unit(3)

    real(wp) :: direction(3)

    direction = normalised(a)
    if (abs(direction(1)) <= 0.9_wp) then
      unit = normalised(IDENTITY(:, 1) - direction(1) * direction)
    else
      unit = normalised(IDENTITY(:, 2) - direction(2) * direction)
    end if

  end function perpendicular

  !> The matrix W of the cross product: W b = a × b.
  pure function skew_matrix(a) result(w)
    real(wp), intent(in) :: a(3)
    real(wp) :: w(3, 3)

    w(:, 1) = [0.0_wp, a(3), -a(2)]
    w(:, 2) = [-a(3), 0.0_wp, a(1)]
    w(:, 3) = [a(2), -a(1), 0.0_wp]

  end function skew_matrix

  !> Rotation by an angle of any size about an axis through the origin, right-handed.
  !>
  !> \(R = I + \sin\theta\,W + 2\sin^2(\theta/2)\,W^2\), \(W b = a\times b\); the half angle keeps
  !> small rotations accurate. Source: O. Rodrigues, J. Math. Pures Appl. 5 (1840) 380–440.
  pure function rotation_matrix(axis, angle) result(r)
    !> Direction; its length does not matter. The zero vector gives the unit matrix.
    real(wp), intent(in) :: axis(3)
    !> [angle], radian.
    real(wp), intent(in) :: angle
    real(wp) :: r(3, 3)

    real(wp) :: w(3, 3)

    w = skew_matrix(normalised(axis))
    r = matmul(w, w)
    r = IDENTITY + sin(angle) * w + 2.0_wp * sin(0.5_wp * angle)**2 * r

  end function rotation_matrix

  !> \(Q\,m\,Q^T\).
  pure function rotated_matrix(m, q) result(b)
    real(wp), intent(in) :: m(3, 3)
    !> Rotation matrix.
    real(wp), intent(in) :: q(3, 3)
    real(wp) :: b(3, 3)

    ! Workaround: gfortran 12, nested calls of matmul give false warnings at -O2
    b = matmul(m, transpose(q))
    b = matmul(q, b)

  end function rotated_matrix

end module swage_rotation
