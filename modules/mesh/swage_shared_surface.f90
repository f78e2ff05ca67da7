!> Parts of the surface of a mesh that every rank knows: those where bodies may touch each other.
!>
!> A body may touch one of another rank, and what a rank computes there needs positions of both.
!> Surfaces grow with the number of nodes to the power of two thirds, so that each rank can hold
!> them whole. Nodes and facets are listed in the order of the mesh file's numbers: whatever the
!> number of ranks, the list is the same.
module swage_shared_surface
  use swage_comm, only: comm_t
  use swage_kinds, only: gp, wp
  use swage_mesh, only: mesh_t
  use swage_sort, only: find_sorted, sorting_order
  implicit none(type, external)
  private

  public :: shared_surface_t, shared_surface_create

  type :: shared_surface_t
    type(comm_t) :: comm
    !> 2 or 3.
    integer :: dimension = 0
    integer :: n_node = 0
    integer :: n_facet = 0
    !> Number of each node in the mesh file, ascending, and of all ranks; shape (n_node).
    integer(gp), allocatable :: node_tag(:)
    integer(gp), allocatable :: node_global(:)
    !> Node of the mesh on this rank, 0 where it has none; shape (n_node).
    integer, allocatable :: mesh_node(:)
    !> Whether this rank owns the node; shape (n_node).
    logical, allocatable :: is_own(:)
    !> Places in the list of nodes, outward as in [[mesh_t]]; shape (dimension, n_facet).
    integer, allocatable :: facet_node(:, :)
    !> What the caller has called each facet; shape (n_facet).
    integer, allocatable :: facet_label(:)
    !> Facet of the mesh on this rank, 0 where it has none; shape (n_facet).
    integer, allocatable :: mesh_facet(:)
  contains
    !> Collective. Values of all nodes, from those of their owners.
    procedure :: gather => shared_surface_gather
    !> Places of the nodes with some numbers of the mesh file.
    procedure :: places_of => shared_surface_places_of
  end type shared_surface_t

