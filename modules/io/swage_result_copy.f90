!> A copy of the finished steps of a result file, in its place.
!>
!> A run that is killed while HDF5 brings the indices of tables onto the disk leaves some as they
!> were and others as they should become. Finished steps can be read from such a file, but it cannot
!> grow: so what can be read is copied into a new file, which takes the name of the old one in one
!> instant. If that is killed, too, one of the two is there, and either will do.
module swage_result_copy
  use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
  use, intrinsic :: iso_fortran_env, only: int8
  use hdf5, only: h5aclose_f, h5acreate_f, h5aget_name_f, h5aget_num_attrs_f, h5aget_space_f, &
                  h5aget_storage_size_f, h5aget_type_f, h5aopen_by_idx_f, h5aread_f, h5awrite_f, &
                  h5dclose_f, h5dcreate_f, h5dget_create_plist_f, h5dget_space_f, h5dget_type_f, &
                  h5dopen_f, h5dread_f, h5dwrite_f, h5fclose_f, h5gclose_f, h5gcreate_f, &
                  h5gget_obj_info_idx_f, h5gn_members_f, h5gopen_f, h5pclose_f, h5sclose_f, &
                  h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, &
                  h5sselect_hyperslab_f, h5tclose_f, h5tget_size_f, hid_t, hsize_t, size_t, &
                  H5G_DATASET_F, H5S_SELECT_SET_F, H5_INDEX_NAME_F, H5_ITER_INC_F
  use mpi_f08, only: MPI_COMM_SELF
  use swage_comm, only: comm_create, comm_t
  use swage_disk_room, only: check_room, reserve_t
  use swage_file_system, only: file_size, remove_file, rename_file, sync_file
  use swage_hdf5, only: hdf5_create_file, hdf5_flush, hdf5_open_new_file, hdf5_start, &
                        hdf5_write_integers, note_code
  use swage_hdf5_arrays, only: hdf5_open_file, hdf5_read_integers, MEMBER_LENGTH
  use swage_kinds, only: gp
  use swage_output_path, only: describe_refusal
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  implicit none(type, external)
  private

  public :: kept_rows_t, copy_results, CLOSED

  !> Integer attached to the root of a result file: 1 when it was closed by who wrote it, 0 from the
  !> moment it is opened for writing. A file without it was not closed, as far as anybody knows.
  character(len=*), parameter :: CLOSED = 'closed'

  !> End of the name of a copy that is not whole.
  character(len=*), parameter :: PARTIAL_END = '.partial'

  !> Groups of a result file, each behind the one that holds it.
  character(len=*), parameter :: ROOT = 'VTKHDF'
  character(len=*), parameter :: OF_POINTS = 'VTKHDF/PointData'
  character(len=*), parameter :: OF_CELLS = 'VTKHDF/CellData'
  character(len=*), parameter :: STEPS = 'VTKHDF/Steps'
  character(len=*), parameter :: GROUPS(6) = [character(len=29) :: &
    ROOT, OF_POINTS, OF_CELLS, STEPS, STEPS//'/PointDataOffsets', STEPS//'/CellDataOffsets']

  !> Bytes that are copied at a time.
  integer(gp), parameter :: BLOCK = 16777216_gp

  !> Bytes to have at hand besides those of the old file.
  integer(gp), parameter :: SPARE = 262144_gp

  !> Rows of the tables of a result file that belong to the steps to keep.
  type :: kept_rows_t
    integer(gp) :: points = 0_gp
    integer(gp) :: cells = 0_gp
    integer(gp) :: corners = 0_gp
    !> First corners of cells: one more than cells for each part.
    integer(gp) :: offsets = 0_gp
    integer(gp) :: parts = 0_gp
    integer(gp) :: steps = 0_gp
  end type kept_rows_t

contains

  !> Collective. Replace a result file that nobody has open by a copy of its first steps, which
  !> counts as closed. Rank 0 copies, the others wait.
  !>
  !> Bits are copied, whatever they mean. The old file is unharmed when the call fails.
  subroutine copy_results(path, comm, kept, status)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(kept_rows_t), intent(in) :: kept
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when the steps cannot be read or the
    !> copy cannot be written.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: partial

    if (comm%rank == 0) then
      partial = trim(path)//PARTIAL_END
      call create_copy(trim(path), partial, kept, status)
      if (.not. status%failed()) call give_name(partial, trim(path), status)
      if (status%failed()) call remove_file(partial)
    end if
    call comm%agree(status)

  end subroutine copy_results

  !> Not collective. Write the copy under a passing name.
  subroutine create_copy(path, partial, kept, status)
    character(len=*), intent(in) :: path
    character(len=*), intent(in) :: partial
    type(kept_rows_t), intent(in) :: kept
    type(status_t), intent(inout) :: status

    type(comm_t) :: alone
    type(reserve_t) :: reserve
    integer(gp) :: n_byte
    integer(hid_t) :: old, new
    logical :: broken, unreadable
    integer :: code

    alone = comm_create(MPI_COMM_SELF)
    n_byte = max(0_gp, file_size(path)) + SPARE
    call check_room(path, n_byte, alone, status)
    if (status%failed()) return

    broken = .false.
    unreadable = .false.
    call hdf5_start(broken)
    call hdf5_create_file(partial, 0, broken)
    if (broken) then
      call status%raise(STATUS_ERROR, 'copy_results', 'cannot create '//partial//': '// &
                        describe_refusal(partial), EXIT_FILE)
      return
    end if
    call reserve%take(partial, n_byte, alone, status)
    if (status%failed()) return

    call hdf5_open_file(path, alone, .false., old, unreadable)
    call hdf5_open_new_file(partial, alone, .true., new, broken)
    call copy_content(old, new, kept, unreadable, broken)
    if (new >= 0_hid_t) then
      call h5fclose_f(new, code)
      call note_code(code, broken)
    end if
    if (old >= 0_hid_t) call h5fclose_f(old, code)
    call reserve%give_back(partial)
    if (unreadable) then
      call status%raise(STATUS_ERROR, 'copy_results', path//' cannot be continued: the run '// &
                        'that wrote it was killed, and its results cannot be read. Start again '// &
                        'without --restart, or write new results: &restart from with another '// &
                        '&output prefix', EXIT_FILE)
    else if (broken) then
      call status%raise(STATUS_ERROR, 'copy_results', 'cannot write '//partial// &
                        ': the disk may be full', EXIT_FILE)
    end if

  end subroutine create_copy

  !> Not collective. Put the copy on the disk, then in the place of the old file.
  subroutine give_name(partial, path, status)
    character(len=*), intent(in) :: partial
    character(len=*), intent(in) :: path
    type(status_t), intent(inout) :: status

    logical :: succeeded

    call sync_file(partial, succeeded)
    if (succeeded) call rename_file(partial, path, succeeded)
    if (.not. succeeded) then
      call status%raise(STATUS_ERROR, 'copy_results', partial//' cannot take the place of '//path, &
                        EXIT_FILE)
    end if

  end subroutine give_name

  !> Copy groups, tables and what is attached to them.
  subroutine copy_content(old, new, kept, unreadable, broken)
    !> Open files.
    integer(hid_t), intent(in) :: old
    integer(hid_t), intent(in) :: new
    type(kept_rows_t), intent(in) :: kept
    !> Set when the old file fails.
    logical, intent(inout) :: unreadable
    !> Set when the new one does.
    logical, intent(inout) :: broken

    integer :: i

    if (unreadable .or. broken) return
    call copy_attributes(old, new, unreadable, broken)
    do i = 1, size(GROUPS)
      if (unreadable .or. broken) return
      call copy_group(old, new, trim(GROUPS(i)), kept, unreadable, broken)
    end do
    if (unreadable .or. broken) return
    call mark_closed(old, new, broken)
    call hdf5_flush(new, broken)

  end subroutine copy_content

  !> Let the copy say that it is closed; its original need not have said anything.
  subroutine mark_closed(old, new, broken)
    integer(hid_t), intent(in) :: old
    integer(hid_t), intent(in) :: new
    logical, intent(inout) :: broken

    integer(gp) :: ignored(1)
    logical :: is_new

    is_new = .false.
    call hdf5_read_integers(old, CLOSED, ignored, is_new)
    call hdf5_write_integers(new, CLOSED, [1_gp], is_new, broken)

  end subroutine mark_closed

  !> Copy a group and its tables, without the groups in it.
  subroutine copy_group(old, new, group, kept, unreadable, broken)
    integer(hid_t), intent(in) :: old
    integer(hid_t), intent(in) :: new
    character(len=*), intent(in) :: group
    type(kept_rows_t), intent(in) :: kept
    logical, intent(inout) :: unreadable
    logical, intent(inout) :: broken

    character(len=MEMBER_LENGTH) :: name
    integer(hid_t) :: from, to
    integer :: code, i, kind, n

    call h5gopen_f(old, group, from, code)
    call note_code(code, unreadable)
    call h5gcreate_f(new, group, to, code)
    call note_code(code, broken)
    call copy_attributes(from, to, unreadable, broken)
    if (group == STEPS) then
      call hdf5_write_integers(to, 'NSteps', [kept%steps], .false., broken)
    end if
    n = 0
    call h5gn_members_f(old, group, n, code)
    call note_code(code, unreadable)
    do i = 0, n - 1
      if (unreadable .or. broken) exit
      call h5gget_obj_info_idx_f(old, group, i, name, kind, code)
      call note_code(code, unreadable)
      if (unreadable .or. kind /= H5G_DATASET_F) cycle
      call copy_table(from, to, trim(name), rows_of(kept, group, trim(name)), unreadable, broken)
    end do
    if (to >= 0_hid_t) call h5gclose_f(to, code)
    if (from >= 0_hid_t) call h5gclose_f(from, code)

  end subroutine copy_group

  !> Rows of a table that belong to the steps to keep.
  pure function rows_of(kept, group, name) result(n_row)
    type(kept_rows_t), intent(in) :: kept
    character(len=*), intent(in) :: group
    character(len=*), intent(in) :: name
    integer(gp) :: n_row

    n_row = kept%steps
    if (group == OF_POINTS .or. (group == ROOT .and. name == 'Points')) then
      n_row = kept%points
    else if (group == OF_CELLS .or. (group == ROOT .and. name == 'Types')) then
      n_row = kept%cells
    else if (group == ROOT .and. name == 'Connectivity') then
      n_row = kept%corners
    else if (group == ROOT .and. name == 'Offsets') then
      n_row = kept%offsets
    else if (group == ROOT) then
      n_row = kept%parts
    end if

  end function rows_of

  !> Copy the first rows of a table, and what is attached to it.
  subroutine copy_table(old, new, name, n_row, unreadable, broken)
    !> Groups that hold it.
    integer(hid_t), intent(in) :: old
    integer(hid_t), intent(in) :: new
    character(len=*), intent(in) :: name
    integer(gp), intent(in) :: n_row
    logical, intent(inout) :: unreadable
    logical, intent(inout) :: broken

    integer(hid_t) :: creation, from, from_space, number_type, to, to_space
    integer(hsize_t) :: extent(2), limit(2)
    integer :: code, n_rank

    extent = 0_hsize_t
    n_rank = 0
    call h5dopen_f(old, name, from, code)
    call note_code(code, unreadable)
    call h5dget_type_f(from, number_type, code)
    call note_code(code, unreadable)
    call h5dget_create_plist_f(from, creation, code)
    call note_code(code, unreadable)
    call h5dget_space_f(from, from_space, code)
    call note_code(code, unreadable)
    call h5sget_simple_extent_ndims_f(from_space, n_rank, code)
    call note_code(code, unreadable)
    unreadable = unreadable .or. n_rank < 1 .or. n_rank > 2
    if (.not. unreadable) then
      call h5sget_simple_extent_dims_f(from_space, extent(:n_rank), limit(:n_rank), code)
      call note_code(code, unreadable)
      unreadable = unreadable .or. extent(n_rank) < int(n_row, hsize_t)
    end if
    if (.not. unreadable) then
      extent(n_rank) = int(n_row, hsize_t)
      call h5screate_simple_f(n_rank, extent(:n_rank), to_space, code, limit(:n_rank))
      call note_code(code, broken)
      call h5dcreate_f(new, name, number_type, to_space, to, code, creation)
      call note_code(code, broken)
      call copy_attributes(from, to, unreadable, broken)
      call copy_rows(from, from_space, to, to_space, number_type, extent(:n_rank), unreadable, &
                     broken)
      call h5dclose_f(to, code)
      call note_code(code, broken)
      call h5sclose_f(to_space, code)
      call note_code(code, broken)
    end if
    ! What could not be opened cannot be closed, which does no harm
    call h5sclose_f(from_space, code)
    call h5pclose_f(creation, code)
    call h5tclose_f(number_type, code)
    call h5dclose_f(from, code)

  end subroutine copy_table

  !> Copy the numbers of the first rows, block by block.
  subroutine copy_rows(from, from_space, to, to_space, number_type, extent, unreadable, broken)
    !> Tables and the spaces of their numbers.
    integer(hid_t), intent(in) :: from
    integer(hid_t), intent(in) :: from_space
    integer(hid_t), intent(in) :: to
    integer(hid_t), intent(in) :: to_space
    integer(hid_t), intent(in) :: number_type
    !> Of the new table, the rows last.
    integer(hsize_t), intent(in) :: extent(:)
    logical, intent(inout) :: unreadable
    logical, intent(inout) :: broken

    integer(int8), allocatable, target :: buffer(:)
    integer(hsize_t) :: count(size(extent)), start(size(extent))
    integer(gp) :: first, n_at_once, n_byte, n_row
    integer(size_t) :: n_byte_each
    integer(hid_t) :: memory_space
    type(c_ptr) :: address
    integer :: code, n_rank

    n_rank = size(extent)
    n_row = int(extent(n_rank), gp)
    call h5tget_size_f(number_type, n_byte_each, code)
    call note_code(code, unreadable)
    if (unreadable .or. broken .or. n_row == 0_gp) return
    n_byte = int(n_byte_each, gp) * int(product(extent(:n_rank - 1)), gp)
    n_at_once = min(n_row, max(1_gp, BLOCK / max(1_gp, n_byte)))
    allocate (buffer(max(1_gp, n_at_once * n_byte)))
    address = c_loc(buffer)
    start = 0_hsize_t
    count = extent
    do first = 0_gp, n_row - 1_gp, n_at_once
      start(n_rank) = int(first, hsize_t)
      count(n_rank) = int(min(n_at_once, n_row - first), hsize_t)
      call h5sselect_hyperslab_f(from_space, H5S_SELECT_SET_F, start, count, code)
      call note_code(code, unreadable)
      call h5sselect_hyperslab_f(to_space, H5S_SELECT_SET_F, start, count, code)
      call note_code(code, broken)
      call h5screate_simple_f(n_rank, count, memory_space, code)
      call note_code(code, broken)
      call h5dread_f(from, number_type, address, code, memory_space, from_space)
      call note_code(code, unreadable)
      if (.not. unreadable) then
        call h5dwrite_f(to, number_type, address, code, memory_space, to_space)
        call note_code(code, broken)
      end if
      call h5sclose_f(memory_space, code)
      call note_code(code, broken)
      if (unreadable .or. broken) return
    end do

  end subroutine copy_rows

  !> Copy what is attached to a file, group or table.
  subroutine copy_attributes(old, new, unreadable, broken)
    integer(hid_t), intent(in) :: old
    integer(hid_t), intent(in) :: new
    logical, intent(inout) :: unreadable
    logical, intent(inout) :: broken

    integer :: code, i, n

    n = 0
    call h5aget_num_attrs_f(old, n, code)
    call note_code(code, unreadable)
    do i = 0, n - 1
      if (unreadable .or. broken) return
      call copy_attribute(old, new, i, unreadable, broken)
    end do

  end subroutine copy_attributes

  !> Copy one of them.
  subroutine copy_attribute(old, new, position, unreadable, broken)
    integer(hid_t), intent(in) :: old
    integer(hid_t), intent(in) :: new
    !> From 0, in the order of the names.
    integer, intent(in) :: position
    logical, intent(inout) :: unreadable
    logical, intent(inout) :: broken

    character(len=MEMBER_LENGTH) :: name
    integer(int8), allocatable, target :: buffer(:)
    integer(hid_t) :: from, space, to, value_type
    integer(hsize_t) :: n_byte
    type(c_ptr) :: address
    integer :: code

    n_byte = 0_hsize_t
    call h5aopen_by_idx_f(old, '.', H5_INDEX_NAME_F, H5_ITER_INC_F, &
                          int(position, hsize_t), from, code)
    call note_code(code, unreadable)
    if (unreadable) return
    call h5aget_name_f(from, len(name, kind=size_t), name, code)
    call note_code(code, unreadable)
    call h5aget_type_f(from, value_type, code)
    call note_code(code, unreadable)
    call h5aget_space_f(from, space, code)
    call note_code(code, unreadable)
    call h5aget_storage_size_f(from, n_byte, code)
    call note_code(code, unreadable)
    allocate (buffer(max(1_hsize_t, n_byte)))
    address = c_loc(buffer)
    call h5aread_f(from, value_type, address, code)
    call note_code(code, unreadable)
    if (.not. unreadable) then
      call h5acreate_f(new, trim(name), value_type, space, to, code)
      call note_code(code, broken)
      call h5awrite_f(to, value_type, address, code)
      call note_code(code, broken)
      call h5aclose_f(to, code)
      call note_code(code, broken)
    end if
    call h5sclose_f(space, code)
    call h5tclose_f(value_type, code)
    call h5aclose_f(from, code)

  end subroutine copy_attribute

end module swage_result_copy
