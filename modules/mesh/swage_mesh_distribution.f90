!> From a file, or from arrays, to the parts of the mesh on each rank.
!>
!> Rank 0 alone ever holds the whole mesh, and releases it before returning.
module swage_mesh_distribution
  use swage_comm, only: comm_t
  use swage_gmsh_reader, only: read_gmsh
  use swage_halo, only: halo_create
  use swage_kinds, only: gp, wp
  use swage_memory, only: peak_memory
  use swage_mesh, only: face_corners, mesh_group_t, mesh_t
  use swage_mesh_interface, only: apply_interfaces, mesh_interface_t
  use swage_mesh_source, only: mesh_source_create, mesh_source_t
  use swage_partition, only: partition_cells
  use swage_relation, only: relation_from_pairs, relation_t
  use swage_sort, only: sorting_order
  use swage_status, only: status_t, EXIT_MESH, STATUS_ERROR
  use swage_text, only: text
  use swage_whole_mesh, only: build_empty_mesh, build_whole_mesh, whole_mesh_t
  implicit none(type, external)
  private

  public :: mesh_load, mesh_from_arrays

  !> Where everything goes. Lists "by rank" hold rank 0's items, then rank 1's, and so on.
  type :: plan_t
    !> Cells of each rank; shape (0:n_rank - 1).
    integer, allocatable :: n_cell(:)
    !> Cells by rank, in the order of the whole mesh.
    integer, allocatable :: cell(:)
    !> Their nodes by local number, cell after cell; shape ((dimension + 1) * size(cell)).
    integer, allocatable :: cell_node(:)
    !> Nodes of each rank; shape (0:n_rank - 1).
    integer, allocatable :: n_node(:)
    !> Nodes by rank: owned ones, then the others, each by global number.
    integer, allocatable :: node(:)
    !> Global number of each node of the whole mesh.
    integer(gp), allocatable :: node_global(:)
    !> Shape (0:n_rank).
    integer(gp), allocatable :: node_offset(:)
    !> Facets of each rank; shape (0:n_rank - 1).
    integer, allocatable :: n_facet(:)
    !> Facets by rank, ordered by cell.
    integer, allocatable :: facet(:)
    !> Local number of the cell of each.
    integer, allocatable :: facet_cell(:)
  end type plan_t

