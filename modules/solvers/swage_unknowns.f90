!> Unknown nodes: a table apart from the nodes of the mesh.
!>
!> An unknown node has `n_slot` slots, the components of the displacement increment and then the
!> pressure. Each node of the mesh has one. Where media meet, displacements are common and
!> pressures are not: the node's own unknown node carries the pressure of the first medium, and each
!> other medium has a further unknown node there, whose idle slots are identity rows. Contact
!> multipliers will be unknown nodes of another kind. Matrix, ordering and solver see only this
!> table.
!>
!> Local order: nodes of the mesh that this rank owns, its further ones, nodes of the mesh that
!> other ranks own, their further ones. What the rank owns has the number it has in the mesh.
module swage_unknowns
  use swage_comm, only: comm_t
  use swage_halo, only: halo_create, halo_t
  use swage_kinds, only: gp, wp
  use swage_mesh, only: mesh_t
  implicit none(type, external)
  private

  public :: unknowns_t, unknowns_create, UNKNOWN_OF_MESH, UNKNOWN_PRESSURE

  !> Kind of an unknown node that carries displacement and pressure of a mesh node.
  integer, parameter :: UNKNOWN_OF_MESH = 1
  !> Kind of one that carries a further pressure of a mesh node, and nothing else.
  integer, parameter :: UNKNOWN_PRESSURE = 2

  type :: unknowns_t
    !> Slots of each unknown node.
    integer :: n_slot = 0
    !> Unknown nodes of this rank, its own first, and of all ranks.
    integer :: n_node = 0
    integer :: n_own_node = 0
    integer(gp) :: n_node_global = 0
    !> Those of all ranks that are a further pressure.
    integer(gp) :: n_further_global = 0
    !> Numbers of all ranks, contiguous by rank, from 1; shape (n_node).
    integer(gp), allocatable :: node_global(:)
    !> Last number of each lower rank: rank r owns offset(r) + 1 to offset(r + 1); (0:n_rank).
    integer(gp), allocatable :: node_offset(:)
    !> One of `UNKNOWN_*`; shape (n_node).
    integer, allocatable :: kind(:)
    !> Mesh node it belongs to; shape (n_node).
    integer, allocatable :: mesh_node(:)
    !> Medium of a further pressure, 0 for other kinds; shape (n_node).
    integer, allocatable :: medium(:)
    !> Unknown node that carries the displacement of a mesh node; shape (n_node of the mesh).
    integer, allocatable :: of_node(:)
    !> Unknown nodes of the displacements of each cell; shape (n_vertex, n_cell).
    integer, allocatable :: cell_node(:, :)
    !> Those of its pressures, when there are further ones on any rank; not allocated else: they are
    !> `cell_node`. Shape (n_vertex, n_cell).
    integer, allocatable :: cell_pressure(:, :)
    !> Exchange of unknown nodes between ranks.
    type(halo_t) :: halo
  end type unknowns_t

  !> Further pressures of this rank, in the order of their media, then of their nodes.
  type :: further_t
    integer :: n = 0
    !> Local mesh node, medium, and place among the further ones of the owner; `(:n)` count.
    integer, allocatable :: node(:), medium(:), place(:)
  end type further_t

