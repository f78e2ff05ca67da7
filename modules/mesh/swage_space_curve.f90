!> Order of points along a curve that fills space: what is near in the order is near in space.
!>
!> Nodes and cells numbered along it find their neighbours in the cache.
!>
!> Source: D. Hilbert (1891) for the curve; J. Skilling, Programming the Hilbert curve, AIP
!> Conference Proceedings 707 (2004) 381–387, for the computation of places on it bit by bit.
module swage_space_curve
  use swage_kinds, only: gp, wp
  use swage_sort, only: sorting_order
  implicit none(type, external)
  private

  public :: curve_order, curve_place

  !> Levels of the curve: 2^20 boxes along each axis tell any two nodes apart.
  integer, parameter :: N_LEVEL = 20

contains

  !> The permutation that puts points in their order along the curve; points of one box keep theirs.
  pure function curve_order(x) result(order)
    !> Positions [length]; shape (2 or 3, n).
    real(wp), intent(in) :: x(:, :)
    !> Shape (n).
    integer :: order(size(x, 2))

    integer(gp), allocatable :: places(:)
    real(wp) :: extent, origin(size(x, 1))
    integer :: i

    if (size(x, 2) == 0) return
    origin = minval(x, dim=2)
    ! The boxes are cubes
    extent = max(maxval(maxval(x, dim=2) - origin), tiny(1.0_wp))
    allocate (places(size(x, 2)))
    do i = 1, size(x, 2)
      places(i) = curve_place(min(int((x(:, i) - origin) / extent * 2.0_wp**N_LEVEL), &
                                  2**N_LEVEL - 1), N_LEVEL)
    end do
    order = sorting_order(places)

  end function curve_order

  !> Place of a box on the curve, from 0.
  pure function curve_place(box, n_level) result(place)
    !> Its place along each axis, 0 to 2^n_level - 1; shape (2 or 3).
    integer, intent(in) :: box(:)
    !> size(box) * n_level is at most 62.
    integer, intent(in) :: n_level
    integer(gp) :: place

    integer :: axis, below, bit, n, swapped, turned(size(box))

    ! Each half of an axis is entered turned or mirrored, so that the curve does not jump
    n = size(box)
    turned = box
    do bit = n_level - 1, 1, -1
      below = 2**bit - 1
      do axis = 1, n
        if (btest(turned(axis), bit)) then
          turned(1) = ieor(turned(1), below)
        else
          swapped = iand(ieor(turned(1), turned(axis)), below)
          turned(1) = ieor(turned(1), swapped)
          turned(axis) = ieor(turned(axis), swapped)
        end if
      end do
    end do

    ! Neighbours differ by one bit: the code of Gray, undone
    do axis = 2, n
      turned(axis) = ieor(turned(axis), turned(axis - 1))
    end do
    swapped = 0
    do bit = n_level - 1, 1, -1
      if (btest(turned(n), bit)) swapped = ieor(swapped, 2**bit - 1)
    end do
    turned = ieor(turned, swapped)

    place = 0_gp
    do bit = n_level - 1, 0, -1
      do axis = 1, n
        place = 2_gp * place
        if (btest(turned(axis), bit)) place = place + 1_gp
      end do
    end do

  end function curve_place

end module swage_space_curve
