!> The mesh as each rank sees it.
module swage_mesh
  use swage_halo, only: halo_t
  use swage_kinds, only: gp, wp
  use swage_relation, only: relation_t
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: mesh_t, mesh_group_t, mesh_report_t
  public :: cell_measure, face_corners, group_place, search_groups
  public :: GROUP_NAME_LENGTH

  !> Longest name of a physical group (Gmsh allows 127 characters).
  integer, parameter :: GROUP_NAME_LENGTH = 128

  !> A physical group: points, lines, triangles or tetrahedra of the mesh under one name.
  type :: mesh_group_t
    !> Blank when the mesh gives only a number.
    character(len=GROUP_NAME_LENGTH) :: name = ''
    !> Unique among the groups of one dimension.
    integer :: tag = 0
    !> Of its entities: 0 points, 1 lines, 2 triangles, 3 tetrahedra.
    integer :: dimension = 0
    !> Entities on all ranks of which every node belongs to a cell.
    integer(gp) :: n_entity_global = 0_gp
  end type mesh_group_t

  !> What was found while the mesh was read; the same on all ranks.
  type :: mesh_report_t
    !> Cells whose nodes were given in negative order, which was mended.
    integer(gp) :: n_reoriented = 0_gp
    !> Nodes that belong to no cell and were left out.
    integer(gp) :: n_dropped_node = 0_gp
    !> Nodes that became one with others at the same place, and nodes that were added where bodies
    !> are to be apart.
    integer(gp) :: n_merged_node = 0_gp
    integer(gp) :: n_split_node = 0_gp
    !> Largest memory of rank 0 until the mesh was distributed, in megabytes; 0 unknown.
    real(wp) :: peak_memory = 0.0_wp
  end type mesh_report_t

  !> This rank's part of a mesh of triangles (dimension 2) or tetrahedra (dimension 3).
  !>
  !> Every cell is on exactly one rank. A rank has the nodes of its cells; a node on several ranks
  !> is owned by one of them, and owned nodes come first. Global numbers are contiguous by rank.
  type :: mesh_t
    !> 2 or 3.
    integer :: dimension = 0
    !> Nodes of this rank's cells.
    integer :: n_node = 0
    !> Those owned by this rank: local numbers 1 to n_own_node.
    integer :: n_own_node = 0
    integer(gp) :: n_node_global = 0_gp
    integer(gp) :: n_cell_global = 0_gp
    !> Global number, from 1; shape (n_node).
    integer(gp), allocatable :: node_global(:)
    !> Number in the mesh file; shape (n_node).
    integer(gp), allocatable :: node_tag(:)
    !> Rank r owns the global numbers node_offset(r) + 1 to node_offset(r + 1); shape (0:n_rank).
    integer(gp), allocatable :: node_offset(:)
    !> Positions [length]; shape (dimension, n_node).
    real(wp), allocatable :: coordinates(:, :)
    integer :: n_cell = 0
    !> Local nodes, in positive orientation; shape (dimension + 1, n_cell).
    integer, allocatable :: cell_node(:, :)
    !> Number in the mesh file; shape (n_cell).
    integer(gp), allocatable :: cell_tag(:)
    !> Place in `groups` of the first group of cells it belongs to, 0 none; shape (n_cell).
    integer, allocatable :: cell_group(:)
    !> Facets of this rank's cells that belong to no other cell of the mesh.
    integer :: n_facet = 0
    !> Local nodes; the normal by the right-hand rule points outwards (dimension 3), the body is on
    !> the left (dimension 2); shape (dimension, n_facet).
    integer, allocatable :: facet_node(:, :)
    !> Cell behind each facet; shape (n_facet).
    integer, allocatable :: facet_cell(:)
    !> Physical groups, the same list on all ranks, those without entities included.
    type(mesh_group_t), allocatable :: groups(:)
    !> Exchange with the ranks that share nodes.
    type(halo_t) :: halo
    type(mesh_report_t) :: report
    !> Local nodes of each group, also of the cells and facets that other ranks have.
    type(relation_t) :: node_of_group
    !> Boundary facets of each group, and of the cells of each group of cells.
    type(relation_t) :: facet_of_group
    !> Cells of each group of cells.
    type(relation_t) :: cell_of_group
  contains
    !> Place of a group in `groups`, from its name or number.
    procedure :: find_group => mesh_find_group
    !> Sentence that tells why a group was not found and which there are.
    procedure :: explain_group => mesh_explain_group
    !> Local nodes of a group, owned and not, ascending.
    procedure :: group_nodes => mesh_group_nodes
    !> Local boundary facets of a group, ascending.
    procedure :: group_facets => mesh_group_facets
    !> Local cells of a group, ascending; none unless it is a group of cells.
    procedure :: group_cells => mesh_group_cells
    !> Signed area or volume of each cell.
    procedure :: cell_measures => mesh_cell_measures
    !> Size of each cell.
    procedure :: cell_size => mesh_cell_size
    !> Outward normal of a boundary facet times its measure.
    procedure :: facet_area => mesh_facet_area
  end type mesh_t

