!> What Swage needs of parallel HDF5: files, growing tables, attributes.
!>
!> Every procedure is collective over the communicator of the file, but for one. None raises a
!> status: each sets `broken` to true when an HDF5 call failed on this rank and leaves it alone
!> otherwise, so that a caller makes all its calls on all ranks and agrees once. HDF5 prints nothing
!> of its own.
module swage_hdf5
  use, intrinsic :: iso_c_binding, only: c_loc, c_null_ptr, c_ptr
  use, intrinsic :: iso_fortran_env, only: int64, int8
  use hdf5, only: h5aclose_f, h5acreate_f, h5aopen_f, h5awrite_f, h5dclose_f, h5dcreate_f, &
                  h5dget_space_f, h5dopen_f, h5dset_extent_f, h5dwrite_f, h5eset_auto_f, &
                  h5fclose_f, h5fcreate_f, h5fflush_f, h5fget_file_image_f, h5fopen_f, &
                  h5kind_to_type, h5open_f, h5pclose_f, h5pcreate_f, h5pset_chunk_f, &
                  h5pset_dxpl_mpio_f, h5pset_fapl_core_f, h5pset_fapl_mpio_f, h5pset_fill_time_f, &
                  h5pset_libver_bounds_f, h5pset_userblock_f, h5sclose_f, h5screate_f, &
                  h5screate_simple_f, h5sget_simple_extent_dims_f, h5sselect_hyperslab_f, &
                  h5sselect_none_f, &
                  h5tclose_f, h5tcopy_f, h5tset_size_f, h5tset_strpad_f, hid_t, hsize_t, size_t, &
                  H5D_FILL_TIME_NEVER_F, H5FD_MPIO_COLLECTIVE_F, H5F_ACC_RDWR_F, &
                  H5F_ACC_TRUNC_F, H5F_LIBVER_LATEST_F, H5F_SCOPE_GLOBAL_F, &
                  H5P_DATASET_CREATE_F, H5P_DATASET_XFER_F, H5P_FILE_ACCESS_F, &
                  H5P_FILE_CREATE_F, H5S_SCALAR_F, &
                  H5S_SELECT_SET_F, H5S_UNLIMITED_F, H5T_FORTRAN_S1, H5T_STD_I64LE, &
                  H5T_STR_NULLPAD_F, H5_INTEGER_KIND
  use mpi_f08, only: MPI_INFO_NULL
  use swage_comm, only: comm_t
  use swage_kinds, only: gp
  implicit none(type, external)
  private

  public :: hdf5_start, hdf5_create_file, hdf5_open_new_file, hdf5_flush
  public :: hdf5_create_table, hdf5_write_rows
  public :: hdf5_write_text, hdf5_write_integers, note_code, LIST

  !> In place of a number of components: a table of rank 1.
  integer, parameter :: LIST = 0

  !> Bytes by which a file in memory grows.
  integer(size_t), parameter :: IMAGE_INCREMENT = 4096_size_t

