!> Rows of a table in equal slabs, one slab a rank, brought to the ranks that want them by number.
!>
!> Nobody holds more than a slab: rank `mod(number, n_rank)` keeps for each number the row it is in,
!> tells those who ask, and they ask the rank whose slab holds the row.
module swage_row_map
  use swage_comm, only: comm_t
  use swage_kinds, only: gp, wp
  use swage_sort, only: find_sorted, sorting_order
  implicit none(type, external)
  private

  public :: row_map_t, row_map_create, slab_start

  !> Who sends which rows of its slab to whom. Holds no resource: copy it freely.
  type :: row_map_t
    private
    type(comm_t) :: comm
    !> Rows of this rank's slab that others want, by rank, from 1, and how many each wants.
    integer, allocatable :: given(:)
    integer, allocatable :: n_given(:)
    !> Where the rows that come from each rank belong, and how many come; by rank.
    integer, allocatable :: place(:)
    integer, allocatable :: n_taken(:)
    !> The lowest number wanted that no row has, and the lowest that several have; 0 none.
    integer(gp), public :: missing = 0_gp
    integer(gp), public :: twice = 0_gp
  contains
    !> Collective. Columns of the slabs for those who want them.
    generic, public :: fetch => fetch_reals, fetch_longs
    procedure, private :: fetch_reals
    procedure, private :: fetch_longs
  end type row_map_t

