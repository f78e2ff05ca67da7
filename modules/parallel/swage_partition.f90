!> Partition of cells and ordering of graphs: the only module that calls METIS.
!>
!> METIS gets no options (null pointer): its defaults then hold, among them a fixed seed and
!> numbering from 0, and nothing depends on the places of the options, which change between
!> versions 5.1 and 5.2.
module swage_partition
  use, intrinsic :: iso_c_binding, only: c_int, c_int32_t, c_null_ptr, c_ptr
  use swage_status, only: status_t, EXIT_MESH, EXIT_SOLVER, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: partition_cells, order_nodes

  !> What METIS returns for success.
  integer(c_int), parameter :: METIS_OK = 1_c_int
  !> What METIS returns when memory ran out.
  integer(c_int), parameter :: METIS_ERROR_MEMORY = -3_c_int

  interface

    !> METIS manual 5.1, section 5.5: partition of a mesh by the graph of its cells.
    function metis_part_mesh_dual(n_cell, n_node, first, node, weight, volume, n_common, n_part, &
                                  shares, options, cut, part_of_cell, part_of_node) &
      result(code) bind(c, name='METIS_PartMeshDual')
      import :: c_int, c_int32_t, c_ptr
      implicit none(type, external)
      integer(c_int32_t), intent(in) :: n_cell, n_node
      integer(c_int32_t), intent(in) :: first(n_cell + 1)
      integer(c_int32_t), intent(in) :: node(first(n_cell + 1))
      type(c_ptr), value :: weight, volume
      integer(c_int32_t), intent(in) :: n_common, n_part
      type(c_ptr), value :: shares, options
      integer(c_int32_t), intent(out) :: cut
      integer(c_int32_t), intent(out) :: part_of_cell(n_cell), part_of_node(n_node)
      integer(c_int) :: code
    end function metis_part_mesh_dual

    !> METIS manual 5.1, section 5.6: nested dissection.
    function metis_node_nd(n_vertex, first, neighbour, weight, options, old_of_new, new_of_old) &
      result(code) bind(c, name='METIS_NodeND')
      import :: c_int, c_int32_t, c_ptr
      implicit none(type, external)
      integer(c_int32_t), intent(in) :: n_vertex
      integer(c_int32_t), intent(in) :: first(n_vertex + 1)
      integer(c_int32_t), intent(in) :: neighbour(first(n_vertex + 1))
      type(c_ptr), value :: weight, options
      integer(c_int32_t), intent(out) :: old_of_new(n_vertex), new_of_old(n_vertex)
      integer(c_int) :: code
    end function metis_node_nd

  end interface

