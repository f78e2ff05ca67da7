!> Closed surfaces of facets, counterclockwise seen from outside.
module swage_test_surfaces
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: circle_facets, cube_facets, cylinder_facets, sphere_facets, write_text_stl

contains

  !> The cube from -1 to 1; shape (3, 3, 12).
  pure subroutine cube_facets(corners)
    real(wp), allocatable, intent(out) :: corners(:, :, :)

    integer :: axis, n, side
    real(wp) :: a(3), b(3), c(3), d(3), sign

    allocate (corners(3, 3, 12))
    n = 0
    do axis = 1, 3
      do side = 1, 2
        sign = 2.0_wp * side - 3.0_wp
        a = point(-sign, -1.0_wp)
        b = point(sign, -1.0_wp)
        c = point(sign, 1.0_wp)
        d = point(-sign, 1.0_wp)
        corners(:, :, n + 1) = reshape([a, b, c], [3, 3])
        corners(:, :, n + 2) = reshape([a, c, d], [3, 3])
        n = n + 2
      end do
    end do

  contains

    pure function point(first, second) result(x)
      real(wp), intent(in) :: first, second
      real(wp) :: x(3)

      x = cshift([sign, first, second], 1 - axis)

    end function point

  end subroutine cube_facets

  !> The unit sphere: an octahedron whose facets are quartered and moved outwards again and again.
  !> Facets of one level differ in shape by a factor of two.
  pure subroutine sphere_facets(level, corners)
    integer, intent(in) :: level
    !> Shape (3, 3, 8·4^level).
    real(wp), allocatable, intent(out) :: corners(:, :, :)

    integer :: i, k, refinement
    real(wp) :: a(3), b(3), c(3), middle(3, 3), sign(3)
    real(wp), allocatable :: finer(:, :, :)

    allocate (corners(3, 3, 8))
    do i = 1, 8
      sign = 2.0_wp * [mod(i - 1, 2), mod((i - 1) / 2, 2), (i - 1) / 4] - 1.0_wp
      a = [sign(1), 0.0_wp, 0.0_wp]
      b = [0.0_wp, sign(2), 0.0_wp]
      c = [0.0_wp, 0.0_wp, sign(3)]
      corners(:, :, i) = reshape([a, b, c], [3, 3])
      if (product(sign) < 0.0_wp) corners(:, :, i) = reshape([a, c, b], [3, 3])
    end do
    do refinement = 1, level
      allocate (finer(3, 3, 4 * size(corners, 3)))
      do i = 1, size(corners, 3)
        do k = 1, 3
          middle(:, k) = corners(:, k, i) + corners(:, 1 + mod(k, 3), i)
          middle(:, k) = middle(:, k) / norm2(middle(:, k))
        end do
        do k = 1, 3
          finer(:, :, 4 * i - 4 + k) = reshape([corners(:, k, i), middle(:, k), &
                                                middle(:, 1 + mod(k + 1, 3))], [3, 3])
        end do
        finer(:, :, 4 * i) = middle
      end do
      call move_alloc(finer, corners)
    end do

  end subroutine sphere_facets

  !> A cylinder of radius 1 about z from -1 to 1 with flat ends, of n sides.
  pure subroutine cylinder_facets(n, corners)
    integer, intent(in) :: n
    !> Shape (3, 3, 4 n).
    real(wp), allocatable, intent(out) :: corners(:, :, :)

    real(wp), parameter :: TURN = 2.0_wp * acos(-1.0_wp)

    integer :: i
    real(wp) :: a(3), b(3), bottom(3), c(3), d(3), top(3)

    allocate (corners(3, 3, 4 * n))
    top = [0.0_wp, 0.0_wp, 1.0_wp]
    bottom = -top
    do i = 1, n
      a = [cos(TURN * (i - 1) / n), sin(TURN * (i - 1) / n), -1.0_wp]
      b = [cos(TURN * i / n), sin(TURN * i / n), -1.0_wp]
      c = [b(1), b(2), 1.0_wp]
      d = [a(1), a(2), 1.0_wp]
      corners(:, :, 4 * i - 3) = reshape([a, b, c], [3, 3])
      corners(:, :, 4 * i - 2) = reshape([a, c, d], [3, 3])
      corners(:, :, 4 * i - 1) = reshape([d, c, top], [3, 3])
      corners(:, :, 4 * i) = reshape([b, a, bottom], [3, 3])
    end do

  end subroutine cylinder_facets

  !> The unit circle of n lines, the outside on their right.
  pure subroutine circle_facets(n, corners)
    integer, intent(in) :: n
    !> Shape (3, 2, n).
    real(wp), allocatable, intent(out) :: corners(:, :, :)

    real(wp), parameter :: TURN = 2.0_wp * acos(-1.0_wp)

    integer :: i, k

    allocate (corners(3, 2, n))
    do i = 1, n
      do k = 1, 2
        corners(:, k, i) = [cos(TURN * (i + k - 2) / n), sin(TURN * (i + k - 2) / n), 0.0_wp]
      end do
    end do

  end subroutine circle_facets

  !> Write facets as a text STL without normals.
  subroutine write_text_stl(path, corners)
    character(len=*), intent(in) :: path
    real(wp), intent(in) :: corners(:, :, :)

    integer :: i, k, unit

    open (newunit=unit, file=path, status='replace', action='write')
    write (unit, '(a)') 'solid test'
    do i = 1, size(corners, 3)
      write (unit, '(a)') '  facet normal 0 0 0', '    outer loop'
      do k = 1, 3
        write (unit, '(a, 3es25.16)') '      vertex', corners(:, k, i)
      end do
      write (unit, '(a)') '    endloop', '  endfacet'
    end do
    write (unit, '(a)') 'endsolid test'
    close (unit)

  end subroutine write_text_stl

end module swage_test_surfaces
