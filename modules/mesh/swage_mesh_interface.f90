!> Interfaces between bodies of one mesh: nodes that two bodies share are split for contact, and
!> nodes of two bodies at the same place become one where they are bonded.
module swage_mesh_interface
  use swage_bounding_tree, only: bounding_tree_create, bounding_tree_t
  use swage_kinds, only: gp, wp
  use swage_mesh, only: GROUP_NAME_LENGTH, search_groups
  use swage_mesh_source, only: mesh_source_t
  use swage_relation, only: pair_list_t, relation_from_pairs, relation_t
  use swage_simplex_table, only: simplex_table_create, simplex_table_t
  use swage_status, only: EXIT_INPUT, status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: mesh_interface_t, apply_interfaces

  !> Nodes coincide when their distance is below this share of the shortest edge around them.
  real(wp), parameter :: COINCIDENT = 1.0e-3_wp

  !> What is asked for two bodies.
  type :: mesh_interface_t
    !> Physical groups of their cells, by name or number.
    character(len=GROUP_NAME_LENGTH) :: group(2) = ''
    !> True: no node in common; false: one node where both have one.
    logical :: separates = .false.
    !> Start of complaints.
    character(len=256) :: title = ''
  end type mesh_interface_t

  !> Which body each cell belongs to; cells of no body that is asked for are of the last one.
  type :: membership_t
    integer :: n_body = 0
    !> Shape (elements of the dimension of the mesh).
    integer, allocatable :: of_cell(:)
    !> Bodies of each node.
    type(relation_t) :: of_node
  end type membership_t

