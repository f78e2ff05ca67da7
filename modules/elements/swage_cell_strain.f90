!> Strain and rotation of a step from the displacement gradient at its middle, and their
!> derivative, for many cells side by side.
!>
!> With the spin of the step taken at the middle, the rotation is \(Q = (I - W)^{-1} (I + W)\), W
!> half of the spin (Hughes and Winget, 1980); the strain is turned by \(H = Q^{1/2}\), without
!> which the update is of first order only. With the axial vector a of W,
!> \((I - W)^{-1} = (I + W + a \otimes a) / (1 + a^2)\) and \(Q = 2 (I - W)^{-1} - I\); H is the
!> same of \(a / (1 + \sqrt{1 + a^2})\).
module swage_cell_strain
  use swage_kinds, only: wp
  use swage_mandel, only: rotate_tensors, SQRT2
  use swage_point_batch, only: LANES
  implicit none(type, external)
  private

  public :: find_displacement_gradient, find_rotation, find_symmetric_part
  public :: add_spin, add_turning, find_axes, find_spin_rates, find_strain_derivative

  real(wp), parameter :: ROOT = 1.0_wp / SQRT2

contains

  !> Σ u ⊗ gradient, with the hoop strain in its last component.
  pure subroutine find_displacement_gradient(u, gradient, hoop, l)
    !> Displacements of the vertices [length].
    real(wp), intent(in) :: u(LANES, 3, 4)
    !> Of the vertex functions [1/length].
    real(wp), intent(in) :: gradient(LANES, 3, 4)
    real(wp), intent(in) :: hoop(LANES)
    real(wp), intent(out) :: l(LANES, 3, 3)

    integer :: i, j, k

    do k = 1, 3
      do j = 1, 3
        do i = 1, LANES
          l(i, j, k) = (u(i, j, 2) - u(i, j, 1)) * gradient(i, k, 2) &
            + (u(i, j, 3) - u(i, j, 1)) * gradient(i, k, 3) &
            + (u(i, j, 4) - u(i, j, 1)) * gradient(i, k, 4)
        end do
      end do
    end do
    do i = 1, LANES
      l(i, 3, 3) = l(i, 3, 3) + hoop(i) * (u(i, 1, 1) + u(i, 1, 2) + u(i, 1, 3))
    end do

  end subroutine find_displacement_gradient

  !> The symmetric part of matrices, Mandel.
  pure subroutine find_symmetric_part(l, a)
    real(wp), intent(in) :: l(LANES, 3, 3)
    real(wp), intent(out) :: a(LANES, 6)

    integer :: i

    do i = 1, LANES
      a(i, 1) = l(i, 1, 1)
      a(i, 2) = l(i, 2, 2)
      a(i, 3) = l(i, 3, 3)
      a(i, 4) = ROOT * (l(i, 2, 3) + l(i, 3, 2))
      a(i, 5) = ROOT * (l(i, 1, 3) + l(i, 3, 1))
      a(i, 6) = ROOT * (l(i, 1, 2) + l(i, 2, 1))
    end do

  end subroutine find_symmetric_part

  !> Rotation of the step, half of it, and the strain increment turned by half of it.
  pure subroutine find_rotation(l, axial, half_rotation, rotation, strain)
    !> Displacement gradient at the middle of the step [1].
    real(wp), intent(in) :: l(LANES, 3, 3)
    !> Axial vector of half of the spin.
    real(wp), intent(out) :: axial(LANES, 3)
    real(wp), intent(out) :: half_rotation(LANES, 3, 3)
    real(wp), intent(out) :: rotation(LANES, 3, 3)
    !> Mandel.
    real(wp), intent(out) :: strain(LANES, 6)

    real(wp) :: half(LANES, 3), share
    integer :: i

    do i = 1, LANES
      axial(i, 1) = 0.25_wp * (l(i, 3, 2) - l(i, 2, 3))
      axial(i, 2) = 0.25_wp * (l(i, 1, 3) - l(i, 3, 1))
      axial(i, 3) = 0.25_wp * (l(i, 2, 1) - l(i, 1, 2))
      share = 1.0_wp / (1.0_wp + sqrt(1.0_wp + axial(i, 1)**2 + axial(i, 2)**2 + axial(i, 3)**2))
      half(i, 1) = share * axial(i, 1)
      half(i, 2) = share * axial(i, 2)
      half(i, 3) = share * axial(i, 3)
    end do
    call find_cayley(axial, rotation)
    call find_cayley(half, half_rotation)
    call find_symmetric_part(l, strain)
    call rotate_tensors(LANES, half_rotation, strain)

  end subroutine find_rotation

  !> Rotation of twice the angle whose tangent is |a|, about a.
  pure subroutine find_cayley(a, q)
    real(wp), intent(in) :: a(LANES, 3)
    real(wp), intent(out) :: q(LANES, 3, 3)

    real(wp) :: scale
    integer :: i

    do i = 1, LANES
      scale = 2.0_wp / (1.0_wp + a(i, 1)**2 + a(i, 2)**2 + a(i, 3)**2)
      q(i, 1, 1) = scale * a(i, 1)**2 + (scale - 1.0_wp)
      q(i, 2, 2) = scale * a(i, 2)**2 + (scale - 1.0_wp)
      q(i, 3, 3) = scale * a(i, 3)**2 + (scale - 1.0_wp)
      q(i, 2, 1) = scale * (a(i, 1) * a(i, 2) + a(i, 3))
      q(i, 1, 2) = scale * (a(i, 1) * a(i, 2) - a(i, 3))
      q(i, 3, 2) = scale * (a(i, 2) * a(i, 3) + a(i, 1))
      q(i, 2, 3) = scale * (a(i, 2) * a(i, 3) - a(i, 1))
      q(i, 1, 3) = scale * (a(i, 3) * a(i, 1) + a(i, 2))
      q(i, 3, 1) = scale * (a(i, 3) * a(i, 1) - a(i, 2))
    end do

  end subroutine find_cayley

  !> Axial vectors of the rates at which half of the rotation and the whole turn, by the axial
  !> vector of the spin: \((I + a \times) / (1 + a^2)\), and for half of the rotation the same of
  !> \(h = a / (1 + \sqrt{1 + a^2})\), times its derivative.
  pure subroutine find_spin_rates(axial, half_rate, rate)
    !> Of half of the spin.
    real(wp), intent(in) :: axial(LANES, 3)
    !> Column j belongs to component j.
    real(wp), intent(out) :: half_rate(LANES, 3, 3)
    real(wp), intent(out) :: rate(LANES, 3, 3)

    real(wp) :: a1, a2, a3, h1, h2, h3, root, share, square, straight, within
    integer :: i

    do i = 1, LANES
      a1 = axial(i, 1)
      a2 = axial(i, 2)
      a3 = axial(i, 3)
      square = a1**2 + a2**2 + a3**2
      share = 1.0_wp / (1.0_wp + square)
      rate(i, 1, 1) = share
      rate(i, 2, 1) = share * a3
      rate(i, 3, 1) = -share * a2
      rate(i, 1, 2) = -share * a3
      rate(i, 2, 2) = share
      rate(i, 3, 2) = share * a1
      rate(i, 1, 3) = share * a2
      rate(i, 2, 3) = -share * a1
      rate(i, 3, 3) = share

      root = sqrt(1.0_wp + square)
      straight = 1.0_wp / (1.0_wp + root)
      h1 = straight * a1
      h2 = straight * a2
      h3 = straight * a3
      share = straight / (1.0_wp + h1**2 + h2**2 + h3**2)
      ! h × h is none: only the first factor of what follows meets h ×
      within = -share / root
      half_rate(i, 1, 1) = share + within * h1 * a1
      half_rate(i, 2, 1) = share * h3 + within * h2 * a1
      half_rate(i, 3, 1) = -share * h2 + within * h3 * a1
      half_rate(i, 1, 2) = -share * h3 + within * h1 * a2
      half_rate(i, 2, 2) = share + within * h2 * a2
      half_rate(i, 3, 2) = share * h1 + within * h3 * a2
      half_rate(i, 1, 3) = share * h2 + within * h1 * a3
      half_rate(i, 2, 3) = -share * h1 + within * h2 * a3
      half_rate(i, 3, 3) = share + within * h3 * a3
    end do

  end subroutine find_spin_rates

  !> Add the change of tensors that turn: Ω s - s Ω with Ω x = w × x, for the axial vectors w in the
  !> columns of a rate.
  pure subroutine add_turning(s, rate, change)
    !> Mandel.
    real(wp), intent(in) :: s(LANES, 6)
    real(wp), intent(in) :: rate(LANES, 3, 3)
    real(wp), intent(inout) :: change(LANES, 6, 3)

    real(wp) :: w1, w2, w3
    integer :: i, j

    do j = 1, 3
      do i = 1, LANES
        w1 = rate(i, 1, j)
        w2 = rate(i, 2, j)
        w3 = rate(i, 3, j)
        change(i, 1, j) = change(i, 1, j) + SQRT2 * (w2 * s(i, 5) - w3 * s(i, 6))
        change(i, 2, j) = change(i, 2, j) + SQRT2 * (w3 * s(i, 6) - w1 * s(i, 4))
        change(i, 3, j) = change(i, 3, j) + SQRT2 * (w1 * s(i, 4) - w2 * s(i, 5))
        change(i, 4, j) = change(i, 4, j) + SQRT2 * w1 * (s(i, 2) - s(i, 3)) &
          + w3 * s(i, 5) - w2 * s(i, 6)
        change(i, 5, j) = change(i, 5, j) + SQRT2 * w2 * (s(i, 3) - s(i, 1)) &
          + w1 * s(i, 6) - w3 * s(i, 4)
        change(i, 6, j) = change(i, 6, j) + SQRT2 * w3 * (s(i, 1) - s(i, 2)) &
          + w2 * s(i, 4) - w1 * s(i, 5)
      end do
    end do

  end subroutine add_turning

  !> Columns of \(I - L/2\): how the middle of the step sees the axes along which the end moves.
  pure subroutine find_axes(moving, l, axes)
    !> False where the geometry is fixed: the axes themselves.
    logical, intent(in) :: moving
    !> Displacement gradient at the middle.
    real(wp), intent(in) :: l(LANES, 3, 3)
    real(wp), intent(out) :: axes(LANES, 3, 3)

    integer :: j

    axes = 0.0_wp
    if (moving) axes = -0.5_wp * l
    do j = 1, 3
      axes(:, j, j) = axes(:, j, j) + 1.0_wp
    end do

  end subroutine find_axes

  !> Derivative of the turned strain by the displacements of the vertices 2 to 4. A vertex
  !> function's gradient being minus the sum of the others', that by the first vertex is minus the
  !> sum of theirs.
  !>
  !> The displacement along axis j of vertex b changes the gradient at the middle by
  !> \(\delta L = (I - L/2)\,e_j \otimes g_b\); it strains by
  !> \(H\,\mathrm{sym}\,\delta L\,H^T\), and its spin turns what `of_spin` says.
  pure subroutine find_strain_derivative(n_dim, axes, gradient, half_rotation, of_spin, &
                                         by_displacement)
    !> Axes along which the vertices move.
    integer, intent(in) :: n_dim
    !> See [[find_axes]].
    real(wp), intent(in) :: axes(LANES, 3, 3)
    !> Of the vertex functions at the middle [1/length].
    real(wp), intent(in) :: gradient(LANES, 3, 4)
    real(wp), intent(in) :: half_rotation(LANES, 3, 3)
    !> Strain by the components of the axial vector of the spin.
    real(wp), intent(in) :: of_spin(LANES, 6, 3)
    !> Mandel strain by displacement j of vertex b in column (j, b) [1/length].
    real(wp), intent(inout) :: by_displacement(LANES, 6, 3, 4)

    real(wp) :: turned_axes(LANES, 3, 3), turned_gradient(LANES, 3, 4)
    real(wp) :: d1, d2, d3, g1, g2, g3, w1, w2, w3
    integer :: b, i, j, k

    do k = 1, 3
      do j = 1, n_dim
        do i = 1, LANES
          turned_axes(i, k, j) = half_rotation(i, k, 1) * axes(i, 1, j) &
            + half_rotation(i, k, 2) * axes(i, 2, j) + half_rotation(i, k, 3) * axes(i, 3, j)
        end do
      end do
      do b = 2, 4
        do i = 1, LANES
          turned_gradient(i, k, b) = half_rotation(i, k, 1) * gradient(i, 1, b) &
            + half_rotation(i, k, 2) * gradient(i, 2, b) &
            + half_rotation(i, k, 3) * gradient(i, 3, b)
        end do
      end do
    end do

    do b = 2, 4
      do j = 1, n_dim
        do i = 1, LANES
          w1 = 0.5_wp * (gradient(i, 2, b) * axes(i, 3, j) - gradient(i, 3, b) * axes(i, 2, j))
          w2 = 0.5_wp * (gradient(i, 3, b) * axes(i, 1, j) - gradient(i, 1, b) * axes(i, 3, j))
          w3 = 0.5_wp * (gradient(i, 1, b) * axes(i, 2, j) - gradient(i, 2, b) * axes(i, 1, j))
          d1 = turned_axes(i, 1, j)
          d2 = turned_axes(i, 2, j)
          d3 = turned_axes(i, 3, j)
          g1 = turned_gradient(i, 1, b)
          g2 = turned_gradient(i, 2, b)
          g3 = turned_gradient(i, 3, b)
          by_displacement(i, 1, j, b) = d1 * g1 &
            + of_spin(i, 1, 1) * w1 + of_spin(i, 1, 2) * w2 + of_spin(i, 1, 3) * w3
          by_displacement(i, 2, j, b) = d2 * g2 &
            + of_spin(i, 2, 1) * w1 + of_spin(i, 2, 2) * w2 + of_spin(i, 2, 3) * w3
          by_displacement(i, 3, j, b) = d3 * g3 &
            + of_spin(i, 3, 1) * w1 + of_spin(i, 3, 2) * w2 + of_spin(i, 3, 3) * w3
          by_displacement(i, 4, j, b) = ROOT * (d2 * g3 + d3 * g2) &
            + of_spin(i, 4, 1) * w1 + of_spin(i, 4, 2) * w2 + of_spin(i, 4, 3) * w3
          by_displacement(i, 5, j, b) = ROOT * (d1 * g3 + d3 * g1) &
            + of_spin(i, 5, 1) * w1 + of_spin(i, 5, 2) * w2 + of_spin(i, 5, 3) * w3
          by_displacement(i, 6, j, b) = ROOT * (d1 * g2 + d2 * g1) &
            + of_spin(i, 6, 1) * w1 + of_spin(i, 6, 2) * w2 + of_spin(i, 6, 3) * w3
        end do
      end do
    end do

  end subroutine find_strain_derivative

  !> Add to the derivative of a tensor what comes from the spin alone; see
  !> [[find_strain_derivative]].
  pure subroutine add_spin(n_dim, axes, gradient, of_spin, by_displacement)
    integer, intent(in) :: n_dim
    real(wp), intent(in) :: axes(LANES, 3, 3)
    real(wp), intent(in) :: gradient(LANES, 3, 4)
    !> The tensor by the components of the axial vector of the spin.
    real(wp), intent(in) :: of_spin(LANES, 6, 3)
    real(wp), intent(inout) :: by_displacement(LANES, 6, 3, 4)

    real(wp) :: w(LANES, 3)
    integer :: b, i, j, k

    do b = 2, 4
      do j = 1, n_dim
        do i = 1, LANES
          w(i, 1) = 0.5_wp * (gradient(i, 2, b) * axes(i, 3, j) - gradient(i, 3, b) * axes(i, 2, j))
          w(i, 2) = 0.5_wp * (gradient(i, 3, b) * axes(i, 1, j) - gradient(i, 1, b) * axes(i, 3, j))
          w(i, 3) = 0.5_wp * (gradient(i, 1, b) * axes(i, 2, j) - gradient(i, 2, b) * axes(i, 1, j))
        end do
        do k = 1, 6
          do i = 1, LANES
            by_displacement(i, k, j, b) = by_displacement(i, k, j, b) + of_spin(i, k, 1) * w(i, 1) &
              + of_spin(i, k, 2) * w(i, 2) + of_spin(i, k, 3) * w(i, 3)
          end do
        end do
      end do
    end do

  end subroutine add_spin

end module swage_cell_strain
