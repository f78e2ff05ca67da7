!> The whole mesh, as rank 0 prepares it before it is distributed.
module swage_whole_mesh
  use swage_kinds, only: gp, wp
  use swage_mesh, only: cell_measure, face_corners, mesh_group_t, mesh_report_t
  use swage_mesh_source, only: element_list_t, mesh_source_t
  use swage_relation, only: pair_list_t, relation_from_pairs, relation_t
  use swage_simplex_table, only: simplex_table_create, simplex_table_t
  use swage_sort, only: sorting_order
  use swage_space_curve, only: curve_order
  use swage_status, only: status_t, EXIT_MESH, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: whole_mesh_t, build_whole_mesh, build_empty_mesh

  !> Volume below which a cell is flat, relative to the cube of its longest edge.
  real(wp), parameter :: FLAT = 1.0e-12_wp

  !> Cells, the nodes they use, their boundary and what belongs to which physical group.
  type :: whole_mesh_t
    integer :: dimension = 0
    !> Positions, scaled [length]; shape (dimension, n_node).
    real(wp), allocatable :: coordinates(:, :)
    !> Number in the file; shape (n_node).
    integer(gp), allocatable :: node_tag(:)
    !> Nodes in positive orientation; shape (dimension + 1, n_cell).
    integer, allocatable :: cell_node(:, :)
    !> Number in the file; shape (n_cell).
    integer(gp), allocatable :: cell_tag(:)
    !> Place in `groups` of the first group of each cell, 0 none; shape (n_cell).
    integer, allocatable :: cell_group(:)
    !> Boundary facets, ordered by cell: the cell; shape (n_facet).
    integer, allocatable :: facet_cell(:)
    !> Corner of the cell opposite to the facet; shape (n_facet).
    integer, allocatable :: facet_opposite(:)
    type(mesh_group_t), allocatable :: groups(:)
    type(relation_t) :: group_of_node
    type(relation_t) :: group_of_cell
    type(relation_t) :: group_of_facet
    type(mesh_report_t) :: report
  end type whole_mesh_t

