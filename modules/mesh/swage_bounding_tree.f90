!> A tree of boxes over the boxes of items in space: which items are near, without looking at all.
!>
!> Building takes O(n log n), a search that meets few items O(log n).
module swage_bounding_tree
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: bounding_tree_t, tree_search_t, bounding_tree_create

  !> Nodes that wait during a search. Halving keeps the tree flat: 2^63 items would fit.
  integer, parameter :: MAXIMUM_DEPTH = 64

  !> Each node has a box that holds those of its children; a leaf has one item. Children have
  !> larger numbers than their parent, the first one the next number.
  type :: bounding_tree_t
    private
    !> Shape (3, n_node) [length].
    real(wp), allocatable :: lower(:, :)
    real(wp), allocatable :: upper(:, :)
    !> The second child; 0 in a leaf.
    integer, allocatable :: second(:)
    !> The item of a leaf; 0 elsewhere.
    integer, allocatable :: item(:)
  contains
    !> Take new boxes of the same items; the tree stays right and, while they move little, good.
    procedure, public :: refit => tree_refit
    !> The items whose boxes touch a given one.
    procedure, public :: candidates => tree_candidates
    !> Begin a search from a point.
    procedure, public :: start => tree_start
    !> The next item of a search.
    procedure, public :: next => tree_next
  end type bounding_tree_t

  !> A search for the item nearest to a point, as a loop of the caller:
  !> `start`, then `next` until it returns 0; whenever an item is nearer than `bound`, lower it.
  type :: tree_search_t
    !> Only boxes whose squared distance is below this are still looked at [length^2].
    real(wp) :: bound = 0.0_wp
    !> Nodes whose children or item have been looked at, to measure the tree.
    integer :: n_visited = 0
    real(wp), private :: point(3) = 0.0_wp
    integer, private :: n_waiting = 0
    integer, private :: node(MAXIMUM_DEPTH)
    !> Squared distance of the boxes [length^2].
    real(wp), private :: distance(MAXIMUM_DEPTH)
  end type tree_search_t

