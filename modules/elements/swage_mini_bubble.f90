!> Blocks of the bubble function of P1+/P1 cells, many side by side: cubic in triangles, quartic in
!> tetrahedra.
!>
!> \(K_{bb} = \mu \int (|\nabla b|^2 I + \tfrac13 \nabla b \otimes \nabla b)\), from the deviator
!> alone; \(K_{bp} = \int b\,\nabla\lambda\). Axial symmetry weights with the radius of the
!> centroid, and adds the hoop strain b/r: only there the bubble strains the cell in the mean, by
!> its integral E over the volume.
module swage_mini_bubble
  use swage_cell_geometry, only: AXISYMMETRIC, THREE_DIMENSIONAL
  use swage_kinds, only: wp
  use swage_mandel, only: SQRT2
  use swage_point_batch, only: LANES
  implicit none(type, external)
  private

  public :: add_bubble_force, add_bubble_strain, find_bubble_blocks, move_bubble

  !> Integrals of the bubble b over the cell, by its measure: of b, of grad b ⊗ grad b by the sum
  !> of grad λ ⊗ grad λ, and of b².
  real(wp), parameter :: BUBBLE_MEAN(2:3) = [9.0_wp / 20.0_wp, 32.0_wp / 105.0_wp]
  real(wp), parameter :: BUBBLE_STIFFNESS(2:3) = [81.0_wp / 20.0_wp, 4096.0_wp / 945.0_wp]
  real(wp), parameter :: BUBBLE_SQUARE_2D = 81.0_wp / 280.0_wp