contains

  !> Collective. Read a Gmsh file (text, format 2.2 or 4.1) and distribute the mesh.
  !>
  !> Nodes and cells are put in an order in which neighbours are close to each other; their numbers
  !> in the file are kept as tags.
  subroutine mesh_load(path, dimension, scale, comm, mesh, status, interfaces)
    character(len=*), intent(in) :: path
    !> 2: triangles in the plane z = 0; 3: tetrahedra.
    integer, intent(in) :: dimension
    !> Factor of all positions [1]; above 0.
    real(wp), intent(in) :: scale
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(out) :: mesh
    !> `STATUS_ERROR` with `EXIT_MESH`, the same on all ranks, when the file or the mesh is faulty;
    !> with `EXIT_INPUT` when it does not fit `interfaces`.
    type(status_t), intent(inout) :: status
    !> What is asked for where bodies meet.
    type(mesh_interface_t), intent(in), optional :: interfaces(:)

    type(mesh_source_t) :: source
    integer :: n_merged, n_split

    n_merged = 0
    n_split = 0
    if (comm%rank == 0) then
      call read_gmsh(path, source, status)
      if (present(interfaces) .and. .not. status%failed()) then
        call apply_interfaces(source, dimension, interfaces, n_merged, n_split, status)
      end if
    end if
    call distribute(source, dimension, scale, .false., comm, mesh, status)
    if (status%failed()) return
    mesh%report%n_merged_node = int(n_merged, gp)
    mesh%report%n_split_node = int(n_split, gp)
    call comm%sum(mesh%report%n_merged_node)
    call comm%sum(mesh%report%n_split_node)
    ! What has been merged belongs to no cell any more
    mesh%report%n_dropped_node = mesh%report%n_dropped_node - mesh%report%n_merged_node

  end subroutine mesh_load

  !> Collective. Distribute a mesh given as arrays on rank 0; those of other ranks are not used.
  !>
  !> Numbers "in the mesh file" are then the places in the arrays. With one rank, nodes and cells
  !> keep the order of the arrays.
  subroutine mesh_from_arrays(dimension, coordinates, cell_node, cell_group, comm, mesh, status, &
                              facet_node, facet_group, groups)
    !> 2: triangles; 3: tetrahedra.
    integer, intent(in) :: dimension
    !> Positions [length]; shape (dimension, n_node).
    real(wp), intent(in) :: coordinates(:, :)
    !> Nodes, from 1; shape (dimension + 1, n_cell).
    integer, intent(in) :: cell_node(:, :)
    !> Number of the group of each cell, 0 none; shape (n_cell).
    integer, intent(in) :: cell_group(:)
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(out) :: mesh
    !> `STATUS_ERROR` with `EXIT_MESH`, the same on all ranks, when the mesh is faulty.
    type(status_t), intent(inout) :: status
    !> Nodes of the facets that belong to groups; shape (dimension, n). A facet of several groups
    !> is repeated. Given with `facet_group`.
    integer, intent(in), optional :: facet_node(:, :)
    !> Number of the group of each; shape (n).
    integer, intent(in), optional :: facet_group(:)
    !> Names of groups, by dimension and number; groups without a name need not be here.
    type(mesh_group_t), intent(in), optional :: groups(:)

    type(mesh_source_t) :: source
    integer :: i, place

    if (comm%rank == 0) then
      call mesh_source_create('mesh', source)
      if (present(groups)) then
        do i = 1, size(groups)
          call source%need_group(groups(i)%dimension, groups(i)%tag, place)
          source%groups(place)%name = groups(i)%name
        end do
      end if
      call take_positions(coordinates, source)
      call take_elements(cell_node, cell_group, dimension, source, status)
      if (present(facet_node) .and. present(facet_group)) then
        call take_elements(facet_node, facet_group, dimension - 1, source, status)
      end if
    end if
    call distribute(source, dimension, 1.0_wp, .true., comm, mesh, status)

  end subroutine mesh_from_arrays

  !> Positions given by a program.
  pure subroutine take_positions(coordinates, source)
    real(wp), intent(in) :: coordinates(:, :)
    type(mesh_source_t), intent(inout) :: source

    integer :: i, n_row

    n_row = min(size(coordinates, 1), 3)
    source%n_node = size(coordinates, 2)
    deallocate (source%coordinates, source%node_tag)
    allocate (source%coordinates(3, source%n_node), source=0.0_wp)
    allocate (source%node_tag(source%n_node))
    do i = 1, source%n_node
      source%coordinates(:n_row, i) = coordinates(:n_row, i)
      source%node_tag(i) = int(i, gp)
    end do

  end subroutine take_positions

  !> Elements of one dimension given by a program.
  subroutine take_elements(element_node, tag_of_group, dimension, source, status)
    integer, intent(in) :: element_node(:, :)
    integer, intent(in) :: tag_of_group(:)
    integer, intent(in) :: dimension
    type(mesh_source_t), intent(inout) :: source
    !> `STATUS_ERROR` when a shape is wrong or a node does not exist.
    type(status_t), intent(inout) :: status

    integer, allocatable :: longer(:), set_of_group(:)
    integer :: i, place, set

    if (status%failed()) return
    if (dimension < 1 .or. dimension > 3 .or. size(element_node, 1) /= dimension + 1 &
        .or. size(element_node, 2) /= size(tag_of_group)) then
      call status%raise(STATUS_ERROR, 'mesh_from_arrays', source%name // &
                        ': the shapes of the arrays do not fit the dimension or each other', &
                        EXIT_MESH)
      return
    end if
    allocate (set_of_group(source%n_group + 1), source=0)
    call source%elements(dimension)%reserve(size(tag_of_group))
    do i = 1, size(tag_of_group)
      if (any(element_node(:, i) < 1) .or. any(element_node(:, i) > source%n_node)) then
        call status%raise(STATUS_ERROR, 'mesh_from_arrays', source%name // ': element ' // &
                          text(i) // ' has a node outside 1 to ' // text(source%n_node), EXIT_MESH)
        return
      end if
      if (tag_of_group(i) == 0) then
        call source%add_set([integer ::], set)
      else
        call source%need_group(dimension, tag_of_group(i), place)
        if (place > size(set_of_group)) then
          allocate (longer(2 * place), source=0)
          longer(:size(set_of_group)) = set_of_group
          call move_alloc(longer, set_of_group)
        end if
        if (set_of_group(place) == 0) call source%add_set([place], set_of_group(place))
        set = set_of_group(place)
      end if
      call source%elements(dimension)%append(element_node(:, i), int(i, gp), set)
    end do

  end subroutine take_elements

  !> Collective. Prepare the mesh on rank 0, give each rank its part.
  subroutine distribute(source, dimension, scale, keep_order, comm, mesh, status)
    !> On rank 0; its memory is taken.
    type(mesh_source_t), intent(inout) :: source
    integer, intent(in) :: dimension
    real(wp), intent(in) :: scale
    !> See [[build_whole_mesh]].
    logical, intent(in) :: keep_order
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(inout) :: mesh
    !> Outcome of the reading on rank 0 on entry, the same on all ranks on return.
    type(status_t), intent(inout) :: status

    type(whole_mesh_t) :: whole
    integer, allocatable :: part(:)
    type(plan_t) :: plan

    if (comm%rank == 0) then
      if (.not. status%failed()) then
        call build_whole_mesh(source, dimension, scale, keep_order, whole, status)
      end if
      if (.not. status%failed()) then
        allocate (part(size(whole%cell_tag)))
        call partition_cells(size(whole%node_tag), whole%cell_node, comm%size, part, status)
      end if
    end if
    call comm%agree(status)
    if (status%failed()) return
    if (comm%rank /= 0) then
      call build_empty_mesh(dimension, whole)
      allocate (part(0))
    end if

    call make_plan(whole, part, comm%size, plan)
    mesh%dimension = dimension
    call send_groups(whole, comm, mesh)
    call send_cells(whole, plan, comm, mesh)
    call send_nodes(whole, plan, comm, mesh)
    call send_facets(whole, plan, comm, mesh)
    call send_relation(whole%group_of_cell, plan%cell, plan%n_cell, comm, size(mesh%groups), &
                       mesh%cell_of_group)
    call send_relation(whole%group_of_node, plan%node, plan%n_node, comm, size(mesh%groups), &
                       mesh%node_of_group)
    call send_relation(whole%group_of_facet, plan%facet, plan%n_facet, comm, size(mesh%groups), &
                       mesh%facet_of_group)
    call halo_create(comm, mesh%n_own_node, mesh%node_global, mesh%node_offset, mesh%halo)

    mesh%report%peak_memory = 0.0_wp
    if (comm%rank == 0) mesh%report%peak_memory = peak_memory()
    call comm%max(mesh%report%peak_memory)

  end subroutine distribute

  !> Who gets which cells, nodes and facets, and who owns which nodes.
  subroutine make_plan(whole, part, n_rank, plan)
    type(whole_mesh_t), intent(in) :: whole
    !> Rank of each cell.
    integer, intent(in) :: part(:)
    integer, intent(in) :: n_rank
    type(plan_t), intent(out) :: plan

    integer, allocatable :: rank_of_copy(:), owner(:)
    integer :: rank

    call sort_by_rank(part, n_rank, plan%n_cell, plan%cell)
    call collect_copies(whole, n_rank, plan)
    allocate (rank_of_copy(size(plan%node)))
    do rank = 0, n_rank - 1
      rank_of_copy(sum(plan%n_node(:rank - 1)) + 1:sum(plan%n_node(:rank))) = rank + 1
    end do
    call choose_owners(plan%node, rank_of_copy, n_rank, size(whole%node_tag), owner)
    call number_nodes(owner, n_rank, plan)
    call order_copies(whole, owner, n_rank, plan)
    call plan_facets(whole, part, n_rank, plan)

  end subroutine make_plan

  !> Items by rank, in their own order within a rank.
  pure subroutine sort_by_rank(rank_of_item, n_rank, n_item, item)
    integer, intent(in) :: rank_of_item(:)
    integer, intent(in) :: n_rank
    !> Items of each rank; shape (0:n_rank - 1).
    integer, allocatable, intent(out) :: n_item(:)
    integer, allocatable, intent(out) :: item(:)

    integer, allocatable :: place(:)
    integer :: i, rank

    allocate (n_item(0:n_rank - 1), source=0)
    do i = 1, size(rank_of_item)
      n_item(rank_of_item(i)) = n_item(rank_of_item(i)) + 1
    end do
    allocate (place(0:n_rank - 1), item(size(rank_of_item)))
    place(0) = 0
    do rank = 1, n_rank - 1
      place(rank) = place(rank - 1) + n_item(rank - 1)
    end do
    do i = 1, size(rank_of_item)
      rank = rank_of_item(i)
      place(rank) = place(rank) + 1
      item(place(rank)) = i
    end do

  end subroutine sort_by_rank

  !> The nodes of each rank's cells, each once, in any order.
  pure subroutine collect_copies(whole, n_rank, plan)
    type(whole_mesh_t), intent(in) :: whole
    integer, intent(in) :: n_rank
    type(plan_t), intent(inout) :: plan

    integer, allocatable :: last_rank(:), node(:)
    integer :: cell, corner, i, n, pass, rank

    allocate (plan%n_node(0:n_rank - 1), last_rank(size(whole%node_tag)))
    ! The first pass counts, the second writes.
    do pass = 1, 2
      last_rank = -1
      n = 0
      cell = 0
      do rank = 0, n_rank - 1
        plan%n_node(rank) = n
        do i = 1, plan%n_cell(rank)
          cell = cell + 1
          do corner = 1, size(whole%cell_node, 1)
            associate (found => whole%cell_node(corner, plan%cell(cell)))
              if (last_rank(found) == rank) cycle
              last_rank(found) = rank
              n = n + 1
              if (pass == 2) node(n) = found
            end associate
          end do
        end do
        plan%n_node(rank) = n - plan%n_node(rank)
      end do
      if (pass == 1) allocate (node(n))
    end do
    call move_alloc(node, plan%node)

  end subroutine collect_copies

  !> Owner of each node: of the ranks that have it, the one that owns least so far.
  pure subroutine choose_owners(node, rank_of_copy, n_rank, n_node, owner)
    !> Node and rank of every copy; ranks count from 1 here.
    integer, intent(in) :: node(:), rank_of_copy(:)
    integer, intent(in) :: n_rank, n_node
    integer, allocatable, intent(out) :: owner(:)

    type(relation_t) :: ranks
    integer :: i, n_owned(0:n_rank - 1), place, rank

    call relation_from_pairs(n_node, n_rank, node, rank_of_copy, ranks)
    allocate (owner(n_node))
    n_owned = 0
    ! Nodes of one rank first: they leave no choice, and balance counts them.
    do i = 1, n_node
      if (ranks%first(i + 1) - ranks%first(i) > 1) cycle
      owner(i) = ranks%item(ranks%first(i)) - 1
      n_owned(owner(i)) = n_owned(owner(i)) + 1
    end do
    do i = 1, n_node
      if (ranks%first(i + 1) - ranks%first(i) == 1) cycle
      owner(i) = ranks%item(ranks%first(i)) - 1
      do place = ranks%first(i) + 1, ranks%first(i + 1) - 1
        rank = ranks%item(place) - 1
        if (n_owned(rank) < n_owned(owner(i))) owner(i) = rank
      end do
      n_owned(owner(i)) = n_owned(owner(i)) + 1
    end do

  end subroutine choose_owners

  !> Global numbers, contiguous by rank, in the order of the whole mesh within a rank.
  pure subroutine number_nodes(owner, n_rank, plan)
    integer, intent(in) :: owner(:)
    integer, intent(in) :: n_rank
    type(plan_t), intent(inout) :: plan

    integer, allocatable :: by_rank(:), n_owned(:)
    integer :: i, rank

    call sort_by_rank(owner, n_rank, n_owned, by_rank)
    allocate (plan%node_global(size(owner)), plan%node_offset(0:n_rank))
    do i = 1, size(owner)
      plan%node_global(by_rank(i)) = int(i, gp)
    end do
    plan%node_offset(0) = 0_gp
    do rank = 1, n_rank
      plan%node_offset(rank) = plan%node_offset(rank - 1) + int(n_owned(rank - 1), gp)
    end do

  end subroutine number_nodes

  !> Put each rank's nodes in local order, and number its cells' nodes accordingly.
  pure subroutine order_copies(whole, owner, n_rank, plan)
    type(whole_mesh_t), intent(in) :: whole
    integer, intent(in) :: owner(:)
    integer, intent(in) :: n_rank
    type(plan_t), intent(inout) :: plan

    integer(gp), allocatable :: key(:)
    integer, allocatable :: local(:)
    integer :: first, first_cell, i, n, rank

    n = size(whole%cell_node, 1)
    allocate (plan%cell_node(n * size(plan%cell)), local(size(owner)))
    first = 1
    first_cell = 1
    do rank = 0, n_rank - 1
      associate (node => plan%node(first:first + plan%n_node(rank) - 1))
        ! The global number sorts, and what others own comes behind everything.
        allocate (key(size(node)))
        key = plan%node_global(node)
        where (owner(node) /= rank) key = key + plan%node_offset(n_rank)
        node = node(sorting_order(key))
        deallocate (key)
        do i = 1, size(node)
          local(node(i)) = i
        end do
      end associate
      do i = first_cell, first_cell + plan%n_cell(rank) - 1
        plan%cell_node((i - 1) * n + 1:i * n) = local(whole%cell_node(:, plan%cell(i)))
      end do
      first = first + plan%n_node(rank)
      first_cell = first_cell + plan%n_cell(rank)
    end do

  end subroutine order_copies

  !> Facets go with their cells.
  pure subroutine plan_facets(whole, part, n_rank, plan)
    type(whole_mesh_t), intent(in) :: whole
    integer, intent(in) :: part(:)
    integer, intent(in) :: n_rank
    type(plan_t), intent(inout) :: plan

    integer, allocatable :: local(:)
    integer :: first, i, rank

    allocate (local(size(whole%facet_cell)))
    local = part(whole%facet_cell)
    call sort_by_rank(local, n_rank, plan%n_facet, plan%facet)
    deallocate (local)
    allocate (local(size(part)), plan%facet_cell(size(plan%facet)))
    first = 0
    do rank = 0, n_rank - 1
      do i = 1, plan%n_cell(rank)
        local(plan%cell(first + i)) = i
      end do
      first = first + plan%n_cell(rank)
    end do
    plan%facet_cell = local(whole%facet_cell(plan%facet))

  end subroutine plan_facets

  !> Collective. The list of groups, and what the reading found, for everyone.
  subroutine send_groups(whole, comm, mesh)
    type(whole_mesh_t), intent(in) :: whole
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(inout) :: mesh

    character(len=:), allocatable :: names
    integer, allocatable :: dimensions(:), tags(:)
    integer(gp), allocatable :: n_entity(:)
    integer :: i, n, width

    n = size(whole%groups)
    call comm%broadcast(n)
    allocate (mesh%groups(n), dimensions(n), tags(n), n_entity(n + 2))
    n_entity = 0_gp
    names = ''
    width = 0
    if (n > 0) width = len(mesh%groups(1)%name)
    if (comm%rank == 0) then
      dimensions = whole%groups%dimension
      tags = whole%groups%tag
      n_entity(:n) = whole%groups%n_entity_global
      n_entity(n + 1) = whole%report%n_reoriented
      n_entity(n + 2) = whole%report%n_dropped_node
      deallocate (names)
      allocate (character(len=n * width) :: names)
      do i = 1, n
        names((i - 1) * width + 1:i * width) = whole%groups(i)%name
      end do
    end if
    call comm%broadcast(dimensions)
    call comm%broadcast(tags)
    call comm%broadcast(names)
    call comm%sum(n_entity)
    do i = 1, n
      mesh%groups(i)%name = names((i - 1) * width + 1:i * width)
      mesh%groups(i)%dimension = dimensions(i)
      mesh%groups(i)%tag = tags(i)
      mesh%groups(i)%n_entity_global = n_entity(i)
    end do
    mesh%report%n_reoriented = n_entity(n + 1)
    mesh%report%n_dropped_node = n_entity(n + 2)

  end subroutine send_groups

  !> Collective. Cells.
  subroutine send_cells(whole, plan, comm, mesh)
    type(whole_mesh_t), intent(inout) :: whole
    type(plan_t), intent(inout) :: plan
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(inout) :: mesh

    integer, allocatable :: received(:)
    integer :: n_corner

    n_corner = mesh%dimension + 1
    ! Each array of the whole mesh goes as soon as it has been sent.
    deallocate (whole%cell_node)
    call scatter_integers(comm, plan%cell_node, n_corner * plan%n_cell, received)
    deallocate (plan%cell_node)
    mesh%n_cell = size(received) / n_corner
    allocate (mesh%cell_node(n_corner, mesh%n_cell))
    mesh%cell_node = reshape(received, [n_corner, mesh%n_cell])
    call scatter_longs(comm, whole%cell_tag, plan%n_cell, mesh%cell_tag, plan%cell)
    deallocate (whole%cell_tag)
    call scatter_integers(comm, whole%cell_group, plan%n_cell, mesh%cell_group, &
                          plan%cell)
    deallocate (whole%cell_group)
    mesh%n_cell_global = int(mesh%n_cell, gp)
    call comm%sum(mesh%n_cell_global)

  end subroutine send_cells

  !> Collective. Nodes.
  subroutine send_nodes(whole, plan, comm, mesh)
    type(whole_mesh_t), intent(inout) :: whole
    type(plan_t), intent(inout) :: plan
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(inout) :: mesh

    real(wp), allocatable :: received(:), sent(:)
    integer :: d, i

    d = mesh%dimension
    call scatter_longs(comm, plan%node_global, plan%n_node, mesh%node_global, plan%node)
    deallocate (plan%node_global)
    call scatter_longs(comm, whole%node_tag, plan%n_node, mesh%node_tag, plan%node)
    deallocate (whole%node_tag)
    allocate (sent(d * size(plan%node)))
    do i = 1, size(plan%node)
      sent((i - 1) * d + 1:i * d) = whole%coordinates(:, plan%node(i))
    end do
    deallocate (whole%coordinates)
    call scatter_reals(comm, sent, d * plan%n_node, received)
    deallocate (sent)
    mesh%n_node = size(mesh%node_tag)
    allocate (mesh%coordinates(d, mesh%n_node))
    mesh%coordinates = reshape(received, [d, mesh%n_node])

    allocate (mesh%node_offset(0:comm%size))
    mesh%node_offset = 0_gp
    if (comm%rank == 0) mesh%node_offset = plan%node_offset
    call comm%sum(mesh%node_offset)
    mesh%n_node_global = mesh%node_offset(comm%size)
    mesh%n_own_node = int(mesh%node_offset(comm%rank + 1) - mesh%node_offset(comm%rank))

  end subroutine send_nodes

  !> Collective. Boundary facets; their nodes follow from the cells.
  subroutine send_facets(whole, plan, comm, mesh)
    type(whole_mesh_t), intent(inout) :: whole
    type(plan_t), intent(in) :: plan
    type(comm_t), intent(in) :: comm
    type(mesh_t), intent(inout) :: mesh

    integer, allocatable :: opposite(:)
    integer :: facet

    call scatter_integers(comm, plan%facet_cell, plan%n_facet, mesh%facet_cell)
    call scatter_integers(comm, whole%facet_opposite, plan%n_facet, opposite, plan%facet)
    deallocate (whole%facet_cell, whole%facet_opposite)
    mesh%n_facet = size(opposite)
    allocate (mesh%facet_node(mesh%dimension, mesh%n_facet))
    do facet = 1, mesh%n_facet
      mesh%facet_node(:, facet) = mesh%cell_node( &
        face_corners(mesh%dimension, opposite(facet)), mesh%facet_cell(facet))
    end do

  end subroutine send_facets

  !> Collective. Which of each rank's things belong to each group.
  subroutine send_relation(group_of_thing, thing, n_thing, comm, n_group, thing_of_group)
    type(relation_t), intent(in) :: group_of_thing
    !> Things by rank, by their place in the whole mesh.
    integer, intent(in) :: thing(:)
    !> Things of each rank; shape (0:n_rank - 1).
    integer, contiguous, intent(in) :: n_thing(0:)
    type(comm_t), intent(in) :: comm
    integer, intent(in) :: n_group
    !> Local things of each group.
    type(relation_t), intent(out) :: thing_of_group

    type(relation_t) :: received
    integer, allocatable :: n_item(:), n_sent(:), sent(:), width(:)
    integer :: first, i, n, rank

    allocate (width(size(thing)), n_sent(0:comm%size - 1))
    width = group_of_thing%first(thing + 1) - group_of_thing%first(thing)
    allocate (sent(sum(width)))
    n = 0
    do i = 1, size(thing)
      first = group_of_thing%first(thing(i))
      sent(n + 1:n + width(i)) = group_of_thing%item(first:first + width(i) - 1)
      n = n + width(i)
    end do
    first = 0
    do rank = 0, comm%size - 1
      n_sent(rank) = sum(width(first + 1:first + n_thing(rank)))
      first = first + n_thing(rank)
    end do

    call scatter_integers(comm, width, n_thing, n_item)
    call scatter_integers(comm, sent, n_sent, received%item)
    allocate (received%first(size(n_item) + 1))
    received%first(1) = 1
    do i = 1, size(n_item)
      received%first(i + 1) = received%first(i) + n_item(i)
    end do
    call received%inverse(n_group, thing_of_group)

  end subroutine send_relation

  !> Collective. Give each rank its part of rank 0's list.
  subroutine scatter_integers(comm, values, n_sent, received, order)
    type(comm_t), intent(in) :: comm
    !> By rank, unless `order` is given; empty except on rank 0.
    integer, contiguous, intent(in) :: values(:)
    !> Items for each rank; shape (0:n_rank - 1); zero except on rank 0.
    integer, contiguous, intent(in) :: n_sent(0:)
    integer, allocatable, intent(out) :: received(:)
    !> Places in `values`, by rank.
    integer, contiguous, intent(in), optional :: order(:)

    integer, allocatable :: sent(:)
    integer :: n_received(0:comm%size - 1)

    call comm%exchange(n_sent, n_received)
    allocate (received(sum(n_received)))
    if (present(order)) then
      allocate (sent(size(order)))
      sent = values(order)
      call comm%exchange(sent, n_sent, received, n_received)
    else
      call comm%exchange(values, n_sent, received, n_received)
    end if

  end subroutine scatter_integers

  !> Collective. The same for long integers.
  subroutine scatter_longs(comm, values, n_sent, received, order)
    type(comm_t), intent(in) :: comm
    !> By rank, unless `order` is given; empty except on rank 0.
    integer(gp), contiguous, intent(in) :: values(:)
    !> Items for each rank; shape (0:n_rank - 1); zero except on rank 0.
    integer, contiguous, intent(in) :: n_sent(0:)
    integer(gp), allocatable, intent(out) :: received(:)
    !> Places in `values`, by rank.
    integer, contiguous, intent(in), optional :: order(:)

    integer(gp), allocatable :: sent(:)
    integer :: n_received(0:comm%size - 1)

    call comm%exchange(n_sent, n_received)
    allocate (received(sum(n_received)))
    if (present(order)) then
      allocate (sent(size(order)))
      sent = values(order)
      call comm%exchange(sent, n_sent, received, n_received)
    else
      call comm%exchange(values, n_sent, received, n_received)
    end if

  end subroutine scatter_longs

  !> Collective. The same for real numbers.
  subroutine scatter_reals(comm, sent, n_sent, received)
    type(comm_t), intent(in) :: comm
    real(wp), contiguous, intent(in) :: sent(:)
    integer, contiguous, intent(in) :: n_sent(0:)
    real(wp), allocatable, intent(out) :: received(:)

    integer :: n_received(0:comm%size - 1)

    call comm%exchange(n_sent, n_received)
    allocate (received(sum(n_received)))
    call comm%exchange(sent, n_sent, received, n_received)

  end subroutine scatter_reals

end module swage_mesh_distribution