contains

  !> Merge what is bonded, then split what is not.
  !>
  !> A node of three bodies is split only as far as no body holds the others together.
  !> O(n log n) elements, for each pair of bodies.
  subroutine apply_interfaces(source, dimension, interfaces, n_merged, n_split, status)
    type(mesh_source_t), intent(inout) :: source
    !> 2: triangles; 3: tetrahedra.
    integer, intent(in) :: dimension
    !> Those with a group that the mesh does not have are left out: bodies are checked elsewhere.
    type(mesh_interface_t), intent(in) :: interfaces(:)
    !> Nodes that are no more, and nodes that have been added.
    integer, intent(out) :: n_merged
    integer, intent(out) :: n_split
    !> `STATUS_ERROR` with `EXIT_INPUT` when two bodies have no node in common or at the same place.
    type(status_t), intent(inout) :: status

    type(membership_t) :: members
    integer, allocatable :: group_of_body(:), twin(:)
    integer :: body(2, size(interfaces)), i, n_shared
    logical, allocatable :: is_apart(:, :)

    n_merged = 0
    n_split = 0
    if (size(interfaces) == 0) return
    ! A mesh without cells is refused elsewhere
    if (source%elements(dimension)%n == 0) return
    call list_bodies(source, dimension, interfaces, group_of_body, body)
    allocate (is_apart(size(group_of_body) + 1, size(group_of_body) + 1), source=.false.)
    do i = 1, size(interfaces)
      if (any(body(:, i) == 0)) cycle
      call find_members(source, dimension, group_of_body, members)
      call match_nodes(source, dimension, members, body(:, i), twin, n_shared)
      if (n_shared + count(twin > 0) == 0) then
        call status%raise(STATUS_ERROR, 'apply_interfaces', trim(interfaces(i)%title)// &
                          ': the bodies share no node of the mesh, nor do nodes of them lie at '// &
                          'the same place: let them touch, with the same nodes on both sides; '// &
                          'where meshes do not match, a &contact with tied = .true. glues them', &
                          EXIT_INPUT)
        return
      end if
      if (interfaces(i)%separates) then
        is_apart(body(1, i), body(2, i)) = .true.
        is_apart(body(2, i), body(1, i)) = .true.
      else
        n_merged = n_merged + count(twin > 0)
        call merge_nodes(source, twin)
      end if
    end do
    if (.not. any(is_apart)) return
    call find_members(source, dimension, group_of_body, members)
    call split_nodes(source, dimension, members, is_apart, n_split)

  end subroutine apply_interfaces

  !> The groups that are named, each once, and which of them every interface means.
  subroutine list_bodies(source, dimension, interfaces, group_of_body, body)
    type(mesh_source_t), intent(in) :: source
    integer, intent(in) :: dimension
    type(mesh_interface_t), intent(in) :: interfaces(:)
    !> Places in the groups of the source.
    integer, allocatable, intent(out) :: group_of_body(:)
    !> Places in that list, 0 for a group that is not there; shape (2, n_interface).
    integer, intent(out) :: body(:, :)

    integer :: found(2 * size(interfaces)), i, k, n, n_found, place

    n = 0
    body = 0
    do i = 1, size(interfaces)
      do k = 1, 2
        call search_groups(source%groups(:source%n_group), trim(interfaces(i)%group(k)), place, &
                           n_found, dimension)
        if (n_found /= 1) cycle
        body(k, i) = findloc(found(:n), place, dim=1)
        if (body(k, i) > 0) cycle
        n = n + 1
        found(n) = place
        body(k, i) = n
      end do
    end do
    allocate (group_of_body(n))
    group_of_body(:) = found(:n)

  end subroutine list_bodies

  !> The body of each cell, also where a cell is given once for each of several groups.
  subroutine find_members(source, dimension, group_of_body, members)
    type(mesh_source_t), intent(in) :: source
    integer, intent(in) :: dimension
    integer, intent(in) :: group_of_body(:)
    type(membership_t), intent(out) :: members

    type(pair_list_t) :: pairs
    type(simplex_table_t) :: table
    integer, allocatable :: body_of_simplex(:), body_of_set(:), simplex(:)
    integer :: a, i, j

    members%n_body = size(group_of_body) + 1
    allocate (body_of_set(source%n_set), source=0)
    do i = 1, source%n_set
      do j = source%first_of_set(i), source%first_of_set(i + 1) - 1
        a = findloc(group_of_body, source%group_of_set(j), dim=1)
        if (a > 0) body_of_set(i) = a
      end do
    end do
    associate (cells => source%elements(dimension))
      allocate (simplex(cells%n), members%of_cell(cells%n))
      allocate (body_of_simplex(cells%n), source=0)
      call simplex_table_create(dimension + 1, cells%n, table)
      do i = 1, cells%n
        call table%insert(cells%node(:, i), simplex(i))
        associate (body => body_of_simplex(simplex(i)))
          if (body == 0) body = body_of_set(cells%set(i))
        end associate
      end do
      where (body_of_simplex == 0) body_of_simplex = members%n_body
      do i = 1, cells%n
        members%of_cell(i) = body_of_simplex(simplex(i))
        do a = 1, dimension + 1
          call pairs%append(cells%node(a, i), members%of_cell(i))
        end do
      end do
      call relation_from_pairs(source%n_node, members%n_body, pairs%left(:pairs%n), &
                               pairs%right(:pairs%n), members%of_node)
    end associate

  end subroutine find_members

  !> Nodes that two bodies share, and nodes of the second at the place of one of the first.
  subroutine match_nodes(source, dimension, members, body, twin, n_shared)
    type(mesh_source_t), intent(in) :: source
    integer, intent(in) :: dimension
    type(membership_t), intent(in) :: members
    integer, intent(in) :: body(2)
    !> The node of the first body at the same place, 0 for none; shape (n_node).
    integer, allocatable, intent(out) :: twin(:)
    integer, intent(out) :: n_shared

    type(bounding_tree_t) :: tree
    integer, allocatable :: first(:), near(:), second(:)
    real(wp), allocatable :: edge(:), points(:, :)
    real(wp) :: distance, least
    integer :: i, k

    call list_nodes(members, body, first, second, n_shared)
    allocate (twin(source%n_node), source=0)
    call shortest_edges(source, dimension, edge)
    allocate (points(3, size(first)))
    points(:, :) = source%coordinates(:, first)
    call bounding_tree_create(points, points, tree)
    do i = 1, size(second)
      associate (x => source%coordinates(:, second(i)), reach => COINCIDENT * edge(second(i)))
        call tree%candidates(x - reach, x + reach, near)
        least = reach
        do k = 1, size(near)
          distance = norm2(points(:, near(k)) - x)
          if (distance > least) cycle
          least = distance
          twin(second(i)) = first(near(k))
        end do
      end associate
    end do

  end subroutine match_nodes

  !> Nodes of one of two bodies and not of the other.
  pure subroutine list_nodes(members, body, first, second, n_shared)
    type(membership_t), intent(in) :: members
    integer, intent(in) :: body(2)
    integer, allocatable, intent(out) :: first(:), second(:)
    integer, intent(out) :: n_shared

    logical :: is_in(2)
    integer, allocatable :: list(:)
    integer :: n(2), node

    ! The body that each node is to be listed for, 0 for none
    allocate (list(size(members%of_node%first) - 1), source=0)
    n = 0
    n_shared = 0
    do node = 1, size(list)
      associate (bodies => members%of_node%item(members%of_node%first(node): &
                                                members%of_node%first(node + 1) - 1))
        is_in = [any(bodies == body(1)), any(bodies == body(2))]
      end associate
      if (all(is_in)) n_shared = n_shared + 1
      if (count(is_in) /= 1) cycle
      list(node) = merge(1, 2, is_in(1))
      n(list(node)) = n(list(node)) + 1
    end do
    allocate (first(n(1)), second(n(2)))
    n = 0
    do node = 1, size(list)
      if (list(node) == 0) cycle
      n(list(node)) = n(list(node)) + 1
      if (list(node) == 1) first(n(1)) = node
      if (list(node) == 2) second(n(2)) = node
    end do

  end subroutine list_nodes

  !> Of the cells around each node [length]; shape (n_node).
  pure subroutine shortest_edges(source, dimension, edge)
    type(mesh_source_t), intent(in) :: source
    integer, intent(in) :: dimension
    real(wp), allocatable, intent(out) :: edge(:)

    real(wp) :: length
    integer :: a, b, i

    allocate (edge(source%n_node), source=huge(1.0_wp))
    associate (cells => source%elements(dimension), x => source%coordinates)
      do i = 1, cells%n
        do a = 2, dimension + 1
          do b = 1, a - 1
            associate (p => cells%node(a, i), q => cells%node(b, i))
              length = norm2(x(:, p) - x(:, q))
              edge(p) = min(edge(p), length)
              edge(q) = min(edge(q), length)
            end associate
          end do
        end do
      end do
    end associate

  end subroutine shortest_edges

  !> Put the twin of each node in its place, in all elements.
  pure subroutine merge_nodes(source, twin)
    type(mesh_source_t), intent(inout) :: source
    integer, intent(in) :: twin(:)

    integer :: a, d, i

    do d = 0, 3
      associate (list => source%elements(d))
        do i = 1, list%n
          do a = 1, d + 1
            if (twin(list%node(a, i)) > 0) list%node(a, i) = twin(list%node(a, i))
          end do
        end do
      end associate
    end do

  end subroutine merge_nodes

  !> Give bodies that are to be apart nodes of their own.
  subroutine split_nodes(source, dimension, members, is_apart, n_split)
    type(mesh_source_t), intent(inout) :: source
    integer, intent(in) :: dimension
    type(membership_t), intent(in) :: members
    !> Shape (n_body, n_body).
    logical, intent(in) :: is_apart(:, :)
    integer, intent(out) :: n_split

    integer, allocatable :: node_of(:), original(:)
    integer :: a, i

    call number_copies(source%n_node, members, is_apart, node_of, original)
    n_split = size(original)
    call append_nodes(source, original)
    associate (cells => source%elements(dimension))
      do i = 1, cells%n
        do a = 1, dimension + 1
          cells%node(a, i) = own_node(members, node_of, cells%node(a, i), members%of_cell(i))
        end do
      end do
    end associate
    do i = 0, dimension - 1
      call split_elements(source, i, members, node_of)
    end do

  end subroutine split_nodes

  !> At each node the bodies fall into parts that nothing holds together; the part of the first body
  !> keeps the node.
  pure subroutine number_copies(n_node, members, is_apart, node_of, original)
    integer, intent(in) :: n_node
    type(membership_t), intent(in) :: members
    logical, intent(in) :: is_apart(:, :)
    !> The node of each item of `members%of_node`.
    integer, allocatable, intent(out) :: node_of(:)
    !> The node that each new one is a copy of.
    integer, allocatable, intent(out) :: original(:)

    integer :: part(size(is_apart, 1))
    integer :: high, i, j, low, n, n_new, node, pass

    allocate (node_of(size(members%of_node%item)))
    do pass = 1, 2
      n_new = 0
      do node = 1, n_node
        associate (start => members%of_node%first(node) - 1)
          n = members%of_node%first(node + 1) - 1 - start
          do i = 1, n
            part(i) = i
            do j = 1, i - 1
              if (is_apart(members%of_node%item(start + i), members%of_node%item(start + j))) cycle
              ! Two parts become one, with the lower number
              low = min(part(i), part(j))
              high = max(part(i), part(j))
              where (part(:i) == high) part(:i) = low
            end do
          end do
          do i = 1, n
            if (part(i) == 1) then
              node_of(start + i) = node
            else if (part(i) == i) then
              n_new = n_new + 1
              node_of(start + i) = n_node + n_new
              if (pass == 2) original(n_new) = node
            else
              node_of(start + i) = node_of(start + part(i))
            end if
          end do
        end associate
      end do
      if (pass == 1) allocate (original(n_new))
    end do

  end subroutine number_copies

  !> Copies of nodes get numbers of their own behind those in the file.
  pure subroutine append_nodes(source, original)
    type(mesh_source_t), intent(inout) :: source
    integer, intent(in) :: original(:)

    real(wp), allocatable :: coordinates(:, :)
    integer(gp), allocatable :: node_tag(:)
    integer(gp) :: last
    integer :: i, n

    n = source%n_node
    last = maxval(source%node_tag(:n))
    allocate (coordinates(3, n + size(original)), node_tag(n + size(original)))
    coordinates(:, :n) = source%coordinates(:, :n)
    node_tag(:n) = source%node_tag(:n)
    do i = 1, size(original)
      coordinates(:, n + i) = source%coordinates(:, original(i))
      node_tag(n + i) = last + int(i, gp)
    end do
    call move_alloc(coordinates, source%coordinates)
    call move_alloc(node_tag, source%node_tag)
    source%n_node = n + size(original)

  end subroutine append_nodes

  !> The node that a body has in the place of one.
  pure function own_node(members, node_of, node, body) result(own)
    type(membership_t), intent(in) :: members
    integer, intent(in) :: node_of(:)
    integer, intent(in) :: node
    integer, intent(in) :: body
    !> 0 when the body does not have the node.
    integer :: own

    integer :: i

    own = 0
    do i = members%of_node%first(node), members%of_node%first(node + 1) - 1
      if (members%of_node%item(i) == body) own = node_of(i)
    end do

  end function own_node

  !> Points, lines and facets go with each body that has all their nodes: those of an interface are
  !> there twice.
  subroutine split_elements(source, dimension, members, node_of)
    type(mesh_source_t), intent(inout) :: source
    !> Of the elements.
    integer, intent(in) :: dimension
    type(membership_t), intent(in) :: members
    integer, intent(in) :: node_of(:)

    integer :: a, body, i, k, n_found, n_list
    integer :: found(dimension + 1, members%n_body), nodes(dimension + 1), own(dimension + 1)

    associate (list => source%elements(dimension))
      n_list = list%n
      do i = 1, n_list
        nodes = list%node(:, i)
        n_found = 0
        do body = 1, members%n_body
          do a = 1, dimension + 1
            own(a) = own_node(members, node_of, nodes(a), body)
          end do
          if (any(own == 0)) cycle
          if (any([(all(found(:, k) == own), k=1, n_found)])) cycle
          n_found = n_found + 1
          found(:, n_found) = own
        end do
        if (n_found > 0) list%node(:, i) = found(:, 1)
        do k = 2, n_found
          call list%append(found(:, k), list%tag(i), list%set(i))
        end do
      end do
    end associate

  end subroutine split_elements

end module swage_mesh_interface
