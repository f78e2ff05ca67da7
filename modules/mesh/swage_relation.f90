!> Relations between two numbered sets, as lists of items of each.
module swage_relation
  implicit none(type, external)
  private

  public :: relation_t, pair_list_t, relation_from_pairs

  !> Items related to each of `n` things, ascending: `item(first(i):first(i + 1) - 1)`.
  type :: relation_t
    !> Shape (n + 1).
    integer, allocatable :: first(:)
    integer, allocatable :: item(:)
  contains
    !> Items of one thing.
    procedure :: items => relation_items
    !> The same relation seen from the items.
    procedure :: inverse => relation_inverse
  end type relation_t

  !> A growing list of pairs; `left(:n)` and `right(:n)` count.
  type :: pair_list_t
    integer :: n = 0
    integer, allocatable :: left(:), right(:)
  contains
    !> Add a pair.
    procedure :: append => pair_list_append
  end type pair_list_t

contains

  !> Sort pairs into a relation; a pair that occurs twice counts once. O(n), by counting.
  pure subroutine relation_from_pairs(n_left, n_right, left, right, relation)
    integer, intent(in) :: n_left, n_right
    !> From 1 to n_left.
    integer, intent(in) :: left(:)
    !> From 1 to n_right; shape as `left`.
    integer, intent(in) :: right(:)
    type(relation_t), intent(out) :: relation

    integer, allocatable :: last(:), order(:), place(:)
    integer :: i, pair

    ! By the right, then, keeping that order, by the left.
    allocate (place(n_right + 1), order(size(left)))
    place = 0
    do i = 1, size(right)
      place(right(i) + 1) = place(right(i) + 1) + 1
    end do
    place(1) = 1
    do i = 2, n_right + 1
      place(i) = place(i - 1) + place(i)
    end do
    do i = 1, size(right)
      order(place(right(i))) = i
      place(right(i)) = place(right(i)) + 1
    end do

    ! Equal pairs meet: the last item of each left tells a repetition.
    allocate (relation%first(n_left + 1), last(n_left))
    relation%first = 0
    last = 0
    do i = 1, size(order)
      pair = order(i)
      if (last(left(pair)) == right(pair)) cycle
      last(left(pair)) = right(pair)
      relation%first(left(pair) + 1) = relation%first(left(pair) + 1) + 1
    end do
    relation%first(1) = 1
    do i = 2, n_left + 1
      relation%first(i) = relation%first(i - 1) + relation%first(i)
    end do
    allocate (relation%item(relation%first(n_left + 1) - 1))
    deallocate (place)
    allocate (place(n_left))
    place = relation%first(:n_left)
    last = 0
    do i = 1, size(order)
      pair = order(i)
      if (last(left(pair)) == right(pair)) cycle
      last(left(pair)) = right(pair)
      relation%item(place(left(pair))) = right(pair)
      place(left(pair)) = place(left(pair)) + 1
    end do

  end subroutine relation_from_pairs

  pure function relation_items(self, thing) result(items)
    class(relation_t), intent(in) :: self
    integer, intent(in) :: thing
    integer, allocatable :: items(:)

    allocate (items(self%first(thing + 1) - self%first(thing)))
    items = self%item(self%first(thing):self%first(thing + 1) - 1)

  end function relation_items

  pure subroutine relation_inverse(self, n_item, inverse)
    class(relation_t), intent(in) :: self
    !> Items that exist.
    integer, intent(in) :: n_item
    type(relation_t), intent(out) :: inverse

    integer, allocatable :: thing(:)
    integer :: i, n

    n = size(self%first) - 1
    allocate (thing(size(self%item)))
    do i = 1, n
      thing(self%first(i):self%first(i + 1) - 1) = i
    end do
    call relation_from_pairs(n_item, n, self%item, thing, inverse)

  end subroutine relation_inverse

  pure subroutine pair_list_append(self, left, right)
    class(pair_list_t), intent(inout) :: self
    integer, intent(in) :: left, right

    integer, allocatable :: longer(:)

    if (.not. allocated(self%left)) allocate (self%left(64), self%right(64))
    if (self%n == size(self%left)) then
      allocate (longer(2 * self%n))
      longer(:self%n) = self%left
      call move_alloc(longer, self%left)
      allocate (longer(2 * self%n))
      longer(:self%n) = self%right
      call move_alloc(longer, self%right)
    end if
    self%n = self%n + 1
    self%left(self%n) = left
    self%right(self%n) = right

  end subroutine pair_list_append

end module swage_relation