contains

  !> Rows before the slab of a rank; those of `rank = n_rank` are all rows.
  pure function slab_start(n_row, rank, n_rank) result(n_before)
    !> Of the table.
    integer(gp), intent(in) :: n_row
    integer, intent(in) :: rank
    integer, intent(in) :: n_rank
    integer(gp) :: n_before

    n_before = (n_row / n_rank) * rank + min(int(rank, gp), mod(n_row, int(n_rank, gp)))

  end function slab_start

  !> Collective. Nothing may be fetched when a number is missing or occurs twice.
  subroutine row_map_create(comm, number_of_row, wanted, map)
    type(comm_t), intent(in) :: comm
    !> Numbers of the rows in this rank's slab, not negative.
    integer(gp), contiguous, intent(in) :: number_of_row(:)
    !> Numbers whose rows this rank wants.
    integer(gp), contiguous, intent(in) :: wanted(:)
    type(row_map_t), intent(out) :: map

    integer(gp), allocatable :: asked(:), known(:), numbers(:), row(:), rows(:)
    integer(gp) :: n_all, n_before
    integer, allocatable :: n_asked(:), n_known(:), n_numbers(:), n_wanted(:), order(:), owner(:), &
      own_order(:)
    integer :: i, place

    map%comm = comm
    allocate (n_asked(0:comm%size - 1), n_known(0:comm%size - 1), n_numbers(0:comm%size - 1), &
              n_wanted(0:comm%size - 1))

    ! Tell the keepers which row each number is in
    call comm%locate(size(number_of_row, kind=gp), n_before, n_all)
    allocate (rows(size(number_of_row)))
    rows = [(n_before + i, i=1, size(number_of_row))]
    call sort_by_rank(int(modulo(number_of_row, int(comm%size, gp))), comm%size, own_order, &
                      n_numbers)
    call comm%exchange(n_numbers, n_known)
    allocate (numbers(sum(n_known)), known(sum(n_known)))
    call exchange_chosen(comm, number_of_row, own_order, n_numbers, numbers, n_known)
    call exchange_chosen(comm, rows, own_order, n_numbers, known, n_known)
    allocate (order(size(numbers)))
    order = sorting_order(numbers)
    numbers = numbers(order)
    known = known(order)
    do i = 2, size(numbers)
      if (numbers(i) == numbers(i - 1)) call keep_lowest(map%twice, numbers(i))
    end do

    ! Ask them
    deallocate (order)
    call sort_by_rank(int(modulo(wanted, int(comm%size, gp))), comm%size, order, n_wanted)
    call comm%exchange(n_wanted, n_asked)
    allocate (asked(sum(n_asked)))
    call exchange_chosen(comm, wanted, order, n_wanted, asked, n_asked)
    do i = 1, size(asked)
      place = find_sorted(numbers, asked(i))
      if (place == 0) then
        call keep_lowest(map%missing, asked(i))
        asked(i) = 1_gp
      else
        asked(i) = known(place)
      end if
    end do
    allocate (row(size(wanted)))
    call comm%exchange(asked, n_asked, row, n_wanted)
    call settle(comm, map%missing)
    call settle(comm, map%twice)
    if (map%missing /= 0_gp .or. map%twice /= 0_gp) return

    ! `row` is ordered as `wanted(order)`: ask the owners of the slabs
    allocate (owner(size(row)))
    do i = 1, size(row)
      owner(i) = slab_of(row(i), n_all, comm%size)
    end do
    allocate (map%n_taken(0:comm%size - 1), map%n_given(0:comm%size - 1))
    deallocate (own_order)
    call sort_by_rank(owner, comm%size, own_order, map%n_taken)
    allocate (map%place(size(row)))
    map%place = order(own_order)
    call comm%exchange(map%n_taken, map%n_given)
    deallocate (rows)
    allocate (rows(sum(map%n_given)), map%given(sum(map%n_given)))
    call exchange_chosen(comm, row, own_order, map%n_taken, rows, map%n_given)
    map%given = int(rows - n_before)

  end subroutine row_map_create

  subroutine fetch_reals(self, slab, values)
    class(row_map_t), intent(in) :: self
    !> Shape (n_component, rows of the slab).
    real(wp), contiguous, intent(in) :: slab(:, :)
    !> In the order of the numbers wanted; shape (n_component, n_wanted).
    real(wp), contiguous, intent(out) :: values(:, :)

    real(wp), allocatable :: received(:), sent(:)
    integer :: i, n

    n = size(slab, 1)
    allocate (sent(n * size(self%given)), received(n * size(self%place)))
    do i = 1, size(self%given)
      sent((i - 1) * n + 1:i * n) = slab(:, self%given(i))
    end do
    call self%comm%exchange(sent, n * self%n_given, received, n * self%n_taken)
    do i = 1, size(self%place)
      values(:, self%place(i)) = received((i - 1) * n + 1:i * n)
    end do

  end subroutine fetch_reals

  !> The same for long integers.
  subroutine fetch_longs(self, slab, values)
    class(row_map_t), intent(in) :: self
    integer(gp), contiguous, intent(in) :: slab(:, :)
    integer(gp), contiguous, intent(out) :: values(:, :)

    integer(gp), allocatable :: received(:), sent(:)
    integer :: i, n

    n = size(slab, 1)
    allocate (sent(n * size(self%given)), received(n * size(self%place)))
    do i = 1, size(self%given)
      sent((i - 1) * n + 1:i * n) = slab(:, self%given(i))
    end do
    call self%comm%exchange(sent, n * self%n_given, received, n * self%n_taken)
    do i = 1, size(self%place)
      values(:, self%place(i)) = received((i - 1) * n + 1:i * n)
    end do

  end subroutine fetch_longs

  !> Collective. Send some values to each rank.
  subroutine exchange_chosen(comm, values, chosen, n_sent, received, n_received)
    type(comm_t), intent(in) :: comm
    integer(gp), intent(in) :: values(:)
    !> Places in `values`, by rank.
    integer, intent(in) :: chosen(:)
    integer, contiguous, intent(in) :: n_sent(0:)
    integer(gp), contiguous, intent(out) :: received(:)
    integer, contiguous, intent(in) :: n_received(0:)

    integer(gp), allocatable :: sent(:)

    allocate (sent(size(chosen)))
    sent = values(chosen)
    call comm%exchange(sent, n_sent, received, n_received)

  end subroutine exchange_chosen

  !> Items by rank, those of one rank in their order.
  pure subroutine sort_by_rank(rank_of_item, n_rank, order, n_item)
    integer, intent(in) :: rank_of_item(:)
    integer, intent(in) :: n_rank
    integer, allocatable, intent(out) :: order(:)
    !> Items of each rank; shape (0:n_rank - 1).
    integer, intent(out) :: n_item(0:)

    integer :: i, next(0:n_rank - 1), rank

    n_item = 0
    do i = 1, size(rank_of_item)
      n_item(rank_of_item(i)) = n_item(rank_of_item(i)) + 1
    end do
    next(0) = 0
    do rank = 1, n_rank - 1
      next(rank) = next(rank - 1) + n_item(rank - 1)
    end do
    allocate (order(size(rank_of_item)))
    do i = 1, size(rank_of_item)
      rank = rank_of_item(i)
      next(rank) = next(rank) + 1
      order(next(rank)) = i
    end do

  end subroutine sort_by_rank

  !> Rank whose slab holds a row.
  pure function slab_of(row, n_row, n_rank) result(rank)
    !> From 1.
    integer(gp), intent(in) :: row
    integer(gp), intent(in) :: n_row
    integer, intent(in) :: n_rank
    integer :: rank

    ! A first guess from equal slabs, right but for the remainder
    rank = int(min(int(n_rank - 1, gp), (row - 1_gp) / max(1_gp, n_row / n_rank)))
    do while (row <= slab_start(n_row, rank, n_rank))
      rank = rank - 1
    end do

  end function slab_of

  !> Collective. The lowest of all ranks' numbers, 0 standing for none.
  subroutine settle(comm, number)
    type(comm_t), intent(in) :: comm
    integer(gp), intent(inout) :: number

    if (number == 0_gp) number = huge(1_gp)
    call comm%min(number)
    if (number == huge(1_gp)) number = 0_gp

  end subroutine settle

  !> The lower of two numbers, 0 standing for none.
  pure subroutine keep_lowest(lowest, number)
    integer(gp), intent(inout) :: lowest
    integer(gp), intent(in) :: number

    if (lowest == 0_gp .or. number < lowest) lowest = number

  end subroutine keep_lowest

end module swage_row_map