contains

  !> Check what was read, leave out what is not needed, and find the boundary.
  !>
  !> Takes the memory of the source, which is of no use afterwards. O(n log n) elements.
  subroutine build_whole_mesh(source, dimension, scale, keep_order, whole, status)
    type(mesh_source_t), intent(inout) :: source
    !> 2: triangles in the plane z = 0; 3: tetrahedra.
    integer, intent(in) :: dimension
    !> Factor of all positions [1]; above 0.
    real(wp), intent(in) :: scale
    !> True: nodes and cells in the order of the source; false: neighbours close to each other.
    logical, intent(in) :: keep_order
    type(whole_mesh_t), intent(out) :: whole
    !> `STATUS_ERROR` with `EXIT_MESH` when the mesh has no cells, cells of another dimension, flat,
    !> repeated or overlapping cells, or does not lie in the plane.
    type(status_t), intent(inout) :: status

    type(pair_list_t) :: repeated
    type(simplex_table_t) :: faces
    integer, allocatable :: facet_of_face(:)

    whole%dimension = dimension
    call check_dimension(source, dimension, scale, status)
    if (status%failed()) return
    allocate (whole%groups, source=source%groups(:source%n_group))
    call take_cells(source, dimension, whole, repeated, status)
    if (status%failed()) return
    call take_nodes(source, scale, whole, status)
    if (status%failed()) return
    call orient_cells(source%name, whole, status)
    if (status%failed()) return
    if (.not. keep_order) then
      call order_nodes(source, whole)
      call order_cells(source, repeated, whole)
    end if
    call find_boundary(source%name, whole, faces, facet_of_face, status)
    if (status%failed()) return
    call relate_cells(source, repeated, whole)
    call relate_facets(source, faces, facet_of_face, whole)
    call relate_nodes(source, whole)

  end subroutine build_whole_mesh

  !> A mesh of nothing, for the ranks that do not have it.
  subroutine build_empty_mesh(dimension, whole)
    integer, intent(in) :: dimension
    type(whole_mesh_t), intent(out) :: whole

    integer :: none(0)

    whole%dimension = dimension
    allocate (whole%coordinates(dimension, 0), whole%node_tag(0), whole%cell_tag(0), &
              whole%cell_node(dimension + 1, 0), whole%cell_group(0), whole%facet_cell(0), &
              whole%facet_opposite(0), whole%groups(0))
    call relation_from_pairs(0, 0, none, none, whole%group_of_node)
    call relation_from_pairs(0, 0, none, none, whole%group_of_cell)
    call relation_from_pairs(0, 0, none, none, whole%group_of_facet)

  end subroutine build_empty_mesh

  !> Refuse a mesh that does not fit the dimension of the case.
  subroutine check_dimension(source, dimension, scale, status)
    type(mesh_source_t), intent(in) :: source
    integer, intent(in) :: dimension
    real(wp), intent(in) :: scale
    type(status_t), intent(inout) :: status

    character(len=*), parameter :: ORIGIN = 'build_whole_mesh'
    character(len=:), allocatable :: kind_of_cell, kind_of_group

    if (dimension /= 2 .and. dimension /= 3) then
      call status%raise(STATUS_ERROR, ORIGIN, source%name // &
                        ': the dimension of a mesh is 2 or 3, not ' // text(dimension), EXIT_MESH)
      return
    end if
    if (.not. scale > 0.0_wp) call status%raise( &
      STATUS_ERROR, ORIGIN, source%name // ': the scale of a mesh must be above 0', EXIT_MESH)
    kind_of_cell = 'tetrahedra'
    kind_of_group = 'Physical Volume'
    if (dimension == 2) then
      kind_of_cell = 'triangles'
      kind_of_group = 'Physical Surface'
      if (source%elements(3)%n > 0) call status%raise( &
        STATUS_ERROR, ORIGIN, source%name // ': the mesh has tetrahedra, but the case is ' // &
        'two-dimensional: mesh its section with triangles, or set &job dimension = ''3d''', &
        EXIT_MESH)
    end if
    if (source%elements(dimension)%n == 0) call status%raise( &
      STATUS_ERROR, ORIGIN, source%name // ': the mesh has no ' // kind_of_cell // &
      ', of which the body of this case consists. Once a physical group is defined, Gmsh ' // &
      'writes only elements of physical groups: the body needs a ' // kind_of_group // &
      '; or &job dimension is not that of the mesh', EXIT_MESH)

  end subroutine check_dimension

  !> Take the cells, those that occur once for each of several groups only once.
  subroutine take_cells(source, dimension, whole, repeated, status)
    type(mesh_source_t), intent(inout) :: source
    integer, intent(in) :: dimension
    type(whole_mesh_t), intent(inout) :: whole
    !> Cells and the further sets of groups they belong to.
    type(pair_list_t), intent(out) :: repeated
    type(status_t), intent(inout) :: status

    type(simplex_table_t) :: table
    integer :: cell, i, n_before

    associate (list => source%elements(dimension))
      call simplex_table_create(dimension + 1, list%n, table)
      do i = 1, list%n
        n_before = table%n
        call table%insert(list%node(:, i), cell)
        if (table%n > n_before) then
          list%node(:, cell) = list%node(:, i)
          list%tag(cell) = list%tag(i)
          list%set(cell) = list%set(i)
        else if (list%set(cell) == list%set(i)) then
          call status%raise(STATUS_ERROR, 'build_whole_mesh', source%name // ': cell ' // &
                            long_text(list%tag(i)) // ' has the same nodes as cell ' // &
                            long_text(list%tag(cell)) // ': keep one of them', EXIT_MESH)
          return
        else
          call repeated%append(cell, list%set(i))
        end if
      end do
      list%n = table%n
      allocate (whole%cell_node, source=list%node(:, :list%n))
      allocate (whole%cell_tag, source=list%tag(:list%n))
      deallocate (list%node, list%tag)
    end associate

  end subroutine take_cells

  !> Keep the nodes that cells use; number cells and elements of lower dimension accordingly.
  subroutine take_nodes(source, scale, whole, status)
    type(mesh_source_t), intent(inout) :: source
    real(wp), intent(in) :: scale
    type(whole_mesh_t), intent(inout) :: whole
    type(status_t), intent(inout) :: status

    integer, allocatable :: kept(:)
    integer :: d, i, j, n_node
    real(wp) :: extent

    allocate (kept(source%n_node), source=0)
    do i = 1, size(whole%cell_node, 2)
      kept(whole%cell_node(:, i)) = 1
    end do
    n_node = 0
    do i = 1, source%n_node
      if (kept(i) == 0) cycle
      n_node = n_node + 1
      kept(i) = n_node
    end do
    whole%report%n_dropped_node = int(source%n_node - n_node, gp)

    extent = maxval(abs(source%coordinates(:whole%dimension, :)))
    allocate (whole%coordinates(whole%dimension, n_node), whole%node_tag(n_node))
    do i = 1, source%n_node
      if (kept(i) == 0) cycle
      whole%coordinates(:, kept(i)) = scale * source%coordinates(:whole%dimension, i)
      whole%node_tag(kept(i)) = source%node_tag(i)
      if (whole%dimension == 3) cycle
      if (abs(source%coordinates(3, i)) > 1.0e-9_wp * extent) then
        call status%raise(STATUS_ERROR, 'build_whole_mesh', source%name // ': node ' // &
                          long_text(source%node_tag(i)) // ' has z = ' // &
                          text(source%coordinates(3, i)) // &
                          ': the mesh of a two-dimensional case lies in the plane z = 0', &
                          EXIT_MESH)
        return
      end if
    end do
    deallocate (source%coordinates, source%node_tag)

    do i = 1, size(whole%cell_node, 2)
      whole%cell_node(:, i) = kept(whole%cell_node(:, i))
    end do
    ! An element of lower dimension with a node that no cell uses is none of the body's.
    do d = 0, whole%dimension - 1
      associate (list => source%elements(d))
        j = 0
        do i = 1, list%n
          if (any(kept(list%node(:, i)) == 0)) cycle
          j = j + 1
          list%node(:, j) = kept(list%node(:, i))
          list%tag(j) = list%tag(i)
          list%set(j) = list%set(i)
        end do
        list%n = j
      end associate
    end do

  end subroutine take_nodes

  !> Turn cells around that have a negative volume; refuse flat ones.
  subroutine orient_cells(name, whole, status)
    character(len=*), intent(in) :: name
    type(whole_mesh_t), intent(inout) :: whole
    type(status_t), intent(inout) :: status

    real(wp) :: corners(whole%dimension, whole%dimension + 1), longest, measure
    integer :: cell, i, j, n

    n = whole%dimension + 1
    do cell = 1, size(whole%cell_node, 2)
      corners = whole%coordinates(:, whole%cell_node(:, cell))
      longest = 0.0_wp
      do i = 2, n
        do j = 1, i - 1
          longest = max(longest, norm2(corners(:, i) - corners(:, j)))
        end do
      end do
      measure = cell_measure(corners)
      if (abs(measure) <= FLAT * longest**whole%dimension) then
        call status%raise(STATUS_ERROR, 'build_whole_mesh', name // ': cell ' // &
                          long_text(whole%cell_tag(cell)) // ' is flat: its nodes, with number ' &
                          // long_text(whole%node_tag(whole%cell_node(1, cell))) // ' at ' // &
                          position_text(corners(:, 1)) // ', span no volume: look for ' // &
                          'coinciding points and mesh again', EXIT_MESH)
        return
      end if
      if (measure < 0.0_wp) then
        whole%cell_node(n - 1:n, cell) = whole%cell_node([n, n - 1], cell)
        whole%report%n_reoriented = whole%report%n_reoriented + 1_gp
      end if
    end do

  end subroutine orient_cells

  !> Number the nodes along a curve that fills space.
  subroutine order_nodes(source, whole)
    type(mesh_source_t), intent(inout) :: source
    type(whole_mesh_t), intent(inout) :: whole

    integer, allocatable :: new(:), old(:)
    integer :: cell, d, i

    allocate (old, source=curve_order(whole%coordinates))
    allocate (new(size(old)))
    do i = 1, size(old)
      new(old(i)) = i
    end do
    whole%coordinates = whole%coordinates(:, old)
    whole%node_tag = whole%node_tag(old)
    do cell = 1, size(whole%cell_node, 2)
      whole%cell_node(:, cell) = new(whole%cell_node(:, cell))
    end do
    do d = 0, whole%dimension - 1
      associate (list => source%elements(d))
        do i = 1, list%n
          list%node(:, i) = new(list%node(:, i))
        end do
      end associate
    end do

  end subroutine order_nodes

  !> Cells by the last of their nodes: when they are taken one after the other, what belongs to a
  !> node is needed soon after its neighbours and no more once the last neighbour has come.
  subroutine order_cells(source, repeated, whole)
    type(mesh_source_t), intent(inout) :: source
    !> Cells and the further sets of groups they belong to.
    type(pair_list_t), intent(inout) :: repeated
    type(whole_mesh_t), intent(inout) :: whole

    integer, allocatable :: new(:), old(:)
    integer :: i, n

    n = size(whole%cell_tag)
    allocate (old, source=sorting_order(int(maxval(whole%cell_node, dim=1), gp)))
    allocate (new(n))
    do i = 1, n
      new(old(i)) = i
    end do
    whole%cell_node = whole%cell_node(:, old)
    whole%cell_tag = whole%cell_tag(old)
    associate (set => source%elements(whole%dimension)%set)
      set(:n) = set(old)
    end associate
    do i = 1, repeated%n
      repeated%left(i) = new(repeated%left(i))
    end do

  end subroutine order_cells

  !> The faces that belong to one cell only.
  subroutine find_boundary(name, whole, faces, facet_of_face, status)
    character(len=*), intent(in) :: name
    type(whole_mesh_t), intent(inout) :: whole
    !> All faces.
    type(simplex_table_t), intent(out) :: faces
    !> Boundary facet that a face is, 0 none.
    integer, allocatable, intent(out) :: facet_of_face(:)
    type(status_t), intent(inout) :: status

    integer, allocatable :: face_of_cell(:, :), n_cell_of_face(:)
    integer :: cell, d, face, n_before, n_cell, n_facet, opposite

    d = whole%dimension
    n_cell = size(whole%cell_node, 2)
    call simplex_table_create(d, (d + 1) * n_cell, faces)
    allocate (face_of_cell(d + 1, n_cell), n_cell_of_face((d + 1) * n_cell))
    do cell = 1, n_cell
      do opposite = 1, d + 1
        n_before = faces%n
        call faces%insert(whole%cell_node(face_corners(d, opposite), cell), face)
        face_of_cell(opposite, cell) = face
        if (faces%n > n_before) n_cell_of_face(face) = 0
        n_cell_of_face(face) = n_cell_of_face(face) + 1
        if (n_cell_of_face(face) > 2) then
          call status%raise(STATUS_ERROR, 'build_whole_mesh', name // ': cell ' // &
                            long_text(whole%cell_tag(cell)) // ' shares a face with two others: ' &
                            // 'cells overlap', EXIT_MESH)
          return
        end if
      end do
    end do

    n_facet = count(n_cell_of_face(:faces%n) == 1)
    allocate (whole%facet_cell(n_facet), whole%facet_opposite(n_facet))
    allocate (facet_of_face(faces%n), source=0)
    n_facet = 0
    do cell = 1, n_cell
      do opposite = 1, d + 1
        face = face_of_cell(opposite, cell)
        if (n_cell_of_face(face) /= 1) cycle
        n_facet = n_facet + 1
        facet_of_face(face) = n_facet
        whole%facet_cell(n_facet) = cell
        whole%facet_opposite(n_facet) = opposite
      end do
    end do

  end subroutine find_boundary

  !> Groups of the cells.
  subroutine relate_cells(source, repeated, whole)
    type(mesh_source_t), intent(in) :: source
    type(pair_list_t), intent(in) :: repeated
    type(whole_mesh_t), intent(inout) :: whole

    type(element_list_t) :: cells
    integer :: d, i, n, n_cell

    d = whole%dimension
    n_cell = size(whole%cell_tag)
    ! Cells with the sets they belong to, one after the other, as if they were elements.
    cells%n = n_cell + repeated%n
    allocate (cells%node(1, cells%n), cells%set(cells%n))
    do i = 1, n_cell
      cells%node(1, i) = i
    end do
    cells%set(:n_cell) = source%elements(d)%set(:n_cell)
    n = repeated%n
    if (n > 0) then
      cells%node(1, n_cell + 1:) = repeated%left(:n)
      cells%set(n_cell + 1:) = repeated%right(:n)
    end if
    call relate(source, cells%node(1, :), cells%set, n_cell, whole%group_of_cell)

    allocate (whole%cell_group(n_cell))
    do i = 1, n_cell
      whole%cell_group(i) = 0
      if (whole%group_of_cell%first(i + 1) > whole%group_of_cell%first(i)) then
        whole%cell_group(i) = whole%group_of_cell%item(whole%group_of_cell%first(i))
      end if
    end do

  end subroutine relate_cells

  !> Groups of the boundary facets: of facets, and of the cells behind them.
  subroutine relate_facets(source, faces, facet_of_face, whole)
    type(mesh_source_t), intent(in) :: source
    type(simplex_table_t), intent(in) :: faces
    integer, intent(in) :: facet_of_face(:)
    type(whole_mesh_t), intent(inout) :: whole

    type(pair_list_t) :: pairs
    integer, allocatable :: groups(:)
    integer :: face, facet, i, j

    associate (list => source%elements(whole%dimension - 1))
      do i = 1, list%n
        face = faces%find(list%node(:, i))
        if (face == 0) cycle
        if (facet_of_face(face) == 0) cycle
        groups = source%groups_in(list%set(i))
        do j = 1, size(groups)
          call pairs%append(facet_of_face(face), groups(j))
        end do
      end do
    end associate
    do facet = 1, size(whole%facet_cell)
      i = whole%facet_cell(facet)
      do j = whole%group_of_cell%first(i), whole%group_of_cell%first(i + 1) - 1
        call pairs%append(facet, whole%group_of_cell%item(j))
      end do
    end do
    call relate_pairs(pairs, size(whole%facet_cell), size(whole%groups), whole%group_of_facet)

  end subroutine relate_facets

  !> Groups of the nodes, and how many entities each group has.
  subroutine relate_nodes(source, whole)
    type(mesh_source_t), intent(in) :: source
    type(whole_mesh_t), intent(inout) :: whole

    type(pair_list_t) :: pairs
    type(relation_t) :: elements, groups
    integer, allocatable :: every(:), last_group(:)
    integer :: d, i, n_group

    n_group = size(whole%groups)
    allocate (last_group(size(whole%node_tag)), source=0)
    do d = 0, whole%dimension - 1
      associate (list => source%elements(d))
        allocate (every(list%n))
        do i = 1, list%n
          every(i) = i
        end do
        call relate(source, every, list%set(:list%n), list%n, groups)
        deallocate (every)
        call groups%inverse(n_group, elements)
        call collect_nodes(list%node)
      end associate
    end do
    call whole%group_of_cell%inverse(n_group, elements)
    call collect_nodes(whole%cell_node)
    call relate_pairs(pairs, size(whole%node_tag), n_group, whole%group_of_node)

  contains

    !> Note each node once for each group of its elements.
    subroutine collect_nodes(element_node)
      integer, intent(in) :: element_node(:, :)

      integer :: corner, element, group, node, place

      do group = 1, n_group
        do place = elements%first(group), elements%first(group + 1) - 1
          element = elements%item(place)
          do corner = 1, size(element_node, 1)
            node = element_node(corner, element)
            if (last_group(node) == group) cycle
            last_group(node) = group
            call pairs%append(node, group)
          end do
        end do
        whole%groups(group)%n_entity_global = whole%groups(group)%n_entity_global &
          + int(elements%first(group + 1) - elements%first(group), gp)
      end do

    end subroutine collect_nodes

  end subroutine relate_nodes

  !> Relation of things to groups from the sets they belong to.
  subroutine relate(source, thing, set, n_thing, relation)
    type(mesh_source_t), intent(in) :: source
    integer, intent(in) :: thing(:)
    !> Shape as `thing`.
    integer, intent(in) :: set(:)
    integer, intent(in) :: n_thing
    type(relation_t), intent(out) :: relation

    type(pair_list_t) :: pairs
    integer :: i, j

    do i = 1, size(thing)
      do j = source%first_of_set(set(i)), source%first_of_set(set(i) + 1) - 1
        call pairs%append(thing(i), source%group_of_set(j))
      end do
    end do
    call relate_pairs(pairs, n_thing, source%n_group, relation)

  end subroutine relate

  !> Relation from a list of pairs, which may be empty.
  subroutine relate_pairs(pairs, n_left, n_right, relation)
    type(pair_list_t), intent(in) :: pairs
    integer, intent(in) :: n_left, n_right
    type(relation_t), intent(out) :: relation

    integer :: none(0)

    if (pairs%n == 0) then
      call relation_from_pairs(n_left, n_right, none, none, relation)
    else
      call relation_from_pairs(n_left, n_right, pairs%left(:pairs%n), pairs%right(:pairs%n), &
                               relation)
    end if

  end subroutine relate_pairs

  !> A position as text.
  pure function position_text(position) result(string)
    real(wp), intent(in) :: position(:)
    character(len=:), allocatable :: string

    integer :: i

    string = '('
    do i = 1, size(position)
      if (i > 1) string = string // ', '
      string = string // text(position(i))
    end do
    string = string // ')'

  end function position_text

  !> A long integer as text.
  pure function long_text(value) result(string)
    integer(gp), intent(in) :: value
    character(len=:), allocatable :: string

    character(len=24) :: buffer

    write (buffer, '(i0)') value
    string = trim(buffer)

  end function long_text

end module swage_whole_mesh
