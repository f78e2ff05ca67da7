!> Reader of Gmsh's text files, formats 2.2 and 4.1.
!>
!> Source: Gmsh reference manual, chapter "Gmsh file formats".
module swage_gmsh_reader
  use swage_kinds, only: gp, wp
  use swage_line_reader, only: line_reader_t
  use swage_mesh, only: GROUP_NAME_LENGTH
  use swage_mesh_source, only: EMPTY_SET, mesh_source_create, mesh_source_t
  use swage_sort, only: find_sorted, sorting_order
  use swage_status, only: status_t, EXIT_MESH
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: read_gmsh

  !> Formats that are understood.
  integer, parameter :: FORMAT_UNKNOWN = 0, FORMAT_2 = 2, FORMAT_4 = 4

  !> Places of numbers that need not be contiguous: by a table where they are nearly so, by
  !> bisection otherwise.
  type :: tag_finder_t
    integer(gp) :: lowest = 1_gp
    !> Place of `lowest + i - 1`, 0 none.
    integer, allocatable :: table(:)
    !> Ascending, with the place of each.
    integer(gp), allocatable :: sorted(:)
    integer, allocatable :: place(:)
  contains
    procedure :: find => tag_finder_find
  end type tag_finder_t

  !> Sets of groups of the geometric entities of one dimension, in the order of the file.
  type :: entity_list_t
    integer, allocatable :: set(:)
    type(tag_finder_t) :: finder
  end type entity_list_t

  !> State of reading one file.
  type :: gmsh_reading_t
    type(line_reader_t) :: reader
    integer :: format = FORMAT_UNKNOWN
    logical :: has_nodes = .false.
    logical :: has_elements = .false.
    type(tag_finder_t) :: nodes
    type(entity_list_t) :: entities(0:3)
  end type gmsh_reading_t

