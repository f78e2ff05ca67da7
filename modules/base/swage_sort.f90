!> Sorting of long integers, and search in ascending lists.
module swage_sort
  use swage_kinds, only: gp, wp
  implicit none(type, external)
  private

  public :: sorting_order, find_sorted, last_not_above

contains

  !> The permutation that sorts the keys: `keys(order)` ascends, equal keys keep their order.
  !>
  !> Merge sort from below, O(n log n) whatever the keys.
  pure function sorting_order(keys) result(order)
    integer(gp), intent(in) :: keys(:)
    !> Shape (size(keys)).
    integer :: order(size(keys))

    integer, allocatable :: merged(:)
    integer :: first, i, j, k, last, middle, n, width

    n = size(keys)
    do i = 1, n
      order(i) = i
    end do
    if (n < 2) return

    allocate (merged(n))
    width = 1
    do while (width < n)
      do first = 1, n, 2 * width
        middle = min(first + width, n + 1)
        last = min(first + 2 * width - 1, n)
        i = first
        j = middle
        do k = first, last
          if (takes_left(i, middle, j, last)) then
            merged(k) = order(i)
            i = i + 1
          else
            merged(k) = order(j)
            j = j + 1
          end if
        end do
      end do
      order = merged
      if (width > n / 2) exit
      width = 2 * width
    end do

  contains

    !> Whether the next item comes from the left run.
    pure function takes_left(left, left_end, right, right_last) result(left_wins)
      integer, intent(in) :: left, left_end, right, right_last
      logical :: left_wins

      if (left >= left_end) then
        left_wins = .false.
      else if (right > right_last) then
        left_wins = .true.
      else
        left_wins = keys(order(left)) <= keys(order(right))
      end if

    end function takes_left

  end function sorting_order

  !> Place of a value in an ascending list, by bisection; 0 when it is not there.
  pure function find_sorted(values, value) result(place)
    integer(gp), intent(in) :: values(:)
    integer(gp), intent(in) :: value
    integer :: place

    integer :: high, low, middle

    low = 1
    high = size(values)
    do while (low <= high)
      middle = low + (high - low) / 2
      if (values(middle) < value) then
        low = middle + 1
      else if (values(middle) > value) then
        high = middle - 1
      else
        place = middle
        return
      end if
    end do
    place = 0

  end function find_sorted

  !> Place of the last of ascending values that is not above another; 0 when all are. By bisection.
  pure function last_not_above(values, value) result(low)
    real(wp), intent(in) :: values(:)
    real(wp), intent(in) :: value
    integer :: low

    integer :: high, middle

    low = 0
    high = size(values) + 1
    do while (high - low > 1)
      middle = (low + high) / 2
      if (values(middle) <= value) then
        low = middle
      else
        high = middle
      end if
    end do

  end function last_not_above

end module swage_sort