contains

  !> Divide the cells of a mesh into parts of about equal size with few facets between them.
  !>
  !> Deterministic; no part is empty. Not collective: call it on the rank that has the mesh.
  !> Source: Karypis and Kumar (1998), multilevel k-way partition of the dual graph.
  subroutine partition_cells(n_node, cell_node, n_part, part, status)
    integer, intent(in) :: n_node
    !> Nodes of the cells, 1-based; shape (dimension + 1, n_cell).
    integer, contiguous, intent(in) :: cell_node(:, :)
    integer, intent(in) :: n_part
    !> Part of each cell, 0 to n_part - 1; shape (n_cell).
    integer, contiguous, intent(out) :: part(:)
    !> `STATUS_ERROR` when there are fewer cells than parts or METIS fails.
    type(status_t), intent(inout) :: status

    integer(c_int32_t), allocatable :: first(:), node(:), part_of_cell(:), part_of_node(:)
    integer(c_int) :: code
    integer(c_int32_t) :: cut
    integer :: i, n_cell, n_corner

    part = 0
    n_corner = size(cell_node, 1)
    n_cell = size(cell_node, 2)
    if (n_cell < n_part) then
      call status%raise(STATUS_ERROR, 'partition_cells', 'the mesh has ' // text(n_cell) // &
                        trim(merge(' cell ', ' cells', n_cell == 1)) // ', fewer than the ' // &
                        text(n_part) // ' processes: start fewer processes', EXIT_MESH)
      return
    end if
    if (n_part == 1) return
    if (n_cell > huge(1_c_int32_t) / n_corner) then
      call status%raise(STATUS_ERROR, 'partition_cells', 'the mesh has ' // text(n_cell) // &
                        ' cells, more than a METIS with 32-bit integers can take', EXIT_MESH)
      return
    end if

    allocate (first(n_cell + 1), node(n_corner * n_cell), part_of_cell(n_cell), &
              part_of_node(n_node))
    do i = 1, n_cell
      first(i) = int((i - 1) * n_corner, c_int32_t)
      node((i - 1) * n_corner + 1:i * n_corner) = int(cell_node(:, i) - 1, c_int32_t)
    end do
    first(n_cell + 1) = int(n_cell * n_corner, c_int32_t)

    code = metis_part_mesh_dual(int(n_cell, c_int32_t), int(n_node, c_int32_t), first, node, &
                                c_null_ptr, c_null_ptr, int(n_corner - 1, c_int32_t), &
                                int(n_part, c_int32_t), c_null_ptr, c_null_ptr, cut, &
                                part_of_cell, part_of_node)
    if (code /= METIS_OK) then
      call raise_metis('partition_cells', code, EXIT_MESH, status)
      return
    end if
    part = int(part_of_cell)
    call fill_empty_parts(n_part, part)

  end subroutine partition_cells

  !> Elimination order of a symmetric matrix with little fill, by nested dissection of its graph.
  !>
  !> Deterministic. Not collective. Source: Karypis and Kumar (1998).
  subroutine order_nodes(xadj, adjncy, order, status)
    !> First neighbour of each vertex in `adjncy`, 1-based; shape (n_vertex + 1).
    integer, contiguous, intent(in) :: xadj(:)
    !> Neighbours, 1-based, every edge in both directions; the vertex itself is skipped.
    integer, contiguous, intent(in) :: adjncy(:)
    !> Position of each vertex in the elimination order, 1-based; shape (n_vertex).
    integer, contiguous, intent(out) :: order(:)
    !> `STATUS_ERROR` with `EXIT_SOLVER` when METIS fails.
    type(status_t), intent(inout) :: status

    integer(c_int32_t), allocatable :: first(:), neighbour(:), new_of_old(:), old_of_new(:)
    integer(c_int) :: code
    integer :: edge, i, n_edge, n_vertex

    n_vertex = size(order)
    do i = 1, n_vertex
      order(i) = i
    end do
    if (n_vertex < 2) return

    allocate (first(n_vertex + 1), neighbour(size(adjncy)), new_of_old(n_vertex), &
              old_of_new(n_vertex))
    n_edge = 0
    do i = 1, n_vertex
      first(i) = int(n_edge, c_int32_t)
      do edge = xadj(i), xadj(i + 1) - 1
        if (adjncy(edge) == i) cycle
        n_edge = n_edge + 1
        neighbour(n_edge) = int(adjncy(edge) - 1, c_int32_t)
      end do
    end do
    first(n_vertex + 1) = int(n_edge, c_int32_t)
    ! Without edges every order is as good, and METIS is not made for it.
    if (n_edge == 0) return

    code = metis_node_nd(int(n_vertex, c_int32_t), first, neighbour, c_null_ptr, c_null_ptr, &
                         old_of_new, new_of_old)
    if (code /= METIS_OK) then
      call raise_metis('order_nodes', code, EXIT_SOLVER, status)
      return
    end if
    order = int(new_of_old) + 1

  end subroutine order_nodes

  !> Give every empty part a cell of the largest one: METIS may leave some empty when there are
  !> few cells for each.
  pure subroutine fill_empty_parts(n_part, part)
    integer, intent(in) :: n_part
    integer, intent(inout) :: part(:)

    integer :: count(0:n_part - 1)
    integer :: empty, i, largest

    count = 0
    do i = 1, size(part)
      count(part(i)) = count(part(i)) + 1
    end do
    do empty = 0, n_part - 1
      if (count(empty) > 0) cycle
      largest = maxloc(count, dim=1) - 1
      i = findloc(part, largest, dim=1)
      part(i) = empty
      count(largest) = count(largest) - 1
      count(empty) = 1
    end do

  end subroutine fill_empty_parts

  !> Turn an error code of METIS into a failure.
  subroutine raise_metis(origin, code, exit_code, status)
    character(len=*), intent(in) :: origin
    integer(c_int), intent(in) :: code
    integer, intent(in) :: exit_code
    type(status_t), intent(inout) :: status

    if (code == METIS_ERROR_MEMORY) then
      call status%raise(STATUS_ERROR, origin, 'METIS ran out of memory', exit_code)
    else
      call status%raise(STATUS_ERROR, origin, 'METIS failed with code ' // text(int(code)), &
                        exit_code)
    end if

  end subroutine raise_metis

end module swage_partition