contains

  !> Read a mesh of points, lines, triangles and tetrahedra with its physical groups.
  !>
  !> Not collective: rank 0 calls it.
  subroutine read_gmsh(path, source, status)
    character(len=*), intent(in) :: path
    type(mesh_source_t), intent(out) :: source
    !> `STATUS_ERROR` with `EXIT_MESH`, file and line, when the file is missing, damaged, binary,
    !> of another version, or has elements of another kind.
    type(status_t), intent(inout) :: status

    type(gmsh_reading_t) :: reading
    logical :: found

    call mesh_source_create(path, source)
    call reading%reader%open(path, EXIT_MESH, status)
    do
      call reading%reader%next(found, status)
      if (status%failed() .or. .not. found) exit
      if (reading%reader%line() == '') cycle
      call read_section(reading, source, status)
      if (status%failed()) exit
    end do
    if (reading%format == FORMAT_UNKNOWN) then
      call reading%reader%fail('this is not a Gmsh mesh: it has no section $MeshFormat', status)
    end if
    if (.not. reading%has_nodes) then
      call reading%reader%fail('the file has no section $Nodes', status)
    end if
    if (.not. reading%has_elements) then
      call reading%reader%fail('the file has no section $Elements', status)
    end if
    call reading%reader%close()

  end subroutine read_gmsh

  !> Read the section whose first line is the current one, up to its last line.
  subroutine read_section(reading, source, status)
    type(gmsh_reading_t), intent(inout) :: reading
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: section

    section = reading%reader%line()
    if (section(1:1) /= '$') then
      call reading%reader%fail('the first line of a Gmsh section ($...) is expected; Gmsh '// &
                               'makes meshes of geometries (.geo): gmsh -2 or -3, or tools/mesh', &
                               status)
      return
    end if
    if (reading%format == FORMAT_UNKNOWN .and. section /= '$MeshFormat' &
        .and. section /= '$Comments') then
      call reading%reader%fail('section ' // section // ' before $MeshFormat', status)
      return
    end if

    select case (section)
    case ('$MeshFormat')
      call read_format(reading, status)
    case ('$PhysicalNames')
      call read_names(reading%reader, source, status)
    case ('$Entities')
      if (reading%format == FORMAT_4) call read_entities(reading, source, status)
    case ('$PartitionedEntities')
      call reading%reader%fail('the mesh is partitioned: save it whole, Swage divides it itself', &
                               status)
    case ('$Nodes')
      if (reading%has_nodes) call reading%reader%fail('a second section $Nodes', status)
      call read_nodes(reading, source, status)
    case ('$Elements')
      if (reading%has_elements) call reading%reader%fail('a second section $Elements', status)
      call read_elements(reading, source, status)
    case default
      ! Other sections, as $Periodic, say nothing that is needed.
    end select
    call skip_to_end(reading%reader, '$End' // section(2:), section, status)

  end subroutine read_section

  !> Go to the last line of a section. Sections that Swage needs must end where their counts say.
  subroutine skip_to_end(reader, last_line, section, status)
    type(line_reader_t), intent(inout) :: reader
    character(len=*), intent(in) :: last_line
    character(len=*), intent(in) :: section
    type(status_t), intent(inout) :: status

    logical :: counted

    counted = section == '$PhysicalNames' .or. section == '$Nodes' .or. section == '$Elements'
    do
      call reader%advance(status)
      if (status%failed()) return
      if (reader%line() == last_line) return
      if (counted .and. reader%line() /= '') then
        call reader%fail(last_line // ' is expected here: the counts of the section ' &
                         // 'do not fit its content', status)
        return
      end if
    end do

  end subroutine skip_to_end

  !> Version and kind of the file.
  subroutine read_format(reading, status)
    type(gmsh_reading_t), intent(inout) :: reading
    type(status_t), intent(inout) :: status

    character(len=*), parameter :: REMEDY = &
      ': save it with Mesh.MshFileVersion = 4.1 and Mesh.Binary = 0'
    character(len=:), allocatable :: line
    integer(gp) :: kind_of_file
    real(wp) :: version

    call reading%reader%advance(status)
    if (status%failed()) return
    line = reading%reader%line()
    call reading%reader%take_real(version, status)
    call reading%reader%take_integer(kind_of_file, status)
    if (status%failed()) return
    if (nint(10.0_wp * version) == 22) then
      reading%format = FORMAT_2
    else if (nint(10.0_wp * version) == 41) then
      reading%format = FORMAT_4
    else
      call reading%reader%fail('format ' // line(:index(line // ' ', ' ') - 1) // &
                               ' is not understood, 2.2 and 4.1 are' // REMEDY, status)
    end if
    if (kind_of_file /= 0_gp) then
      call reading%reader%fail('the file is binary, a text file is expected' // REMEDY, status)
    end if

  end subroutine read_format

  !> Names of physical groups.
  subroutine read_names(reader, source, status)
    type(line_reader_t), intent(inout) :: reader
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: name
    integer(gp) :: dimension, i, n, tag
    integer :: place

    call take_count(reader, n, status)
    do i = 1, n
      call reader%advance(status)
      call reader%take_integer(dimension, status)
      call reader%take_integer(tag, status)
      call reader%take_quoted(name, status)
      if (status%failed()) return
      if (dimension < 0_gp .or. dimension > 3_gp) then
        call reader%fail('the dimension of a physical group is 0 to 3', status)
      else if (abs(tag) > huge(1)) then
        call reader%fail('the number of a physical group is too large', status)
      else if (len(name) > GROUP_NAME_LENGTH) then
        call reader%fail('the name of a physical group has at most ' // &
                         text(GROUP_NAME_LENGTH) // ' characters', status)
      end if
      if (status%failed()) return
      call source%need_group(int(dimension), int(abs(tag)), place)
      if (source%groups(place)%name /= '' .and. source%groups(place)%name /= name) then
        call reader%fail('physical group ' // text(int(tag)) // ' has two names', status)
        return
      end if
      source%groups(place)%name = name
    end do

  end subroutine read_names

  !> The physical groups of each geometric entity (format 4.1).
  subroutine read_entities(reading, source, status)
    type(gmsh_reading_t), intent(inout) :: reading
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    integer(gp), allocatable :: tags(:)
    integer(gp) :: n(0:3), n_group, tag
    integer, allocatable :: groups(:)
    integer :: d, i, j
    real(wp) :: skipped

    call reading%reader%advance(status)
    do d = 0, 3
      call reading%reader%take_integer(n(d), status)
    end do
    if (status%failed()) return
    do d = 0, 3
      if (n(d) < 0_gp .or. n(d) > huge(1)) call reading%reader%fail('a bad count', status)
      if (status%failed()) return
      if (allocated(tags)) deallocate (tags)
      allocate (tags(n(d)))
      if (allocated(reading%entities(d)%set)) deallocate (reading%entities(d)%set)
      allocate (reading%entities(d)%set(n(d)))
      do i = 1, int(n(d))
        call reading%reader%advance(status)
        call reading%reader%take_integer(tags(i), status)
        ! A point has one position, other entities the two corners of a box.
        do j = 1, merge(3, 6, d == 0)
          call reading%reader%take_real(skipped, status)
        end do
        call reading%reader%take_integer(n_group, status)
        if (status%failed()) return
        if (n_group < 0_gp .or. n_group > huge(1)) then
          call reading%reader%fail('a bad count of physical groups', status)
          return
        end if
        if (allocated(groups)) deallocate (groups)
        allocate (groups(n_group))
        do j = 1, int(n_group)
          call reading%reader%take_integer(tag, status)
          if (abs(tag) > huge(1)) then
            call reading%reader%fail('the number of a physical group is too large', status)
          end if
          if (status%failed()) return
          ! A negative number turns the entity around, which does not matter here.
          call source%need_group(d, int(abs(tag)), groups(j))
        end do
        call source%add_set(groups, reading%entities(d)%set(i))
      end do
      call tag_finder_create(tags, reading%entities(d)%finder)
    end do

  end subroutine read_entities

  !> Numbers and positions of the nodes.
  subroutine read_nodes(reading, source, status)
    type(gmsh_reading_t), intent(inout) :: reading
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    integer(gp) :: n_block, n_node
    integer :: twice

    call reading%reader%advance(status)
    n_block = 0_gp
    if (reading%format == FORMAT_4) call reading%reader%take_integer(n_block, status)
    call reading%reader%take_integer(n_node, status)
    if (status%failed()) return
    if (n_node < 1_gp .or. n_node > huge(1)) then
      call reading%reader%fail('the mesh has no nodes, or too many', status)
      return
    end if
    source%n_node = int(n_node)
    deallocate (source%coordinates, source%node_tag)
    allocate (source%coordinates(3, source%n_node), source%node_tag(source%n_node))
    if (reading%format == FORMAT_4) then
      call read_node_blocks(reading%reader, n_block, source, status)
    else
      call read_node_lines(reading%reader, source, status)
    end if
    if (status%failed()) return
    call tag_finder_create(source%node_tag, reading%nodes, twice)
    if (twice > 0) then
      call reading%reader%fail('node ' // long_text(source%node_tag(twice)) // ' occurs twice', &
                               status)
      return
    end if
    reading%has_nodes = .true.

  end subroutine read_nodes

  !> Format 2.2: number and position on each line.
  subroutine read_node_lines(reader, source, status)
    type(line_reader_t), intent(inout) :: reader
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    integer :: i, j

    do i = 1, source%n_node
      call reader%advance(status)
      call reader%take_integer(source%node_tag(i), status)
      do j = 1, 3
        call reader%take_real(source%coordinates(j, i), status)
      end do
      if (status%failed()) return
    end do

  end subroutine read_node_lines

  !> Format 4.1: blocks of numbers, then of positions.
  subroutine read_node_blocks(reader, n_block, source, status)
    type(line_reader_t), intent(inout) :: reader
    integer(gp), intent(in) :: n_block
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    integer(gp) :: block_number, n, skipped
    integer :: first, i, j

    first = 1
    do block_number = 1, n_block
      call reader%advance(status)
      do j = 1, 3
        call reader%take_integer(skipped, status)
      end do
      call reader%take_integer(n, status)
      if (status%failed()) return
      if (n < 0_gp .or. n > source%n_node - first + 1) then
        call reader%fail('the blocks have more nodes than the section announces', status)
        return
      end if
      do i = first, first + int(n) - 1
        call reader%advance(status)
        call reader%take_integer(source%node_tag(i), status)
        if (status%failed()) return
      end do
      do i = first, first + int(n) - 1
        call reader%advance(status)
        do j = 1, 3
          call reader%take_real(source%coordinates(j, i), status)
        end do
        if (status%failed()) return
      end do
      first = first + int(n)
    end do
    if (first <= source%n_node) then
      call reader%fail('the blocks have fewer nodes than the section announces', status)
    end if

  end subroutine read_node_blocks

  !> All elements.
  subroutine read_elements(reading, source, status)
    type(gmsh_reading_t), intent(inout) :: reading
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    integer(gp) :: n_block, n_element

    if (.not. reading%has_nodes) then
      call reading%reader%fail('section $Elements before $Nodes', status)
      return
    end if
    call reading%reader%advance(status)
    n_block = 0_gp
    if (reading%format == FORMAT_4) call reading%reader%take_integer(n_block, status)
    call reading%reader%take_integer(n_element, status)
    if (status%failed()) return
    if (n_element < 1_gp .or. n_element > huge(1)) then
      call reading%reader%fail('the mesh has no elements, or too many', status)
      return
    end if
    if (reading%format == FORMAT_4) then
      call read_element_blocks(reading, n_block, n_element, source, status)
    else
      call read_element_lines(reading, n_element, source, status)
    end if
    reading%has_elements = .true.

  end subroutine read_elements

  !> Format 2.2: number, kind, number of tags, tags (the first is the physical group), nodes.
  subroutine read_element_lines(reading, n_element, source, status)
    type(gmsh_reading_t), intent(inout) :: reading
    integer(gp), intent(in) :: n_element
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    integer, allocatable :: set_of_group(:)
    integer(gp) :: element, group, kind_of_element, n_tag, skipped, tag
    integer :: d, i, nodes(4), place, set
    integer :: last_group(0:3), last_set(0:3)

    allocate (set_of_group(0))
    last_group = 0
    last_set = EMPTY_SET
    do element = 1, n_element
      call reading%reader%advance(status)
      call reading%reader%take_integer(tag, status)
      call reading%reader%take_integer(kind_of_element, status)
      call reading%reader%take_integer(n_tag, status)
      if (status%failed()) return
      call find_dimension(reading%reader, kind_of_element, tag, d, status)
      group = 0_gp
      if (n_tag > 0_gp) call reading%reader%take_integer(group, status)
      if (abs(group) > huge(1)) then
        call reading%reader%fail('the number of a physical group is too large', status)
      end if
      do i = 2, int(min(n_tag, 64_gp))
        call reading%reader%take_integer(skipped, status)
      end do
      if (status%failed()) return
      call take_nodes(reading, tag, nodes(:d + 1), status)
      if (status%failed()) return

      ! Elements of one group usually follow each other.
      if (group == 0_gp) then
        set = EMPTY_SET
      else if (abs(group) == last_group(d)) then
        set = last_set(d)
      else
        call source%need_group(d, int(abs(group)), place)
        if (place > size(set_of_group)) call lengthen(set_of_group, 2 * place)
        if (set_of_group(place) == 0) call source%add_set([place], set_of_group(place))
        set = set_of_group(place)
        last_group(d) = int(abs(group))
        last_set(d) = set
      end if
      call source%elements(d)%append(nodes(:d + 1), tag, set)
    end do

  end subroutine read_element_lines

  !> Format 4.1: blocks of elements of one kind on one geometric entity.
  subroutine read_element_blocks(reading, n_block, n_element, source, status)
    type(gmsh_reading_t), intent(inout) :: reading
    integer(gp), intent(in) :: n_block
    integer(gp), intent(in) :: n_element
    type(mesh_source_t), intent(inout) :: source
    type(status_t), intent(inout) :: status

    integer(gp) :: block_number, entity, entity_dimension, i, kind_of_element, n, n_read, tag
    integer :: d, nodes(4), place, set

    n_read = 0_gp
    do block_number = 1, n_block
      call reading%reader%advance(status)
      call reading%reader%take_integer(entity_dimension, status)
      call reading%reader%take_integer(entity, status)
      call reading%reader%take_integer(kind_of_element, status)
      call reading%reader%take_integer(n, status)
      if (status%failed()) return
      if (n < 0_gp .or. n > n_element - n_read) then
        call reading%reader%fail('the blocks have more elements than the section announces', &
                                 status)
        return
      end if
      n_read = n_read + n
      d = 0
      if (n == 0_gp) cycle
      do i = 1, n
        call reading%reader%advance(status)
        call reading%reader%take_integer(tag, status)
        if (status%failed()) return
        if (i == 1_gp) then
          call find_dimension(reading%reader, kind_of_element, tag, d, status)
          if (status%failed()) return
          set = EMPTY_SET
          if (allocated(reading%entities(d)%set) .and. entity_dimension == d) then
            place = reading%entities(d)%finder%find(entity)
            if (place > 0) set = reading%entities(d)%set(place)
          end if
          call source%elements(d)%reserve(source%elements(d)%n + int(n))
        end if
        call take_nodes(reading, tag, nodes(:d + 1), status)
        if (status%failed()) return
        call source%elements(d)%append(nodes(:d + 1), tag, set)
      end do
    end do
    if (n_read < n_element) call reading%reader%fail( &
      'the blocks have fewer elements than the section announces', status)

  end subroutine read_element_blocks

  !> Dimension of a kind of element, which must be one that Swage has.
  subroutine find_dimension(reader, kind_of_element, tag, dimension, status)
    type(line_reader_t), intent(in) :: reader
    !> Gmsh's number of the kind.
    integer(gp), intent(in) :: kind_of_element
    integer(gp), intent(in) :: tag
    integer, intent(out) :: dimension
    type(status_t), intent(inout) :: status

    character(len=*), parameter :: NO_RECOMBINE = 'mesh without Recombine'
    character(len=*), parameter :: FIRST_ORDER = 'mesh with Mesh.ElementOrder = 1'
    character(len=:), allocatable :: name, remedy

    dimension = 0
    select case (kind_of_element)
    case (15_gp)
      return
    case (1_gp, 2_gp)
      dimension = int(kind_of_element)
      return
    case (4_gp)
      dimension = 3
      return
    case (3_gp)
      name = 'a quadrangle'
      remedy = NO_RECOMBINE
    case (5_gp)
      name = 'a hexahedron'
      remedy = NO_RECOMBINE
    case (6_gp)
      name = 'a prism'
      remedy = NO_RECOMBINE
    case (7_gp)
      name = 'a pyramid'
      remedy = NO_RECOMBINE
    case (8_gp)
      name = 'a line of second order'
      remedy = FIRST_ORDER
    case (9_gp)
      name = 'a triangle of second order'
      remedy = FIRST_ORDER
    case (11_gp)
      name = 'a tetrahedron of second order'
      remedy = FIRST_ORDER
    case (10_gp, 12_gp, 13_gp, 14_gp, 16_gp, 17_gp, 18_gp, 19_gp)
      name = 'a quadrangle, hexahedron, prism or pyramid of second order (kind ' // &
        text(int(kind_of_element)) // ')'
      remedy = FIRST_ORDER // ' and without Recombine'
    case default
      name = 'of kind ' // long_text(kind_of_element)
      remedy = FIRST_ORDER // ' and without Recombine'
    end select
    call reader%fail('element ' // long_text(tag) // ' is ' // name // &
                     '; points, lines, triangles and tetrahedra are expected: ' // remedy, status)

  end subroutine find_dimension

  !> Read the nodes of an element and find their places.
  subroutine take_nodes(reading, tag, nodes, status)
    type(gmsh_reading_t), intent(inout) :: reading
    integer(gp), intent(in) :: tag
    integer, intent(out) :: nodes(:)
    type(status_t), intent(inout) :: status

    integer(gp) :: node
    integer :: i

    nodes = 0
    do i = 1, size(nodes)
      call reading%reader%take_integer(node, status)
      if (status%failed()) return
      nodes(i) = reading%nodes%find(node)
      if (nodes(i) == 0) then
        call reading%reader%fail('element ' // long_text(tag) // ' has node ' // &
                                 long_text(node) // ', which the file does not have: mesh ' // &
                                 'again', status)
        return
      end if
    end do

  end subroutine take_nodes

  !> Go to the next line and read a count that is not negative.
  subroutine take_count(reader, n, status)
    type(line_reader_t), intent(inout) :: reader
    integer(gp), intent(out) :: n
    type(status_t), intent(inout) :: status

    call reader%advance(status)
    call reader%take_integer(n, status)
    if (n < 0_gp) call reader%fail('a count must not be negative', status)
    if (status%failed()) n = 0_gp

  end subroutine take_count

  !> Prepare to find the places of numbers.
  subroutine tag_finder_create(tags, finder, twice)
    integer(gp), intent(in) :: tags(:)
    type(tag_finder_t), intent(out) :: finder
    !> Place of a number that occurs twice, 0 none.
    integer, intent(out), optional :: twice

    integer :: i, repeated

    repeated = 0
    if (size(tags) > 0) then
      if (maxval(tags) - minval(tags) < 8_gp * size(tags, kind=gp) + 1000_gp) then
        finder%lowest = minval(tags)
        allocate (finder%table(maxval(tags) - finder%lowest + 1_gp), source=0)
        do i = 1, size(tags)
          if (finder%table(tags(i) - finder%lowest + 1_gp) /= 0) repeated = i
          finder%table(tags(i) - finder%lowest + 1_gp) = i
        end do
      end if
    end if
    if (.not. allocated(finder%table)) then
      allocate (finder%place(size(tags)), finder%sorted(size(tags)))
      finder%place = sorting_order(tags)
      finder%sorted = tags(finder%place)
      do i = 2, size(tags)
        if (finder%sorted(i) == finder%sorted(i - 1)) repeated = finder%place(i)
      end do
    end if
    if (present(twice)) twice = repeated

  end subroutine tag_finder_create

  !> Place of a number, 0 when it is not there.
  pure function tag_finder_find(self, tag) result(place)
    class(tag_finder_t), intent(in) :: self
    integer(gp), intent(in) :: tag
    integer :: place

    place = 0
    if (allocated(self%table)) then
      if (tag >= self%lowest .and. tag - self%lowest < size(self%table, kind=gp)) then
        place = self%table(tag - self%lowest + 1_gp)
      end if
    else if (allocated(self%sorted)) then
      place = find_sorted(self%sorted, tag)
      if (place > 0) place = self%place(place)
    end if

  end function tag_finder_find

  !> Make a list longer, with zeros.
  pure subroutine lengthen(list, n)
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(in) :: n

    integer, allocatable :: longer(:)

    allocate (longer(n), source=0)
    longer(:size(list)) = list
    call move_alloc(longer, list)

  end subroutine lengthen

  !> A long integer as text.
  pure function long_text(value) result(string)
    integer(gp), intent(in) :: value
    character(len=:), allocatable :: string

    character(len=24) :: buffer

    write (buffer, '(i0)') value
    string = trim(buffer)

  end function long_text

end module swage_gmsh_reader