contains

  !> Collective. One unknown node for each node of the mesh, in the same order, and one for each
  !> further medium that a node belongs to.
  subroutine unknowns_create(mesh, comm, medium_of_cell, n_medium, unknowns)
    type(mesh_t), intent(in) :: mesh
    type(comm_t), intent(in) :: comm
    !> From 1 to n_medium; shape (n_cell).
    integer, intent(in) :: medium_of_cell(:)
    integer, intent(in) :: n_medium
    type(unknowns_t), intent(out) :: unknowns

    integer, allocatable :: first_medium(:)
    type(further_t) :: further
    integer :: i, n_further, n_own

    n_own = mesh%n_own_node
    call find_further(mesh, medium_of_cell, n_medium, first_medium, further)
    n_further = count(further%node(:further%n) <= n_own)
    unknowns%n_further_global = int(n_further, gp)
    call comm%sum(unknowns%n_further_global)

    unknowns%n_slot = mesh%dimension + 1
    unknowns%n_node = mesh%n_node + further%n
    unknowns%n_own_node = n_own + n_further
    unknowns%n_node_global = mesh%n_node_global + unknowns%n_further_global
    allocate (unknowns%of_node(mesh%n_node))
    unknowns%of_node = [(merge(i, i + n_further, i <= n_own), i=1, mesh%n_node)]
    allocate (unknowns%kind(unknowns%n_node), source=UNKNOWN_OF_MESH)
    allocate (unknowns%medium(unknowns%n_node), unknowns%mesh_node(unknowns%n_node), source=0)
    do i = 1, mesh%n_node
      unknowns%mesh_node(unknowns%of_node(i)) = i
    end do
    allocate (unknowns%cell_node, source=mesh%cell_node)
    call number_nodes(mesh, comm, n_further, further, unknowns)
    if (unknowns%n_further_global == 0_gp) then
      unknowns%halo = mesh%halo
      return
    end if

    do i = 1, size(mesh%cell_node, 2)
      unknowns%cell_node(:, i) = unknowns%of_node(mesh%cell_node(:, i))
    end do
    call assign_pressures(mesh, medium_of_cell, first_medium, unknowns)
    call halo_create(comm, unknowns%n_own_node, unknowns%node_global, unknowns%node_offset, &
                     unknowns%halo)

  end subroutine unknowns_create

  !> Collective. The media that meet at each node, over all ranks.
  subroutine find_further(mesh, medium_of_cell, n_medium, first_medium, further)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: medium_of_cell(:)
    integer, intent(in) :: n_medium
    !> The one whose pressure is that of the node itself; shape (n_node).
    integer, allocatable, intent(out) :: first_medium(:)
    !> All that this rank owns, and those of other ranks that its cells need.
    type(further_t), intent(out) :: further

    real(wp), allocatable :: place(:, :), touched(:, :)
    logical, allocatable :: here(:)
    integer :: cell, medium, n_own_further, node, start

    allocate (first_medium(mesh%n_node), source=merge(1, 0, n_medium == 1))
    allocate (further%node(0), further%medium(0), further%place(0))
    if (n_medium <= 1) return
    allocate (touched(1, mesh%n_node), place(1, mesh%n_node), here(mesh%n_node))
    n_own_further = 0
    do medium = 1, n_medium
      touched = 0.0_wp
      do cell = 1, mesh%n_cell
        if (medium_of_cell(cell) == medium) touched(1, mesh%cell_node(:, cell)) = 1.0_wp
      end do
      here = touched(1, :) > 0.0_wp
      call mesh%halo%accumulate(touched)

      place = 0.0_wp
      start = further%n
      do node = 1, mesh%n_node
        if (.not. touched(1, node) > 0.0_wp) cycle
        if (first_medium(node) == 0) then
          first_medium(node) = medium
        else if (node <= mesh%n_own_node) then
          n_own_further = n_own_further + 1
          place(1, node) = n_own_further
          call append(further, node, medium)
        else if (here(node)) then
          call append(further, node, medium)
        end if
      end do
      call mesh%halo%update(place)
      further%place(start + 1:further%n) = nint(place(1, further%node(start + 1:further%n)))
    end do

  end subroutine find_further

  pure subroutine append(further, node, medium)
    type(further_t), intent(inout) :: further
    integer, intent(in) :: node
    integer, intent(in) :: medium

    further%n = further%n + 1
    if (further%n > size(further%node)) then
      call lengthen(further%node)
      call lengthen(further%medium)
      call lengthen(further%place)
    end if
    further%node(further%n) = node
    further%medium(further%n) = medium

  end subroutine append

  !> Room for twice as many.
  pure subroutine lengthen(list)
    integer, allocatable, intent(inout) :: list(:)

    integer, allocatable :: longer(:)

    allocate (longer(2 * size(list) + 16), source=0)
    longer(:size(list)) = list
    call move_alloc(longer, list)

  end subroutine lengthen

  !> Collective. Numbers of all ranks: the further nodes of a rank follow its nodes of the mesh.
  subroutine number_nodes(mesh, comm, n_further, further, unknowns)
    type(mesh_t), intent(in) :: mesh
    type(comm_t), intent(in) :: comm
    !> Further nodes that this rank owns.
    integer, intent(in) :: n_further
    type(further_t), intent(in) :: further
    type(unknowns_t), intent(inout) :: unknowns

    integer, allocatable :: of_rank(:)
    integer :: i, last_ghost, last_own, rank, u

    call comm%gather_all(n_further, of_rank)
    allocate (unknowns%node_offset(0:comm%size))
    unknowns%node_offset(0) = 0_gp
    do rank = 0, comm%size - 1
      unknowns%node_offset(rank + 1) = unknowns%node_offset(rank) + mesh%node_offset(rank + 1) &
        - mesh%node_offset(rank) + int(of_rank(rank), gp)
    end do

    allocate (unknowns%node_global(unknowns%n_node))
    do i = 1, mesh%n_node
      rank = owner(mesh%node_offset, mesh%node_global(i))
      unknowns%node_global(unknowns%of_node(i)) = mesh%node_global(i) &
        + unknowns%node_offset(rank) - mesh%node_offset(rank)
    end do
    last_own = mesh%n_own_node
    last_ghost = mesh%n_node + n_further
    do i = 1, further%n
      if (further%node(i) <= mesh%n_own_node) then
        last_own = last_own + 1
        u = last_own
      else
        last_ghost = last_ghost + 1
        u = last_ghost
      end if
      rank = owner(mesh%node_offset, mesh%node_global(further%node(i)))
      unknowns%kind(u) = UNKNOWN_PRESSURE
      unknowns%mesh_node(u) = further%node(i)
      unknowns%medium(u) = further%medium(i)
      unknowns%node_global(u) = unknowns%node_offset(rank) + mesh%node_offset(rank + 1) &
        - mesh%node_offset(rank) + int(further%place(i), gp)
    end do

  end subroutine number_nodes

  !> Rank that owns a number.
  pure function owner(offset, number) result(rank)
    !> Shape (0:n_rank).
    integer(gp), intent(in) :: offset(0:)
    integer(gp), intent(in) :: number
    integer :: rank

    integer :: high, middle

    rank = 0
    high = size(offset) - 2
    do while (rank < high)
      middle = (rank + high + 1) / 2
      if (offset(middle) < number) then
        rank = middle
      else
        high = middle - 1
      end if
    end do

  end function owner

  !> Which unknown node carries the pressure of each vertex of a cell.
  pure subroutine assign_pressures(mesh, medium_of_cell, first_medium, unknowns)
    type(mesh_t), intent(in) :: mesh
    integer, intent(in) :: medium_of_cell(:)
    integer, intent(in) :: first_medium(:)
    type(unknowns_t), intent(inout) :: unknowns

    integer, allocatable :: before(:), last(:)
    integer :: a, cell, u

    ! Chain the further nodes of each node of the mesh
    allocate (last(mesh%n_node), before(unknowns%n_node), source=0)
    do u = 1, unknowns%n_node
      if (unknowns%kind(u) /= UNKNOWN_PRESSURE) cycle
      before(u) = last(unknowns%mesh_node(u))
      last(unknowns%mesh_node(u)) = u
    end do
    allocate (unknowns%cell_pressure, source=unknowns%cell_node)
    do cell = 1, mesh%n_cell
      do a = 1, size(mesh%cell_node, 1)
        associate (node => mesh%cell_node(a, cell))
          if (medium_of_cell(cell) == first_medium(node)) cycle
          u = last(node)
          do while (u > 0)
            if (unknowns%medium(u) == medium_of_cell(cell)) unknowns%cell_pressure(a, cell) = u
            u = before(u)
          end do
        end associate
      end do
    end do

  end subroutine assign_pressures

end module swage_unknowns
