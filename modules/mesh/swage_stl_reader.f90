!> Reader of STL files, text and binary: triangles, each with the positions of its own corners.
!>
!> Source: 3D Systems, StereoLithography Interface Specification (1989). The number of units that a
!> length of 1 stands for is not in the file.
module swage_stl_reader
  use, intrinsic :: iso_fortran_env, only: int32, int64, real32
  use swage_kinds, only: wp
  use swage_line_reader, only: line_reader_t
  use swage_path, only: describe_unreadable
  use swage_status, only: status_t, EXIT_MESH, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: read_stl

  !> Bytes of a binary file: head with the number of facets, and each facet.
  integer(int64), parameter :: HEAD_LENGTH = 84_int64, FACET_LENGTH = 50_int64

contains

  !> Read all facets. Not collective: rank 0 calls it.
  subroutine read_stl(path, corners, normals, status)
    character(len=*), intent(in) :: path
    !> Corners of the facets [length]; shape (3, 3, n_facet).
    real(wp), allocatable, intent(out) :: corners(:, :, :)
    !> As the file gives them, perhaps 0; shape (3, n_facet).
    real(wp), allocatable, intent(out) :: normals(:, :)
    !> `STATUS_ERROR` with file, and line or facet, when the file is missing, damaged or no STL.
    type(status_t), intent(inout) :: status

    character(len=HEAD_LENGTH) :: head
    character(len=256) :: reason
    integer :: code, unit
    integer(int32) :: n_facet
    integer(int64) :: length

    allocate (corners(3, 3, 0), normals(3, 0))
    open (newunit=unit, file=path, action='read', status='old', form='unformatted', &
          access='stream', iostat=code, iomsg=reason)
    if (code /= 0) then
      call status%raise(STATUS_ERROR, 'read_stl', path//': cannot be opened: '// &
                        describe_unreadable(path, reason), EXIT_MESH)
      return
    end if
    inquire (unit=unit, size=length)
    head = ''
    if (length > 0) read (unit, iostat=code, iomsg=reason) head(:min(length, HEAD_LENGTH))
    if (code /= 0) then
      close (unit)
      call status%raise(STATUS_ERROR, 'read_stl', path//': '// &
                        describe_unreadable(path, reason), EXIT_MESH)
      return
    end if

    ! A binary head may begin with any word: the length tells
    n_facet = word_of(head(HEAD_LENGTH - 3:))
    if (n_facet >= 0 .and. length == HEAD_LENGTH + FACET_LENGTH * int(n_facet, int64)) then
      call read_binary(unit, path, int(n_facet), corners, normals, status)
      close (unit)
      return
    end if
    close (unit)
    if ((head(:5) == 'solid' .or. head(:5) == 'SOLID') .and. index(head, achar(0)) == 0) then
      call read_text(path, corners, normals, status)
    else
      call status%raise(STATUS_ERROR, 'read_stl', path//': this is no STL file, or a damaged '// &
                        'one: a text begins with solid, a binary file has 84 bytes and 50 more '// &
                        'for each of the facets that it announces', EXIT_MESH)
    end if

  end subroutine read_stl

  !> Four bytes, the lowest first, whatever the order of this machine.
  pure function word_of(bytes) result(word)
    character(len=4), intent(in) :: bytes
    integer(int32) :: word

    integer :: i

    word = 0_int32
    do i = 4, 1, -1
      word = ior(ishft(word, 8), int(iachar(bytes(i:i)), int32))
    end do

  end function word_of

  subroutine read_binary(unit, path, n_facet, corners, normals, status)
    integer, intent(in) :: unit
    character(len=*), intent(in) :: path
    integer, intent(in) :: n_facet
    real(wp), allocatable, intent(inout) :: corners(:, :, :)
    real(wp), allocatable, intent(inout) :: normals(:, :)
    type(status_t), intent(inout) :: status

    !> All bits of the exponent: the number is infinite or none.
    integer(int32), parameter :: EXPONENT_BITS = int(z'7F800000', int32)

    character(len=256) :: reason
    character(len=FACET_LENGTH) :: bytes
    integer :: code, i, j
    integer(int32) :: word
    real(wp) :: values(12)

    deallocate (corners, normals)
    allocate (corners(3, 3, n_facet), normals(3, n_facet))
    do i = 1, n_facet
      read (unit, pos=HEAD_LENGTH + 1_int64 + FACET_LENGTH * int(i - 1, int64), iostat=code, &
            iomsg=reason) bytes
      if (code /= 0) then
        call status%raise(STATUS_ERROR, 'read_stl', path//': '//trim(reason), EXIT_MESH)
        return
      end if
      do j = 1, 12
        word = word_of(bytes(4 * j - 3:4 * j))
        if (iand(word, EXPONENT_BITS) /= EXPONENT_BITS) then
          values(j) = real(transfer(word, 0.0_real32), wp)
        else if (j <= 3) then
          values(j) = 0.0_wp
        else
          call status%raise(STATUS_ERROR, 'read_stl', path//': facet '//text(i)// &
                            ': a coordinate is no number', EXIT_MESH)
          return
        end if
      end do
      normals(:, i) = values(1:3)
      corners(:, :, i) = reshape(values(4:12), [3, 3])
    end do

  end subroutine read_binary

  !> Several solids in one file are one surface.
  subroutine read_text(path, corners, normals, status)
    character(len=*), intent(in) :: path
    real(wp), allocatable, intent(inout) :: corners(:, :, :)
    real(wp), allocatable, intent(inout) :: normals(:, :)
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: word
    integer :: i, n_facet
    logical :: found
    real(wp), allocatable :: longer(:, :, :), longer_normals(:, :)
    type(line_reader_t) :: reader

    deallocate (corners, normals)
    allocate (corners(3, 3, 64), normals(3, 64))
    n_facet = 0
    call reader%open(path, EXIT_MESH, status)
    do
      call reader%next(found, status)
      if (status%failed() .or. .not. found) exit
      call take_lower(reader, word)
      select case (word)
      case ('', 'solid', 'endsolid')
        cycle
      case ('facet')
        if (n_facet == size(normals, 2)) then
          allocate (longer(3, 3, 2 * n_facet), longer_normals(3, 2 * n_facet))
          longer(:, :, :n_facet) = corners
          longer_normals(:, :n_facet) = normals
          call move_alloc(longer, corners)
          call move_alloc(longer_normals, normals)
        end if
        n_facet = n_facet + 1
        call expect(reader, 'normal', status)
        call take_position(reader, normals(:, n_facet), status)
        call expect_line(reader, 'outer', status)
        do i = 1, 3
          call expect_line(reader, 'vertex', status)
          call take_position(reader, corners(:, i, n_facet), status)
        end do
        call expect_line(reader, 'endloop', status)
        call expect_line(reader, 'endfacet', status)
      case default
        call reader%fail(''''//word//''' is unknown here: facet or endsolid is expected', status)
      end select
      if (status%failed()) exit
    end do
    call reader%close()
    corners = corners(:, :, :n_facet)
    normals = normals(:, :n_facet)

  end subroutine read_text

  !> The next word in lower case.
  subroutine take_lower(reader, word)
    type(line_reader_t), intent(inout) :: reader
    character(len=:), allocatable, intent(out) :: word

    integer :: i

    call reader%take_word(word)
    do i = 1, len(word)
      if (word(i:i) >= 'A' .and. word(i:i) <= 'Z') word(i:i) = achar(iachar(word(i:i)) + 32)
    end do

  end subroutine take_lower

  !> The next word must be a given one.
  subroutine expect(reader, expected, status)
    type(line_reader_t), intent(inout) :: reader
    character(len=*), intent(in) :: expected
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: word

    if (status%failed()) return
    call take_lower(reader, word)
    if (word /= expected) call reader%fail(expected//' is expected here', status)

  end subroutine expect

  !> The next line that is not empty must begin with a given word.
  subroutine expect_line(reader, expected, status)
    type(line_reader_t), intent(inout) :: reader
    character(len=*), intent(in) :: expected
    type(status_t), intent(inout) :: status

    do
      call reader%advance(status)
      if (status%failed()) return
      if (reader%line() /= '') exit
    end do
    call expect(reader, expected, status)

  end subroutine expect_line

  subroutine take_position(reader, x, status)
    type(line_reader_t), intent(inout) :: reader
    real(wp), intent(out) :: x(3)
    type(status_t), intent(inout) :: status

    integer :: k

    do k = 1, 3
      call reader%take_real(x(k), status)
    end do

  end subroutine take_position

end module swage_stl_reader