contains

  !> Make a tree: each node halves its items by their centres along the longest side.
  pure subroutine bounding_tree_create(lower, upper, tree)
    !> Corners of the boxes of the items [length]; shape (3, n_item).
    real(wp), intent(in) :: lower(:, :)
    real(wp), intent(in) :: upper(:, :)
    type(bounding_tree_t), intent(out) :: tree

    integer :: axis, first, last, middle, n_item, n_node, n_waiting, node, parent
    integer :: waiting(3, MAXIMUM_DEPTH)
    integer, allocatable :: order(:)
    real(wp), allocatable :: centre(:, :)

    n_item = size(lower, 2)
    n_node = max(2 * n_item - 1, 0)
    allocate (tree%lower(3, n_node), tree%upper(3, n_node))
    allocate (tree%second(n_node), tree%item(n_node), source=0)
    if (n_item == 0) return

    allocate (centre, source=0.5_wp * (lower + upper))
    allocate (order(n_item))
    do node = 1, n_item
      order(node) = node
    end do

    ! Each entry: a range of `order`, and the node whose second child it is, 0 for a first child
    node = 0
    n_waiting = 1
    waiting(:, 1) = [1, n_item, 0]
    do while (n_waiting > 0)
      first = waiting(1, n_waiting)
      last = waiting(2, n_waiting)
      parent = waiting(3, n_waiting)
      n_waiting = n_waiting - 1
      node = node + 1
      if (parent > 0) tree%second(parent) = node
      if (first == last) then
        tree%item(node) = order(first)
        cycle
      end if
      axis = longest_side(centre, order(first:last))
      middle = (first + last) / 2
      call select_middle(centre(axis, :), middle - first + 1, order(first:last))
      waiting(:, n_waiting + 1) = [middle + 1, last, node]
      waiting(:, n_waiting + 2) = [first, middle, 0]
      n_waiting = n_waiting + 2
    end do
    call tree%refit(lower, upper)

  end subroutine bounding_tree_create

  !> The axis along which points are spread most.
  pure function longest_side(x, list) result(axis)
    real(wp), intent(in) :: x(:, :)
    integer, intent(in) :: list(:)
    integer :: axis

    integer :: i
    real(wp) :: high(3), low(3)

    low = x(:, list(1))
    high = low
    do i = 2, size(list)
      low = min(low, x(:, list(i)))
      high = max(high, x(:, list(i)))
    end do
    axis = maxloc(high - low, dim=1)

  end function longest_side

  !> Reorder a list so that its first `n` members have the smallest values (quickselect).
  pure subroutine select_middle(value, n, list)
    real(wp), intent(in) :: value(:)
    integer, intent(in) :: n
    !> Places in `value`.
    integer, intent(inout) :: list(:)

    integer :: first, i, j, last, swapped
    real(wp) :: pivot

    first = 1
    last = size(list)
    do while (first < last)
      pivot = value(list((first + last) / 2))
      i = first
      j = last
      do while (i <= j)
        do while (value(list(i)) < pivot)
          i = i + 1
        end do
        do while (value(list(j)) > pivot)
          j = j - 1
        end do
        if (i > j) exit
        swapped = list(i)
        list(i) = list(j)
        list(j) = swapped
        i = i + 1
        j = j - 1
      end do
      if (n <= j) then
        last = j
      else if (n >= i) then
        first = i
      else
        return
      end if
    end do

  end subroutine select_middle

  pure subroutine tree_refit(self, lower, upper)
    class(bounding_tree_t), intent(inout) :: self
    !> As [[bounding_tree_create]].
    real(wp), intent(in) :: lower(:, :)
    real(wp), intent(in) :: upper(:, :)

    integer :: node

    do node = size(self%item), 1, -1
      if (self%second(node) == 0) then
        self%lower(:, node) = lower(:, self%item(node))
        self%upper(:, node) = upper(:, self%item(node))
      else
        self%lower(:, node) = min(self%lower(:, node + 1), self%lower(:, self%second(node)))
        self%upper(:, node) = max(self%upper(:, node + 1), self%upper(:, self%second(node)))
      end if
    end do

  end subroutine tree_refit

  pure subroutine tree_candidates(self, lower, upper, items)
    class(bounding_tree_t), intent(in) :: self
    !> Corners of a box [length].
    real(wp), intent(in) :: lower(3)
    real(wp), intent(in) :: upper(3)
    !> In no particular, but always the same order.
    integer, allocatable, intent(out) :: items(:)

    integer :: n, n_waiting, node
    integer :: waiting(MAXIMUM_DEPTH)
    integer, allocatable :: longer(:)

    allocate (items(8))
    n = 0
    n_waiting = min(1, size(self%item))
    waiting(1) = 1
    do while (n_waiting > 0)
      node = waiting(n_waiting)
      n_waiting = n_waiting - 1
      if (any(self%lower(:, node) > upper) .or. any(self%upper(:, node) < lower)) cycle
      if (self%second(node) > 0) then
        waiting(n_waiting + 1) = self%second(node)
        waiting(n_waiting + 2) = node + 1
        n_waiting = n_waiting + 2
        cycle
      end if
      if (n == size(items)) then
        allocate (longer(2 * n))
        longer(:n) = items
        call move_alloc(longer, items)
      end if
      n = n + 1
      items(n) = self%item(node)
    end do
    items = items(:n)

  end subroutine tree_candidates

  pure subroutine tree_start(self, point, bound, search)
    class(bounding_tree_t), intent(in) :: self
    !> [length]
    real(wp), intent(in) :: point(3)
    !> Only items nearer than this count, squared [length^2].
    real(wp), intent(in) :: bound
    type(tree_search_t), intent(out) :: search

    search%point = point
    search%bound = bound
    if (size(self%item) == 0) return
    search%n_waiting = 1
    search%node(1) = 1
    search%distance(1) = square_distance(self, 1, point)

  end subroutine tree_start

  !> Near boxes come first, so that the bound falls quickly.
  pure subroutine tree_next(self, search, item)
    class(bounding_tree_t), intent(in) :: self
    type(tree_search_t), intent(inout) :: search
    !> 0 when no box is nearer than the bound any more.
    integer, intent(out) :: item

    integer :: children(2), node
    real(wp) :: distance(2)

    item = 0
    do while (search%n_waiting > 0)
      node = search%node(search%n_waiting)
      search%n_waiting = search%n_waiting - 1
      if (search%distance(search%n_waiting + 1) >= search%bound) cycle
      search%n_visited = search%n_visited + 1
      if (self%second(node) == 0) then
        item = self%item(node)
        return
      end if
      children = [node + 1, self%second(node)]
      distance(1) = square_distance(self, children(1), search%point)
      distance(2) = square_distance(self, children(2), search%point)
      ! The nearer one on top
      if (distance(1) < distance(2)) then
        children = children([2, 1])
        distance = distance([2, 1])
      end if
      search%node(search%n_waiting + 1:search%n_waiting + 2) = children
      search%distance(search%n_waiting + 1:search%n_waiting + 2) = distance
      search%n_waiting = search%n_waiting + 2
    end do

  end subroutine tree_next

  !> Squared distance of a point from the box of a node; 0 inside [length^2].
  pure function square_distance(tree, node, point) result(square)
    type(bounding_tree_t), intent(in) :: tree
    integer, intent(in) :: node
    real(wp), intent(in) :: point(3)
    real(wp) :: square

    real(wp) :: beyond(3)

    beyond = max(tree%lower(:, node) - point, point - tree%upper(:, node), 0.0_wp)
    square = dot_product(beyond, beyond)

  end function square_distance

end module swage_bounding_tree
