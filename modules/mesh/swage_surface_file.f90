!> Surfaces in files: STL, or the lines or triangles of a Gmsh mesh.
module swage_surface_file
  use swage_comm, only: comm_t
  use swage_gmsh_reader, only: read_gmsh
  use swage_kinds, only: wp
  use swage_mesh_source, only: mesh_source_t
  use swage_rotation, only: cross_product
  use swage_spelling, only: did_you_mean, listed
  use swage_status, only: status_t, EXIT_MESH, STATUS_ERROR
  use swage_stl_reader, only: read_stl
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: surface_file_read

contains

  !> Collective. Rank 0 reads the file, all ranks receive its facets.
  subroutine surface_file_read(path, n_corner, group, comm, corners, label, status)
    !> Ends with `.stl`, or is a mesh of Gmsh.
    character(len=*), intent(in) :: path
    !> 3: triangles; 2: lines in the plane z = 0.
    integer, intent(in) :: n_corner
    !> Physical group of a mesh; empty: all of its triangles or lines.
    character(len=*), intent(in) :: group
    type(comm_t), intent(in) :: comm
    !> [length]; shape (3, n_corner, n_facet).
    real(wp), allocatable, intent(out) :: corners(:, :, :)
    !> Number of each facet in the file.
    integer, allocatable, intent(out) :: label(:)
    !> `STATUS_ERROR`, the same on all ranks, with path and facet, when the file cannot be read or
    !> holds no such facet.
    type(status_t), intent(inout) :: status

    integer :: n_facet
    real(wp), allocatable :: values(:)

    allocate (corners(3, n_corner, 0), label(0))
    if (comm%rank == 0) then
      if (is_stl(path)) then
        call read_stl_facets(path, n_corner, group, corners, label, status)
      else
        call read_mesh_facets(path, n_corner, group, corners, label, status)
      end if
      if (.not. status%failed() .and. size(label) == 0) then
        call status%raise(STATUS_ERROR, 'surface_file_read', path//': holds no '// &
                          kind_of(n_corner), EXIT_MESH)
      end if
    end if
    call comm%agree(status)
    if (status%failed()) return

    n_facet = size(label)
    call comm%broadcast(n_facet)
    if (comm%rank /= 0) then
      deallocate (corners, label)
      allocate (corners(3, n_corner, n_facet), label(n_facet))
    end if
    allocate (values, source=reshape(corners, [size(corners)]))
    call comm%broadcast(values)
    call comm%broadcast(label)
    corners = reshape(values, [3, n_corner, n_facet])

  end subroutine surface_file_read

  !> What facets are called in messages.
  pure function kind_of(n_corner) result(words)
    integer, intent(in) :: n_corner
    character(len=:), allocatable :: words

    words = 'triangle'
    if (n_corner == 2) words = 'line'

  end function kind_of

  !> By the end of the name.
  pure function is_stl(path)
    character(len=*), intent(in) :: path
    logical :: is_stl

    integer :: n

    n = len_trim(path)
    is_stl = .false.
    if (n >= 4) is_stl = path(n - 3:n) == '.stl' .or. path(n - 3:n) == '.STL'

  end function is_stl

  !> The normals of an STL must agree with the order of the corners.
  subroutine read_stl_facets(path, n_corner, group, corners, label, status)
    character(len=*), intent(in) :: path
    integer, intent(in) :: n_corner
    character(len=*), intent(in) :: group
    real(wp), allocatable, intent(inout) :: corners(:, :, :)
    integer, allocatable, intent(inout) :: label(:)
    type(status_t), intent(inout) :: status

    integer :: i
    real(wp) :: normal(3)
    real(wp), allocatable :: normals(:, :)

    if (n_corner /= 3) then
      call status%raise(STATUS_ERROR, 'surface_file_read', path//': an STL file holds '// &
                        'triangles; a plane problem needs a Gmsh mesh of lines', EXIT_MESH)
      return
    end if
    if (group /= '') then
      call status%raise(STATUS_ERROR, 'surface_file_read', path//': an STL file has no '// &
                        'physical groups', EXIT_MESH)
      return
    end if
    call read_stl(path, corners, normals, status)
    if (status%failed()) return
    label = [(i, i=1, size(normals, 2))]
    do i = 1, size(label)
      normal = cross_product(corners(:, 2, i) - corners(:, 1, i), &
                             corners(:, 3, i) - corners(:, 1, i))
      if (dot_product(normal, normals(:, i)) >= &
          -0.5_wp * norm2(normal) * norm2(normals(:, i))) cycle
      call status%raise(STATUS_ERROR, 'surface_file_read', path//': facet '//text(i)// &
                        ': its normal contradicts the order of its corners, counterclockwise '// &
                        'from outside', EXIT_MESH)
      return
    end do

  end subroutine read_stl_facets

  subroutine read_mesh_facets(path, n_corner, group, corners, label, status)
    character(len=*), intent(in) :: path
    integer, intent(in) :: n_corner
    character(len=*), intent(in) :: group
    real(wp), allocatable, intent(inout) :: corners(:, :, :)
    integer, allocatable, intent(inout) :: label(:)
    type(status_t), intent(inout) :: status

    integer :: i, k, n, place
    logical, allocatable :: chosen(:)
    type(mesh_source_t) :: source

    call read_gmsh(path, source, status)
    if (status%failed()) return
    place = 0
    if (group /= '') then
      call find_group(path, n_corner, group, source, place, status)
      if (status%failed()) return
    end if
    associate (elements => source%elements(n_corner - 1))
      allocate (chosen(elements%n), source=.true.)
      if (place > 0) then
        do i = 1, elements%n
          chosen(i) = any(source%groups_in(elements%set(i)) == place)
        end do
      end if
      n = count(chosen)
      deallocate (corners, label)
      allocate (corners(3, n_corner, n), label(n))
      n = 0
      do i = 1, elements%n
        if (.not. chosen(i)) cycle
        n = n + 1
        label(n) = int(elements%tag(i))
        do k = 1, n_corner
          corners(:, k, n) = source%coordinates(:, elements%node(k, i))
        end do
        if (n_corner == 3) cycle
        if (maxval(abs(corners(3, :, n))) <= 1.0e-10_wp * maxval(abs(source%coordinates))) cycle
        call status%raise(STATUS_ERROR, 'surface_file_read', path//': line '//text(label(n))// &
                          ' is not in the plane z = 0', EXIT_MESH)
        return
      end do
    end associate

  end subroutine read_mesh_facets

  !> Place of a physical group of the right dimension.
  subroutine find_group(path, n_corner, group, source, place, status)
    character(len=*), intent(in) :: path
    integer, intent(in) :: n_corner
    character(len=*), intent(in) :: group
    type(mesh_source_t), intent(in) :: source
    integer, intent(out) :: place
    type(status_t), intent(inout) :: status

    character(len=64), allocatable :: names(:)
    integer :: i

    allocate (names(0))
    do i = 1, source%n_group
      if (source%groups(i)%dimension /= n_corner - 1) cycle
      names = [character(len=64) :: names, source%groups(i)%name]
      if (source%groups(i)%name /= group) cycle
      place = i
      return
    end do
    place = 0
    if (size(names) == 0) then
      call status%raise(STATUS_ERROR, 'surface_file_read', path//': has no physical group of '// &
                        kind_of(n_corner)//'s', EXIT_MESH)
      return
    end if
    call status%raise(STATUS_ERROR, 'surface_file_read', path//': has no physical group '''// &
                      group//''' of '//kind_of(n_corner)//'s'//did_you_mean(group, names)// &
                      ' Groups: '//listed(names, ', ', ''''), EXIT_MESH)

  end subroutine find_group

end module swage_surface_file
