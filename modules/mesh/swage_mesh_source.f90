!> A mesh as a file or a program gives it, before anything is made of it.
module swage_mesh_source
  use swage_kinds, only: gp, wp
  use swage_mesh, only: mesh_group_t
  implicit none(type, external)
  private

  public :: mesh_source_t, element_list_t, mesh_source_create, EMPTY_SET

  !> The set of groups of an element that belongs to none.
  integer, parameter :: EMPTY_SET = 1

  !> Elements of one kind; `n` of them count, the arrays may be longer.
  type :: element_list_t
    integer :: n = 0
    !> Places in `node_tag`; shape (n_corner, at least n).
    integer, allocatable :: node(:, :)
    !> Number in the file.
    integer(gp), allocatable :: tag(:)
    !> Number of the set of groups it belongs to.
    integer, allocatable :: set(:)
  contains
    !> Make room for more elements.
    procedure :: reserve => element_list_reserve
    !> Add one.
    procedure :: append => element_list_append
  end type element_list_t

  !> Nodes, elements and groups. Held by rank 0 only.
  type :: mesh_source_t
    !> What to call it in messages: the path of a file.
    character(len=:), allocatable :: name
    integer :: n_node = 0
    !> Positions as given [length]; shape (3, n_node).
    real(wp), allocatable :: coordinates(:, :)
    !> Number of each node in the file; shape (n_node).
    integer(gp), allocatable :: node_tag(:)
    !> Points, lines, triangles and tetrahedra.
    type(element_list_t) :: elements(0:3)
    !> The first `n_group` count.
    integer :: n_group = 0
    type(mesh_group_t), allocatable :: groups(:)
    !> Sets of groups: set s is `group_of_set(first_of_set(s):first_of_set(s + 1) - 1)`.
    integer :: n_set = 0
    integer, allocatable :: first_of_set(:)
    integer, allocatable :: group_of_set(:)
  contains
    !> Place of a group, which is added when it is not there.
    procedure :: need_group => source_need_group
    !> Number of a new set of groups.
    procedure :: add_set => source_add_set
    !> The groups of a set.
    procedure :: groups_in => source_groups_in
  end type mesh_source_t

contains

  !> A source without nodes, elements and groups.
  pure subroutine mesh_source_create(name, source)
    character(len=*), intent(in) :: name
    type(mesh_source_t), intent(out) :: source

    integer :: d

    source%name = name
    allocate (source%coordinates(3, 0), source%node_tag(0))
    do d = 0, 3
      allocate (source%elements(d)%node(d + 1, 0), source%elements(d)%tag(0), &
                source%elements(d)%set(0))
    end do
    allocate (source%groups(0))
    source%n_set = EMPTY_SET
    allocate (source%first_of_set(2), source=1)
    allocate (source%group_of_set(0))

  end subroutine mesh_source_create

  pure subroutine element_list_reserve(self, n)
    class(element_list_t), intent(inout) :: self
    !> Elements that will be there in all.
    integer, intent(in) :: n

    integer(gp), allocatable :: tag(:)
    integer, allocatable :: node(:, :), set(:)

    if (n <= size(self%tag)) return
    allocate (node(size(self%node, 1), n), tag(n), set(n))
    node(:, :self%n) = self%node(:, :self%n)
    tag(:self%n) = self%tag(:self%n)
    set(:self%n) = self%set(:self%n)
    call move_alloc(node, self%node)
    call move_alloc(tag, self%tag)
    call move_alloc(set, self%set)

  end subroutine element_list_reserve

  pure subroutine element_list_append(self, nodes, tag, set)
    class(element_list_t), intent(inout) :: self
    !> Places in `node_tag`; shape (n_corner).
    integer, intent(in) :: nodes(:)
    integer(gp), intent(in) :: tag
    integer, intent(in) :: set

    if (self%n == size(self%tag)) call self%reserve(max(64, self%n + self%n / 2))
    self%n = self%n + 1
    self%node(:, self%n) = nodes
    self%tag(self%n) = tag
    self%set(self%n) = set

  end subroutine element_list_append

  !> Groups keep the order in which they are first named.
  pure subroutine source_need_group(self, dimension, tag, place)
    class(mesh_source_t), intent(inout) :: self
    integer, intent(in) :: dimension, tag
    integer, intent(out) :: place

    type(mesh_group_t), allocatable :: longer(:)

    do place = 1, self%n_group
      if (self%groups(place)%dimension == dimension .and. self%groups(place)%tag == tag) return
    end do
    if (self%n_group == size(self%groups)) then
      allocate (longer(max(16, 2 * self%n_group)))
      longer(:self%n_group) = self%groups(:self%n_group)
      call move_alloc(longer, self%groups)
    end if
    self%n_group = place
    self%groups(place)%dimension = dimension
    self%groups(place)%tag = tag

  end subroutine source_need_group

  pure subroutine source_add_set(self, groups, set)
    class(mesh_source_t), intent(inout) :: self
    !> Places of the groups.
    integer, intent(in) :: groups(:)
    !> `EMPTY_SET` when there are none.
    integer, intent(out) :: set

    integer, allocatable :: longer(:)
    integer :: n, n_item

    if (size(groups) == 0) then
      set = EMPTY_SET
      return
    end if
    if (self%n_set + 2 > size(self%first_of_set)) then
      allocate (longer(2 * size(self%first_of_set)))
      longer(:self%n_set + 1) = self%first_of_set(:self%n_set + 1)
      call move_alloc(longer, self%first_of_set)
    end if
    n_item = self%first_of_set(self%n_set + 1) - 1
    n = n_item + size(groups)
    if (n > size(self%group_of_set)) then
      allocate (longer(2 * n))
      longer(:n_item) = self%group_of_set(:n_item)
      call move_alloc(longer, self%group_of_set)
    end if
    self%group_of_set(n_item + 1:n) = groups
    self%n_set = self%n_set + 1
    self%first_of_set(self%n_set + 1) = n + 1
    set = self%n_set

  end subroutine source_add_set

  pure function source_groups_in(self, set) result(groups)
    class(mesh_source_t), intent(in) :: self
    integer, intent(in) :: set
    integer :: groups(self%first_of_set(set + 1) - self%first_of_set(set))

    groups = self%group_of_set(self%first_of_set(set):self%first_of_set(set + 1) - 1)

  end function source_groups_in

end module swage_mesh_source