contains

  !> Collective. Collect facets of all ranks.
  subroutine shared_surface_create(comm, mesh, facets, labels, surface)
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(in) :: mesh
    !> Boundary facets of this rank, each once.
    integer, intent(in) :: facets(:)
    !> A positive number of each, as that of a body.
    integer, intent(in) :: labels(:)
    type(shared_surface_t), intent(out) :: surface

    integer(gp), allocatable :: corner(:, :), found(:, :), keys(:)
    integer, allocatable :: order(:)
    integer(gp) :: n_before, n_total
    integer :: a, i, n, place

    n = mesh%dimension
    surface%comm = comm
    surface%dimension = n
    call comm%locate(size(facets, kind=gp), n_before, n_total)
    surface%n_facet = int(n_total)

    ! Tags of the corners, the label, and the facet of the mesh, which only this rank needs
    allocate (found(n + 1, surface%n_facet), source=0_gp)
    do i = 1, size(facets)
      place = int(n_before) + i
      found(:n, place) = mesh%node_tag(mesh%facet_node(:, facets(i)))
      found(n + 1, place) = labels(i)
    end do
    call sum_table(comm, found)
    allocate (order, source=facet_order(found(:n, :)))

    allocate (corner(n, surface%n_facet), surface%facet_label(surface%n_facet))
    corner = found(:n, order)
    surface%facet_label = int(found(n + 1, order))
    allocate (surface%mesh_facet(surface%n_facet), source=0)
    do i = 1, surface%n_facet
      place = order(i) - int(n_before)
      if (place < 1 .or. place > size(facets)) cycle
      surface%mesh_facet(i) = facets(place)
    end do

    allocate (keys, source=reshape(corner, [size(corner)]))
    call list_each_once(keys, surface%node_tag)
    surface%n_node = size(surface%node_tag)
    allocate (surface%facet_node(n, surface%n_facet))
    do i = 1, surface%n_facet
      do a = 1, n
        surface%facet_node(a, i) = find_sorted(surface%node_tag, corner(a, i))
      end do
    end do
    call find_mesh_nodes(mesh, surface)

  end subroutine shared_surface_create

  !> Collective. Sum of a table over the ranks.
  subroutine sum_table(comm, table)
    type(comm_t), intent(in) :: comm
    integer(gp), intent(inout) :: table(:, :)

    integer(gp), allocatable :: row(:)
    integer :: i

    allocate (row(size(table, 2)))
    do i = 1, size(table, 1)
      row = table(i, :)
      call comm%sum(row)
      table(i, :) = row
    end do

  end subroutine sum_table

  !> Order of facets by their smallest, middle and largest tag.
  pure function facet_order(corner) result(order)
    !> Shape (n_dim, n_facet).
    integer(gp), intent(in) :: corner(:, :)
    integer, allocatable :: order(:)

    integer(gp), allocatable :: ranked(:, :)
    integer :: i, k

    allocate (ranked, mold=corner)
    do i = 1, size(corner, 2)
      ranked(:, i) = corner(sorting_order(corner(:, i)), i)
    end do
    ! Sorting keeps the order of equals: the first key comes last
    allocate (order(size(corner, 2)))
    order = [(i, i=1, size(order))]
    do k = size(corner, 1), 1, -1
      order = order(sorting_order(ranked(k, order)))
    end do

  end function facet_order

  !> Values in ascending order without repetition.
  pure subroutine list_each_once(keys, values)
    integer(gp), intent(in) :: keys(:)
    integer(gp), allocatable, intent(out) :: values(:)

    integer(gp), allocatable :: sorted(:)
    logical, allocatable :: is_new(:)

    allocate (sorted(size(keys)), is_new(size(keys)))
    sorted = keys(sorting_order(keys))
    if (size(keys) > 0) is_new(1) = .true.
    is_new(2:) = sorted(2:) /= sorted(:size(keys) - 1)
    allocate (values, source=pack(sorted, is_new))

  end subroutine list_each_once

  !> Collective. Which nodes of the surface are here, and their global numbers.
  subroutine find_mesh_nodes(mesh, surface)
    type(mesh_t), intent(in) :: mesh
    type(shared_surface_t), intent(inout) :: surface

    integer :: i, place

    allocate (surface%mesh_node(surface%n_node), source=0)
    allocate (surface%node_global(surface%n_node), source=0_gp)
    allocate (surface%is_own(surface%n_node), source=.false.)
    do i = 1, mesh%n_node
      place = find_sorted(surface%node_tag, mesh%node_tag(i))
      if (place == 0) cycle
      surface%mesh_node(place) = i
      surface%is_own(place) = i <= mesh%n_own_node
      if (surface%is_own(place)) surface%node_global(place) = mesh%node_global(i)
    end do
    call surface%comm%sum(surface%node_global)

  end subroutine find_mesh_nodes

  subroutine shared_surface_gather(self, values, gathered)
    class(shared_surface_t), intent(in) :: self
    !> Of the nodes of the mesh, right on owned ones; shape (n_component, n_node of the mesh).
    real(wp), intent(in) :: values(:, :)
    !> Shape (n_component or more, n_node); rows beyond n_component are zero.
    real(wp), contiguous, intent(out) :: gathered(:, :)

    real(wp), allocatable :: packed(:)
    integer :: i, n

    n = size(values, 1)
    allocate (packed(n * self%n_node), source=0.0_wp)
    do i = 1, self%n_node
      if (self%is_own(i)) packed(n * (i - 1) + 1:n * i) = values(:, self%mesh_node(i))
    end do
    ! One rank adds a value, all others zeros: exact
    if (self%comm%size > 1) call self%comm%sum(packed)
    gathered = 0.0_wp
    gathered(:n, :) = reshape(packed, [n, self%n_node])

  end subroutine shared_surface_gather

  !> Places of the nodes with some tags; 0 for those that are not on the surface.
  pure function shared_surface_places_of(self, tags) result(places)
    class(shared_surface_t), intent(in) :: self
    integer(gp), intent(in) :: tags(:)
    integer, allocatable :: places(:)

    integer :: i

    allocate (places(size(tags)))
    do i = 1, size(tags)
      places(i) = find_sorted(self%node_tag, tags(i))
    end do

  end function shared_surface_places_of

end module swage_shared_surface
