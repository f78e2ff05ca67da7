!> Structured meshes of triangles and tetrahedra, without files.
module swage_test_meshes
  use swage_kinds, only: wp
  use swage_test_random, only: random_t
  implicit none(type, external)
  private

  public :: rectangle_mesh, box_mesh, jiggle, on_boundary

contains

  !> The unit square in n × m rectangles, each split along (i, j)-(i+1, j+1).
  pure subroutine rectangle_mesh(n, m, x, cells)
    integer, intent(in) :: n
    integer, intent(in) :: m
    !> Shape (2, node); the first direction runs fastest.
    real(wp), allocatable, intent(out) :: x(:, :)
    !> Shape (3, cell).
    integer, allocatable, intent(out) :: cells(:, :)

    integer :: cell, corner, i, j, node

    allocate (x(2, (n + 1) * (m + 1)), source=0.0_wp)
    allocate (cells(3, 2 * n * m), source=0)
    node = 0
    do j = 0, m
      do i = 0, n
        node = node + 1
        x(:, node) = [real(i, wp) / n, real(j, wp) / m]
      end do
    end do
    cell = 0
    do j = 1, m
      do i = 1, n
        corner = (n + 1) * (j - 1) + i
        cells(:, cell + 1) = [corner, corner + 1, corner + n + 2]
        cells(:, cell + 2) = [corner, corner + n + 2, corner + n + 1]
        cell = cell + 2
      end do
    end do

  end subroutine rectangle_mesh

  !> The unit cube in n³ cubes of six tetrahedra around the diagonal (Kuhn).
  pure subroutine box_mesh(n, x, cells)
    integer, intent(in) :: n
    !> Shape (3, node); the first direction runs fastest.
    real(wp), allocatable, intent(out) :: x(:, :)
    !> Shape (4, cell).
    integer, allocatable, intent(out) :: cells(:, :)

    ! Order of the directions on the way along the edges; even, then odd permutations
    integer, parameter :: PATHS(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, &
                                                 1, 3, 2, 2, 1, 3, 3, 2, 1], [3, 6])
    integer :: cell, i, j, k, node, path, step(3), way(4)

    allocate (x(3, (n + 1)**3), source=0.0_wp)
    allocate (cells(4, 6 * n**3), source=0)
    node = 0
    do k = 0, n
      do j = 0, n
        do i = 0, n
          node = node + 1
          x(:, node) = real([i, j, k], wp) / n
        end do
      end do
    end do
    step = [1, n + 1, (n + 1)**2]
    cell = 0
    do k = 1, n
      do j = 1, n
        do i = 1, n
          do path = 1, 6
            way(1) = dot_product(step, [i, j, k] - 1) + 1
            way(2) = way(1) + step(PATHS(1, path))
            way(3) = way(2) + step(PATHS(2, path))
            way(4) = way(3) + step(PATHS(3, path))
            if (path > 3) way(3:4) = way([4, 3])
            cell = cell + 1
            cells(:, cell) = way
          end do
        end do
      end do
    end do

  end subroutine box_mesh

  !> Move the inner nodes of the unit square or cube by up to `amount` in each direction.
  subroutine jiggle(amount, random, x)
    real(wp), intent(in) :: amount
    type(random_t), intent(inout) :: random
    real(wp), intent(inout) :: x(:, :)

    real(wp) :: move(size(x, 1))
    integer :: node

    do node = 1, size(x, 2)
      if (on_boundary(x(:, node))) cycle
      call random%fill(-amount, amount, move)
      x(:, node) = x(:, node) + move
    end do

  end subroutine jiggle

  !> Whether a point lies on the boundary of the unit square or cube.
  pure function on_boundary(x) result(on)
    real(wp), intent(in) :: x(:)
    logical :: on

    on = any(x < 1.0e-9_wp .or. x > 1.0_wp - 1.0e-9_wp)

  end function on_boundary

end module swage_test_meshes