contains

  !> Make HDF5 usable and silent. Harmless when repeated; HDF5 ends with the program, since other
  !> files may be open when one is closed.
  subroutine hdf5_start(broken)
    logical, intent(inout) :: broken

    integer :: code

    call h5open_f(code)
    call note_code(code, broken)
    call h5eset_auto_f(0, code)
    call note_code(code, broken)

  end subroutine hdf5_start

  !> Not collective, unlike the others: one rank creates a file. One that exists is replaced, unless
  !> it cannot be opened for writing.
  !>
  !> HDF5 makes it in memory, for it cannot get rid of a file that it could not write.
  subroutine hdf5_create_file(path, n_header, broken)
    character(len=*), intent(in) :: path
    !> Bytes in front that HDF5 leaves alone: none, 512 or a larger power of 2.
    integer, intent(in) :: n_header
    logical, intent(inout) :: broken

    integer(int8), allocatable :: header(:)
    integer(int8), allocatable, target :: image(:)
    integer(size_t) :: n_byte
    integer(hid_t) :: access, creation, file
    integer :: code, unit
    type(c_ptr) :: place

    call h5pcreate_f(H5P_FILE_ACCESS_F, access, code)
    call note_code(code, broken)
    call h5pset_fapl_core_f(access, IMAGE_INCREMENT, .false., code)
    call note_code(code, broken)
    call h5pcreate_f(H5P_FILE_CREATE_F, creation, code)
    call note_code(code, broken)
    call h5pset_userblock_f(creation, int(n_header, hsize_t), code)
    call note_code(code, broken)
    call h5fcreate_f(path, H5F_ACC_TRUNC_F, file, code, creation, access)
    call note_code(code, broken)
    call h5fflush_f(file, H5F_SCOPE_GLOBAL_F, code)
    call note_code(code, broken)
    n_byte = 0_size_t
    place = c_null_ptr
    call h5fget_file_image_f(file, place, 0_size_t, code, n_byte)
    call note_code(code, broken)
    allocate (image(n_byte))
    place = c_loc(image)
    call h5fget_file_image_f(file, place, n_byte, code)
    call note_code(code, broken)
    call h5fclose_f(file, code)
    call note_code(code, broken)
    call h5pclose_f(creation, code)
    call note_code(code, broken)
    call h5pclose_f(access, code)
    call note_code(code, broken)
    if (broken) return

    allocate (header(n_header), source=0_int8)
    open (newunit=unit, file=path, access='stream', form='unformatted', status='replace', &
          action='readwrite', iostat=code)
    broken = code /= 0
    if (broken) return
    write (unit, iostat=code) header, image
    broken = code /= 0
    flush (unit, iostat=code)
    broken = broken .or. code /= 0
    close (unit, iostat=code)
    broken = broken .or. code /= 0

  end subroutine hdf5_create_file

  !> Collective. Open a file that has just been created.
  !>
  !> The file is of the oldest kind, what is put into it may be of the newest: a file of a newer
  !> kind could not be read while it is written, nor opened again after its run was killed; the
  !> older tables rebuild the index of their rows every 64 chunks, and a run killed meanwhile would
  !> lose them.
  subroutine hdf5_open_new_file(path, comm, newest, file, broken)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> True for what is put into it to be of the newest kind.
    logical, intent(in) :: newest
    !> The caller closes it.
    integer(hid_t), intent(out) :: file
    logical, intent(inout) :: broken

    integer(hid_t) :: access
    integer :: code

    file = -1_hid_t
    call h5pcreate_f(H5P_FILE_ACCESS_F, access, code)
    call note_code(code, broken)
    call h5pset_fapl_mpio_f(access, comm%handle%mpi_val, MPI_INFO_NULL%mpi_val, code)
    call note_code(code, broken)
    if (newest) then
      call h5pset_libver_bounds_f(access, H5F_LIBVER_LATEST_F, H5F_LIBVER_LATEST_F, code)
      call note_code(code, broken)
    end if
    call h5fopen_f(path, H5F_ACC_RDWR_F, file, code, access)
    call note_code(code, broken)
    call h5pclose_f(access, code)
    call note_code(code, broken)

  end subroutine hdf5_open_new_file

  !> Collective. Bring what was written onto the disk.
  !>
  !> HDF5 writes the length of the file before the file is as long as that: a run killed between the
  !> two would leave a file that nobody can open. So the file must have its room before, see
  !> [[reserve_t]]; where it has grown HDF5 cuts what it did not need.
  subroutine hdf5_flush(file, broken)
    integer(hid_t), intent(in) :: file
    logical, intent(inout) :: broken

    integer :: code

    call h5fflush_f(file, H5F_SCOPE_GLOBAL_F, code)
    call note_code(code, broken)

  end subroutine hdf5_flush

  !> Collective. Create an empty table that grows by rows.
  !>
  !> It is not compressed: a row added to a compressed chunk moves the chunk, and a run killed
  !> meanwhile would lose rows of earlier steps with it.
  subroutine hdf5_create_table(location, name, file_type, n_component, n_chunk, broken)
    !> File or group.
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    !> HDF5 type of the numbers in the file.
    integer(hid_t), intent(in) :: file_type
    !> Numbers in a row; `LIST` for a table of rank 1.
    integer, intent(in) :: n_component
    !> Rows allocated at a time; at least 1.
    integer(gp), intent(in) :: n_chunk
    logical, intent(inout) :: broken

    integer(hid_t) :: creation, dataset, space
    integer(hsize_t) :: chunk(2), extent(2), limit(2)
    integer :: code, n_rank

    call get_shape(n_component, 0_gp, extent, n_rank)
    call get_shape(n_component, n_chunk, chunk, n_rank)
    limit = extent
    limit(n_rank) = H5S_UNLIMITED_F
    call h5screate_simple_f(n_rank, extent(:n_rank), space, code, limit(:n_rank))
    call note_code(code, broken)
    call h5pcreate_f(H5P_DATASET_CREATE_F, creation, code)
    call note_code(code, broken)
    call h5pset_chunk_f(creation, n_rank, chunk(:n_rank), code)
    call note_code(code, broken)
    ! Every row is written anyway. Besides, where the disk is full, HDF5 1.10 fails to fill new
    ! chunks on one rank and leaves the others waiting
    call h5pset_fill_time_f(creation, H5D_FILL_TIME_NEVER_F, code)
    call note_code(code, broken)
    call h5dcreate_f(location, name, file_type, space, dataset, code, creation)
    call note_code(code, broken)
    call h5dclose_f(dataset, code)
    call note_code(code, broken)
    call h5pclose_f(creation, code)
    call note_code(code, broken)
    call h5sclose_f(space, code)
    call note_code(code, broken)

  end subroutine hdf5_create_table

  !> Collective. Write some rows of a table, which grows to hold them and never shrinks.
  subroutine hdf5_write_rows(location, name, memory_type, buffer, n_component, first, n_local, &
                             n_row, broken)
    !> File or group that holds the table.
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    !> HDF5 type of the numbers in `buffer`. Where it is not that of the file, HDF5 writes rank by
    !> rank.
    integer(hid_t), intent(in) :: memory_type
    !> This rank's rows, contiguous.
    type(c_ptr), intent(in) :: buffer
    !> As when the table was created.
    integer, intent(in) :: n_component
    !> Rows in front of this rank's.
    integer(gp), intent(in) :: first
    !> Rows of this rank; may be 0, but not on all ranks (HDF5 1.10 fails on that).
    integer(gp), intent(in) :: n_local
    !> Rows of the table afterwards, at least.
    integer(gp), intent(in) :: n_row
    logical, intent(inout) :: broken

    integer(hid_t) :: dataset, file_space, memory_space, transfer_list
    integer(hsize_t) :: count(2), extent(2), limit(2), old_extent(2), start(2)
    integer :: code, n_rank

    call get_shape(n_component, n_row, extent, n_rank)
    call get_shape(n_component, n_local, count, n_rank)
    start = 0_hsize_t
    start(n_rank) = int(first, hsize_t)
    call h5dopen_f(location, name, dataset, code)
    call note_code(code, broken)
    call h5dget_space_f(dataset, file_space, code)
    call note_code(code, broken)
    call h5sget_simple_extent_dims_f(file_space, old_extent(:n_rank), limit(:n_rank), code)
    call note_code(code, broken)
    if (extent(n_rank) > old_extent(n_rank)) then
      call h5sclose_f(file_space, code)
      call note_code(code, broken)
      call h5dset_extent_f(dataset, extent(:n_rank), code)
      call note_code(code, broken)
      call h5dget_space_f(dataset, file_space, code)
      call note_code(code, broken)
    end if
    call h5screate_simple_f(n_rank, count(:n_rank), memory_space, code)
    call note_code(code, broken)
    if (n_local > 0_gp) then
      call h5sselect_hyperslab_f(file_space, H5S_SELECT_SET_F, start(:n_rank), count(:n_rank), &
                                 code)
      call note_code(code, broken)
    else
      call h5sselect_none_f(file_space, code)
      call note_code(code, broken)
      call h5sselect_none_f(memory_space, code)
      call note_code(code, broken)
    end if
    call h5pcreate_f(H5P_DATASET_XFER_F, transfer_list, code)
    call note_code(code, broken)
    call h5pset_dxpl_mpio_f(transfer_list, H5FD_MPIO_COLLECTIVE_F, code)
    call note_code(code, broken)
    call h5dwrite_f(dataset, memory_type, buffer, code, memory_space, file_space, transfer_list)
    call note_code(code, broken)
    call h5pclose_f(transfer_list, code)
    call note_code(code, broken)
    call h5sclose_f(memory_space, code)
    call note_code(code, broken)
    call h5sclose_f(file_space, code)
    call note_code(code, broken)
    call h5dclose_f(dataset, code)
    call note_code(code, broken)

  end subroutine hdf5_write_rows

  !> Collective. Attach a text to an open file, group or dataset.
  subroutine hdf5_write_text(object, name, string, broken)
    integer(hid_t), intent(in) :: object
    character(len=*), intent(in) :: name
    !> Trailing blanks are dropped.
    character(len=*), intent(in) :: string
    logical, intent(inout) :: broken

    integer(hid_t) :: attribute, space, text_type
    integer :: code

    call h5screate_f(H5S_SCALAR_F, space, code)
    call note_code(code, broken)
    call h5tcopy_f(H5T_FORTRAN_S1, text_type, code)
    call note_code(code, broken)
    ! HDF5 has no text of length 0
    call h5tset_size_f(text_type, int(max(1, len_trim(string)), size_t), code)
    call note_code(code, broken)
    call h5tset_strpad_f(text_type, H5T_STR_NULLPAD_F, code)
    call note_code(code, broken)
    call h5acreate_f(object, name, text_type, space, attribute, code)
    call note_code(code, broken)
    call h5awrite_f(attribute, text_type, trim(string)//' ', [1_hsize_t], code)
    call note_code(code, broken)
    call h5aclose_f(attribute, code)
    call note_code(code, broken)
    call h5tclose_f(text_type, code)
    call note_code(code, broken)
    call h5sclose_f(space, code)
    call note_code(code, broken)

  end subroutine hdf5_write_text

  !> Collective. Attach integers to an open file, group or dataset, or replace their values: a
  !> scalar when there is one, an array otherwise.
  subroutine hdf5_write_integers(object, name, values, is_new, broken)
    integer(hid_t), intent(in) :: object
    character(len=*), intent(in) :: name
    integer(gp), intent(in) :: values(:)
    !> False when the attribute exists.
    logical, intent(in) :: is_new
    logical, intent(inout) :: broken

    integer(int64), allocatable, target :: buffer(:)
    integer(hid_t) :: attribute, space
    integer :: code

    allocate (buffer, source=int(values, int64))
    if (is_new) then
      if (size(values) == 1) then
        call h5screate_f(H5S_SCALAR_F, space, code)
      else
        call h5screate_simple_f(1, [size(values, kind=hsize_t)], space, code)
      end if
      call note_code(code, broken)
      call h5acreate_f(object, name, H5T_STD_I64LE, space, attribute, code)
      call note_code(code, broken)
      call h5sclose_f(space, code)
    else
      call h5aopen_f(object, name, attribute, code)
    end if
    call note_code(code, broken)
    call h5awrite_f(attribute, h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(buffer), code)
    call note_code(code, broken)
    call h5aclose_f(attribute, code)
    call note_code(code, broken)

  end subroutine hdf5_write_integers

  !> Keep in mind that an HDF5 call failed.
  pure subroutine note_code(code, broken)
    !> As HDF5 returned it: negative for a failure.
    integer, intent(in) :: code
    logical, intent(inout) :: broken

    broken = broken .or. code < 0

  end subroutine note_code

  !> Extents of `n_row` rows in Fortran's order, and how many extents there are.
  pure subroutine get_shape(n_component, n_row, extent, n_rank)
    integer, intent(in) :: n_component
    integer(gp), intent(in) :: n_row
    integer(hsize_t), intent(out) :: extent(2)
    integer, intent(out) :: n_rank

    n_rank = merge(1, 2, n_component == LIST)
    extent = [int(n_component, hsize_t), int(n_row, hsize_t)]
    if (n_rank == 1) extent = [int(n_row, hsize_t), 0_hsize_t]

  end subroutine get_shape

end module swage_hdf5