contains

  !> The blocks for the secant modulus 2µ.
  pure subroutine find_bubble_blocks(kind, gradient, hoop, volume, modulus, compliance, &
                                     by_pressure, moment)
    integer, intent(in) :: kind
    !> Of the vertex functions [1/length].
    real(wp), intent(in) :: gradient(LANES, 3, 4)
    real(wp), intent(in) :: hoop(LANES)
    real(wp), intent(in) :: volume(LANES)
    !> Secant 2µ [stress], positive.
    real(wp), intent(in) :: modulus(LANES)
    !> K_bb^-1 [length/force].
    real(wp), intent(out) :: compliance(LANES, 3, 3)
    !> K_bp [length^2].
    real(wp), intent(out) :: by_pressure(LANES, 3, 4)
    !> Integral of the hoop strain of a unit bubble [length^2]; 0 unless axisymmetric.
    real(wp), intent(out) :: moment(LANES)

    real(wp) :: c11, c12, c13, c22, c23, c33, determinant, inverse, p11, p12, p13, p22, p23, p33, &
      s11, s12, s13, s22, s23, s33, scale, square, trace
    integer :: i, j, n

    n = merge(3, 2, kind == THREE_DIMENSIONAL)
    do j = 1, 4
      do i = 1, LANES
        by_pressure(i, 1, j) = BUBBLE_MEAN(n) * volume(i) * gradient(i, 1, j)
        by_pressure(i, 2, j) = BUBBLE_MEAN(n) * volume(i) * gradient(i, 2, j)
        by_pressure(i, 3, j) = BUBBLE_MEAN(n) * volume(i) * gradient(i, 3, j)
      end do
    end do
    square = 0.0_wp
    if (kind == AXISYMMETRIC) square = 2.0_wp / 3.0_wp * BUBBLE_SQUARE_2D

    do i = 1, LANES
      p11 = gradient(i, 1, 1)**2 + gradient(i, 1, 2)**2 + gradient(i, 1, 3)**2 &
        + gradient(i, 1, 4)**2
      p22 = gradient(i, 2, 1)**2 + gradient(i, 2, 2)**2 + gradient(i, 2, 3)**2 &
        + gradient(i, 2, 4)**2
      p33 = gradient(i, 3, 1)**2 + gradient(i, 3, 2)**2 + gradient(i, 3, 3)**2 &
        + gradient(i, 3, 4)**2
      p23 = gradient(i, 2, 1) * gradient(i, 3, 1) + gradient(i, 2, 2) * gradient(i, 3, 2) &
        + gradient(i, 2, 3) * gradient(i, 3, 3) + gradient(i, 2, 4) * gradient(i, 3, 4)
      p13 = gradient(i, 1, 1) * gradient(i, 3, 1) + gradient(i, 1, 2) * gradient(i, 3, 2) &
        + gradient(i, 1, 3) * gradient(i, 3, 3) + gradient(i, 1, 4) * gradient(i, 3, 4)
      p12 = gradient(i, 1, 1) * gradient(i, 2, 1) + gradient(i, 1, 2) * gradient(i, 2, 2) &
        + gradient(i, 1, 3) * gradient(i, 2, 3) + gradient(i, 1, 4) * gradient(i, 2, 4)
      trace = p11 + p22 + p33
      scale = 0.5_wp * BUBBLE_STIFFNESS(n) * modulus(i) * volume(i)
      ! The radius of the centroid is 1 / (3 hoop)
      s11 = scale * (p11 / 3.0_wp + trace) &
        + square * modulus(i) * volume(i) * (3.0_wp * hoop(i))**2
      s22 = scale * (p22 / 3.0_wp + trace)
      s33 = scale * (p33 / 3.0_wp + trace)
      s23 = scale * p23 / 3.0_wp
      s13 = scale * p13 / 3.0_wp
      s12 = scale * p12 / 3.0_wp

      c11 = s22 * s33 - s23**2
      c12 = s13 * s23 - s12 * s33
      c13 = s12 * s23 - s13 * s22
      c22 = s11 * s33 - s13**2
      c23 = s12 * s13 - s11 * s23
      c33 = s11 * s22 - s12**2
      determinant = s11 * c11 + s12 * c12 + s13 * c13
      inverse = 1.0_wp / determinant
      compliance(i, 1, 1) = inverse * c11
      compliance(i, 2, 1) = inverse * c12
      compliance(i, 3, 1) = inverse * c13
      compliance(i, 1, 2) = inverse * c12
      compliance(i, 2, 2) = inverse * c22
      compliance(i, 3, 2) = inverse * c23
      compliance(i, 1, 3) = inverse * c13
      compliance(i, 2, 3) = inverse * c23
      compliance(i, 3, 3) = inverse * c33
      moment(i) = BUBBLE_MEAN(n) * volume(i) * 3.0_wp * hoop(i)
    end do

  end subroutine find_bubble_blocks

  !> Displacement of the bubble that a force on it leaves, turned around: -C f, by a factor.
  pure subroutine move_bubble(factor, compliance, force, bubble)
    real(wp), intent(in) :: factor(LANES)
    real(wp), intent(in) :: compliance(LANES, 3, 3)
    real(wp), intent(in) :: force(LANES, 3)
    real(wp), intent(out) :: bubble(LANES, 3)

    integer :: i, j

    do j = 1, 3
      do i = 1, LANES
        bubble(i, j) = -factor(i) * (compliance(i, j, 1) * force(i, 1) &
                                     + compliance(i, j, 2) * force(i, 2) &
                                     + compliance(i, j, 3) * force(i, 3))
      end do
    end do

  end subroutine move_bubble

  !> Add \(E u\), what a bubble displacement strains the cell in the mean, times its volume.
  pure subroutine add_bubble_strain(moment, weight, bubble, strain)
    !> See [[find_bubble_blocks]].
    real(wp), intent(in) :: moment(LANES)
    !> Factor.
    real(wp), intent(in) :: weight(LANES)
    !> u [length].
    real(wp), intent(in) :: bubble(LANES, 3)
    !> Mandel.
    real(wp), intent(inout) :: strain(LANES, 6)

    integer :: i

    do i = 1, LANES
      strain(i, 1) = strain(i, 1) - weight(i) * moment(i) * bubble(i, 1)
      strain(i, 3) = strain(i, 3) + weight(i) * moment(i) * bubble(i, 1)
      strain(i, 6) = strain(i, 6) - weight(i) * moment(i) / SQRT2 * bubble(i, 2)
    end do

  end subroutine add_bubble_strain

  !> Add \(E^T s\), the force on the bubble of a tensor that is constant in the cell.
  pure subroutine add_bubble_force(moment, weight, s, force)
    !> See [[find_bubble_blocks]].
    real(wp), intent(in) :: moment(LANES)
    !> Factor.
    real(wp), intent(in) :: weight(LANES)
    !> Mandel.
    real(wp), intent(in) :: s(LANES, 6)
    real(wp), intent(inout) :: force(LANES, 3)

    integer :: i

    do i = 1, LANES
      force(i, 1) = force(i, 1) + weight(i) * moment(i) * (s(i, 3) - s(i, 1))
      force(i, 2) = force(i, 2) - weight(i) * moment(i) / SQRT2 * s(i, 6)
    end do

  end subroutine add_bubble_force

end module swage_mini_bubble
