!> Unknown nodes: a table apart from the nodes of the mesh.
!>
!> An unknown node has `n_slot` slots, the components of the displacement increment and then the
!> pressure. Today each belongs to a mesh node; a second pressure at a material interface or a
!> contact multiplier will be unknown nodes of other kinds, whose idle slots are identity rows.
!> Matrix, ordering and solver see only this table.
module swage_unknowns
  use swage_kinds, only: gp
  use swage_mesh, only: mesh_t
  implicit none(type, external)
  private

  public :: unknowns_t, unknowns_create, UNKNOWN_OF_MESH

  !> Kind of an unknown node that carries displacement and pressure of a mesh node.
  integer, parameter :: UNKNOWN_OF_MESH = 1

  type :: unknowns_t
    !> Slots of each unknown node.
    integer :: n_slot = 0
    !> Unknown nodes of this rank, its own first, and of all ranks.
    integer :: n_node = 0
    integer :: n_own_node = 0
    integer(gp) :: n_node_global = 0
    !> Numbers of all ranks, contiguous by rank, from 1; shape (n_node).
    integer(gp), allocatable :: node_global(:)
    !> Last number of each lower rank: rank r owns offset(r) + 1 to offset(r + 1); (0:n_rank).
    integer(gp), allocatable :: node_offset(:)
    !> One of `UNKNOWN_*`; shape (n_node).
    integer, allocatable :: kind(:)
    !> Mesh node it belongs to; shape (n_node).
    integer, allocatable :: mesh_node(:)
    !> Unknown nodes of each cell; shape (n_vertex, n_cell).
    integer, allocatable :: cell_node(:, :)
  end type unknowns_t

contains

  !> One unknown node for each node of the mesh, in the same order.
  pure subroutine unknowns_create(mesh, unknowns)
    type(mesh_t), intent(in) :: mesh
    type(unknowns_t), intent(out) :: unknowns

    integer :: i

    unknowns%n_slot = mesh%dimension + 1
    unknowns%n_node = mesh%n_node
    unknowns%n_own_node = mesh%n_own_node
    unknowns%n_node_global = mesh%n_node_global
    allocate (unknowns%node_global, source=mesh%node_global)
    allocate (unknowns%node_offset(0:size(mesh%node_offset) - 1))
    unknowns%node_offset(:) = mesh%node_offset(:)
    allocate (unknowns%kind(mesh%n_node), source=UNKNOWN_OF_MESH)
    allocate (unknowns%mesh_node(mesh%n_node))
    unknowns%mesh_node = [(i, i=1, mesh%n_node)]
    allocate (unknowns%cell_node, source=mesh%cell_node)

  end subroutine unknowns_create

end module swage_unknowns