contains

  !> Place of a group in `groups`; 0 when there is none, or when several fit.
  !>
  !> Names are tried before numbers. A name or number that groups of several dimensions have
  !> needs `dimension`.
  pure function mesh_find_group(self, name_or_tag, dimension) result(place)
    class(mesh_t), intent(in) :: self
    !> Name or number of the group, as written in the input file.
    character(len=*), intent(in) :: name_or_tag
    !> Only groups of entities of this dimension are meant.
    integer, intent(in), optional :: dimension
    integer :: place

    integer :: n_found

    call search_groups(self%groups, name_or_tag, place, n_found, dimension)
    if (n_found /= 1) place = 0

  end function mesh_find_group

  !> Sentence for the message about a group that `find_group` did not find.
  pure function mesh_explain_group(self, name_or_tag, dimension) result(sentence)
    class(mesh_t), intent(in) :: self
    character(len=*), intent(in) :: name_or_tag
    integer, intent(in), optional :: dimension
    character(len=:), allocatable :: sentence

    integer :: i, n_found, place

    call search_groups(self%groups, name_or_tag, place, n_found, dimension)
    if (n_found > 1) then
      sentence = 'several physical groups are called ''' // trim(name_or_tag) // &
        ''': give each its own name'
    else
      sentence = 'the mesh has no physical group ''' // trim(name_or_tag) // ''''
      if (present(dimension)) sentence = sentence // ' of ' // entities(dimension)
    end if
    sentence = sentence // '; its groups are:'
    if (size(self%groups) == 0) sentence = sentence // ' none'
    do i = 1, size(self%groups)
      if (i > 1) sentence = sentence // ','
      sentence = sentence // ' ' // text(self%groups(i)%tag)
      if (self%groups(i)%name /= '') then
        sentence = sentence // ' ''' // trim(self%groups(i)%name) // ''''
      end if
      sentence = sentence // ' (' // entities(self%groups(i)%dimension)
      if (self%groups(i)%n_entity_global == 0_gp) sentence = sentence // ', empty'
      sentence = sentence // ')'
    end do

  end function mesh_explain_group

  pure function mesh_group_nodes(self, place) result(nodes)
    class(mesh_t), intent(in) :: self
    !> From `find_group`.
    integer, intent(in) :: place
    integer, allocatable :: nodes(:)

    allocate (nodes, source=self%node_of_group%items(place))

  end function mesh_group_nodes

  pure function mesh_group_facets(self, place) result(facets)
    class(mesh_t), intent(in) :: self
    !> From `find_group`.
    integer, intent(in) :: place
    integer, allocatable :: facets(:)

    allocate (facets, source=self%facet_of_group%items(place))

  end function mesh_group_facets

  pure function mesh_group_cells(self, place) result(cells)
    class(mesh_t), intent(in) :: self
    !> From `find_group`.
    integer, intent(in) :: place
    integer, allocatable :: cells(:)

    allocate (cells, source=self%cell_of_group%items(place))

  end function mesh_group_cells

  !> Area of each triangle or volume of each tetrahedron [length^dimension]; negative when it is
  !> inverted.
  pure function mesh_cell_measures(self) result(measures)
    class(mesh_t), intent(in) :: self
    real(wp) :: measures(self%n_cell)

    integer :: cell

    do cell = 1, self%n_cell
      measures(cell) = cell_measure(self%coordinates(:, self%cell_node(:, cell)))
    end do

  end function mesh_cell_measures

  !> Edge of the regular triangle or tetrahedron that has the area or volume of the cell [length].
  pure function mesh_cell_size(self) result(edge)
    class(mesh_t), intent(in) :: self
    real(wp) :: edge(self%n_cell)

    if (self%dimension == 2) then
      edge = sqrt(4.0_wp / sqrt(3.0_wp) * abs(self%cell_measures()))
    else
      edge = (6.0_wp * sqrt(2.0_wp) * abs(self%cell_measures()))**(1.0_wp / 3.0_wp)
    end if

  end function mesh_cell_size

  !> Outward normal times length (dimension 2, per unit of depth) or area (3) of a boundary facet
  !> [length^(dimension - 1)].
  pure function mesh_facet_area(self, facet) result(area)
    class(mesh_t), intent(in) :: self
    integer, intent(in) :: facet
    real(wp) :: area(self%dimension)

    real(wp) :: edge(self%dimension, self%dimension - 1)
    integer :: i

    do i = 1, self%dimension - 1
      edge(:, i) = self%coordinates(:, self%facet_node(i + 1, facet)) &
        - self%coordinates(:, self%facet_node(1, facet))
    end do
    if (self%dimension == 2) then
      area = [edge(2, 1), -edge(1, 1)]
    else
      area = 0.5_wp * [edge(2, 1) * edge(3, 2) - edge(3, 1) * edge(2, 2), &
                       edge(3, 1) * edge(1, 2) - edge(1, 1) * edge(3, 2), &
                       edge(1, 1) * edge(2, 2) - edge(2, 1) * edge(1, 2)]
    end if

  end function mesh_facet_area

  !> Signed area of a triangle or volume of a tetrahedron [length^dimension].
  pure function cell_measure(corners) result(measure)
    !> Positions [length]; shape (dimension, dimension + 1).
    real(wp), intent(in) :: corners(:, :)
    real(wp) :: measure

    real(wp) :: edge(3, 3)
    integer :: d, i

    d = size(corners, 1)
    do i = 1, d
      edge(:d, i) = corners(:, i + 1) - corners(:, 1)
    end do
    if (d == 2) then
      measure = 0.5_wp * (edge(1, 1) * edge(2, 2) - edge(2, 1) * edge(1, 2))
    else
      measure = (edge(1, 1) * (edge(2, 2) * edge(3, 3) - edge(3, 2) * edge(2, 3)) &
                 + edge(2, 1) * (edge(3, 2) * edge(1, 3) - edge(1, 2) * edge(3, 3)) &
                 + edge(3, 1) * (edge(1, 2) * edge(2, 3) - edge(2, 2) * edge(1, 3))) / 6.0_wp
    end if

  end function cell_measure

  !> Corners of the face opposite to a corner, oriented outwards for a cell of positive measure.
  pure function face_corners(dimension, opposite) result(corners)
    integer, intent(in) :: dimension
    !> From 1 to dimension + 1.
    integer, intent(in) :: opposite
    integer :: corners(dimension)

    integer, parameter :: OF_TRIANGLE(2, 3) = reshape([2, 3, 3, 1, 1, 2], [2, 3])
    integer, parameter :: OF_TETRAHEDRON(3, 4) = &
      reshape([2, 3, 4, 1, 4, 3, 1, 2, 4, 1, 3, 2], [3, 4])

    if (dimension == 2) then
      corners = OF_TRIANGLE(:, opposite)
    else
      corners = OF_TETRAHEDRON(:, opposite)
    end if

  end function face_corners

  !> Place of the group of a dimension with a number, 0 none.
  pure function group_place(groups, dimension, tag) result(place)
    type(mesh_group_t), intent(in) :: groups(:)
    integer, intent(in) :: dimension, tag
    integer :: place

    do place = 1, size(groups)
      if (groups(place)%dimension == dimension .and. groups(place)%tag == tag) return
    end do
    place = 0

  end function group_place

  !> First group that fits a name, or else a number, and how many fit.
  pure subroutine search_groups(groups, name_or_tag, place, n_found, dimension)
    type(mesh_group_t), intent(in) :: groups(:)
    character(len=*), intent(in) :: name_or_tag
    integer, intent(out) :: place
    integer, intent(out) :: n_found
    integer, intent(in), optional :: dimension

    integer :: i
    logical :: meant(size(groups))

    meant = groups%name == name_or_tag .and. name_or_tag /= ''
    if (present(dimension)) meant = meant .and. groups%dimension == dimension
    if (.not. any(meant)) then
      do i = 1, size(groups)
        meant(i) = text(groups(i)%tag) == adjustl(name_or_tag)
      end do
      if (present(dimension)) meant = meant .and. groups%dimension == dimension
    end if
    n_found = count(meant)
    place = findloc(meant, .true., dim=1)

  end subroutine search_groups

  !> What groups of a dimension consist of.
  pure function entities(dimension) result(word)
    integer, intent(in) :: dimension
    character(len=:), allocatable :: word

    select case (dimension)
    case (0)
      word = 'points'
    case (1)
      word = 'lines'
    case (2)
      word = 'triangles'
    case default
      word = 'tetrahedra'
    end select

  end function entities

end module swage_mesh
