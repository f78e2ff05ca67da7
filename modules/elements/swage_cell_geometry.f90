!> Gradients and measures of simplices, many side by side.
!>
!> Arrays of cells have the cell as their first index, `LANES` of them, so that the loops over cells
!> become vector instructions. Triangles use the same arrays as tetrahedra: their third component
!> and fourth vertex are zero.
module swage_cell_geometry
  use swage_kinds, only: wp
  use swage_point_batch, only: LANES
  implicit none(type, external)
  private

  public :: cell_volume, find_gradients
  public :: PLANE_STRAIN, AXISYMMETRIC, THREE_DIMENSIONAL

  !> Kinds of analysis.
  integer, parameter :: PLANE_STRAIN = 1
  integer, parameter :: AXISYMMETRIC = 2
  integer, parameter :: THREE_DIMENSIONAL = 3

  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)

contains

  !> Gradients of the vertex functions, hoop strain of a unit radial displacement and measure, part
  !> of the way from one configuration to another.
  pure subroutine find_gradients(kind, x, u, share, gradient, hoop, volume)
    !> `PLANE_STRAIN`, `AXISYMMETRIC` or `THREE_DIMENSIONAL`.
    integer, intent(in) :: kind
    !> Vertices, and their displacements [length].
    real(wp), intent(in) :: x(LANES, 3, 4)
    real(wp), intent(in) :: u(LANES, 3, 4)
    !> Share of the displacements [1].
    real(wp), intent(in) :: share
    !> [1/length]. Without meaning where the volume is 0.
    real(wp), intent(out) :: gradient(LANES, 3, 4)
    !> Hoop strain of a unit radial displacement of one vertex [1/length]; 0 unless axisymmetric.
    real(wp), intent(out) :: hoop(LANES)
    !> Positive for a cell that is not inverted [length^3]: per unit thickness in plane strain, of
    !> the full turn in axial symmetry.
    real(wp), intent(out) :: volume(LANES)

    if (kind == THREE_DIMENSIONAL) then
      call find_in_tetrahedra(x, u, share, gradient, volume)
      hoop = 0.0_wp
    else
      call find_in_triangles(kind == AXISYMMETRIC, x, u, share, gradient, hoop, volume)
    end if

  end subroutine find_gradients

  pure subroutine find_in_tetrahedra(x, u, share, gradient, volume)
    real(wp), intent(in) :: x(LANES, 3, 4)
    real(wp), intent(in) :: u(LANES, 3, 4)
    real(wp), intent(in) :: share
    real(wp), intent(out) :: gradient(LANES, 3, 4)
    real(wp), intent(out) :: volume(LANES)

    real(wp) :: a1, a2, a3, b1, b2, b3, c1, c2, c3, determinant, inverse
    integer :: i

    do i = 1, LANES
      ! Edges from the first vertex
      a1 = x(i, 1, 2) - x(i, 1, 1) + share * (u(i, 1, 2) - u(i, 1, 1))
      a2 = x(i, 2, 2) - x(i, 2, 1) + share * (u(i, 2, 2) - u(i, 2, 1))
      a3 = x(i, 3, 2) - x(i, 3, 1) + share * (u(i, 3, 2) - u(i, 3, 1))
      b1 = x(i, 1, 3) - x(i, 1, 1) + share * (u(i, 1, 3) - u(i, 1, 1))
      b2 = x(i, 2, 3) - x(i, 2, 1) + share * (u(i, 2, 3) - u(i, 2, 1))
      b3 = x(i, 3, 3) - x(i, 3, 1) + share * (u(i, 3, 3) - u(i, 3, 1))
      c1 = x(i, 1, 4) - x(i, 1, 1) + share * (u(i, 1, 4) - u(i, 1, 1))
      c2 = x(i, 2, 4) - x(i, 2, 1) + share * (u(i, 2, 4) - u(i, 2, 1))
      c3 = x(i, 3, 4) - x(i, 3, 1) + share * (u(i, 3, 4) - u(i, 3, 1))
      determinant = a1 * (b2 * c3 - b3 * c2) + a2 * (b3 * c1 - b1 * c3) + a3 * (b1 * c2 - b2 * c1)
      volume(i) = determinant / 6.0_wp
      inverse = 1.0_wp / merge(determinant, 1.0_wp, abs(determinant) > 0.0_wp)
      gradient(i, 1, 2) = inverse * (b2 * c3 - b3 * c2)
      gradient(i, 2, 2) = inverse * (b3 * c1 - b1 * c3)
      gradient(i, 3, 2) = inverse * (b1 * c2 - b2 * c1)
      gradient(i, 1, 3) = inverse * (c2 * a3 - c3 * a2)
      gradient(i, 2, 3) = inverse * (c3 * a1 - c1 * a3)
      gradient(i, 3, 3) = inverse * (c1 * a2 - c2 * a1)
      gradient(i, 1, 4) = inverse * (a2 * b3 - a3 * b2)
      gradient(i, 2, 4) = inverse * (a3 * b1 - a1 * b3)
      gradient(i, 3, 4) = inverse * (a1 * b2 - a2 * b1)
      gradient(i, 1, 1) = -gradient(i, 1, 2) - gradient(i, 1, 3) - gradient(i, 1, 4)
      gradient(i, 2, 1) = -gradient(i, 2, 2) - gradient(i, 2, 3) - gradient(i, 2, 4)
      gradient(i, 3, 1) = -gradient(i, 3, 2) - gradient(i, 3, 3) - gradient(i, 3, 4)
    end do

  end subroutine find_in_tetrahedra

  pure subroutine find_in_triangles(around_axis, x, u, share, gradient, hoop, volume)
    !> True in axial symmetry: the radius is the first coordinate.
    logical, intent(in) :: around_axis
    real(wp), intent(in) :: x(LANES, 3, 4)
    real(wp), intent(in) :: u(LANES, 3, 4)
    real(wp), intent(in) :: share
    real(wp), intent(out) :: gradient(LANES, 3, 4)
    real(wp), intent(out) :: hoop(LANES)
    real(wp), intent(out) :: volume(LANES)

    real(wp) :: a1, a2, b1, b2, determinant, inverse, radii
    integer :: i

    gradient(:, 3, :) = 0.0_wp
    gradient(:, :, 4) = 0.0_wp
    do i = 1, LANES
      a1 = x(i, 1, 2) - x(i, 1, 1) + share * (u(i, 1, 2) - u(i, 1, 1))
      a2 = x(i, 2, 2) - x(i, 2, 1) + share * (u(i, 2, 2) - u(i, 2, 1))
      b1 = x(i, 1, 3) - x(i, 1, 1) + share * (u(i, 1, 3) - u(i, 1, 1))
      b2 = x(i, 2, 3) - x(i, 2, 1) + share * (u(i, 2, 3) - u(i, 2, 1))
      determinant = a1 * b2 - b1 * a2
      volume(i) = 0.5_wp * determinant
      inverse = 1.0_wp / merge(determinant, 1.0_wp, abs(determinant) > 0.0_wp)
      gradient(i, 1, 2) = inverse * b2
      gradient(i, 2, 2) = -inverse * b1
      gradient(i, 1, 3) = -inverse * a2
      gradient(i, 2, 3) = inverse * a1
      gradient(i, 1, 1) = inverse * (a2 - b2)
      gradient(i, 2, 1) = inverse * (b1 - a1)
    end do
    hoop = 0.0_wp
    if (.not. around_axis) return
    do i = 1, LANES
      radii = x(i, 1, 1) + x(i, 1, 2) + x(i, 1, 3) &
        + share * (u(i, 1, 1) + u(i, 1, 2) + u(i, 1, 3))
      volume(i) = volume(i) * TWO_PI * radii / 3.0_wp
      hoop(i) = 1.0_wp / merge(radii, 1.0_wp, abs(radii) > 0.0_wp)
    end do

  end subroutine find_in_triangles

  !> Signed measure of one cell [length^3]; see [[find_gradients]].
  pure function cell_volume(kind, x) result(volume)
    integer, intent(in) :: kind
    !> Vertices [length]; shape (n_dim, n_dim + 1).
    real(wp), contiguous, intent(in) :: x(:, :)
    real(wp) :: volume

    real(wp) :: a(3), b(3), c(3)

    if (kind == THREE_DIMENSIONAL) then
      a = x(:, 2) - x(:, 1)
      b = x(:, 3) - x(:, 1)
      c = x(:, 4) - x(:, 1)
      volume = (a(1) * (b(2) * c(3) - b(3) * c(2)) + a(2) * (b(3) * c(1) - b(1) * c(3)) &
                + a(3) * (b(1) * c(2) - b(2) * c(1))) / 6.0_wp
    else
      a(:2) = x(:, 2) - x(:, 1)
      b(:2) = x(:, 3) - x(:, 1)
      volume = 0.5_wp * (a(1) * b(2) - b(1) * a(2))
      if (kind == AXISYMMETRIC) volume = volume * TWO_PI * sum(x(1, :)) / 3.0_wp
    end if

  end function cell_volume

end module swage_cell_geometry
