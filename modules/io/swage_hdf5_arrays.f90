!> Arrays that are written once and read back, and files that exist already: the part of parallel
!> HDF5 that restarts need, besides [[swage_hdf5]], whose conventions hold.
module swage_hdf5_arrays
  use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
  use, intrinsic :: iso_fortran_env, only: int64
  use hdf5, only: h5aclose_f, h5aget_space_f, h5aopen_f, h5aread_f, h5dclose_f, h5dcreate_f, &
                  h5dget_space_f, h5dopen_f, h5dread_f, h5dwrite_f, h5fopen_f, &
                  h5gget_obj_info_idx_f, h5gn_members_f, h5kind_to_type, h5pclose_f, &
                  h5pcreate_f, h5pset_dxpl_mpio_f, h5pset_fapl_mpio_f, &
                  h5sclose_f, h5screate_simple_f, h5sget_simple_extent_dims_f, &
                  h5sget_simple_extent_ndims_f, h5sget_simple_extent_npoints_f, &
                  h5sselect_hyperslab_f, h5sselect_none_f, hid_t, hsize_t, H5_INTEGER_KIND, &
                  H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5FD_MPIO_COLLECTIVE_F, &
                  H5P_DATASET_XFER_F, H5P_FILE_ACCESS_F, H5S_SELECT_SET_F, &
                  H5T_NATIVE_DOUBLE
  use mpi_f08, only: MPI_INFO_NULL
  use swage_comm, only: comm_t
  use swage_hdf5, only: note_code
  use swage_kinds, only: gp, wp
  implicit none(type, external)
  private

  public :: hdf5_open_file, hdf5_write_array, hdf5_read_array
  public :: hdf5_array_shape, hdf5_read_list, hdf5_read_integers, hdf5_members, MEMBER_LENGTH

  !> Longest name of a member of a group.
  integer, parameter :: MEMBER_LENGTH = 256

contains

  !> Collective. Open a file that exists.
  subroutine hdf5_open_file(path, comm, writable, file, broken)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    logical, intent(in) :: writable
    !> The caller closes it; negative when it could not be opened.
    integer(hid_t), intent(out) :: file
    logical, intent(inout) :: broken

    integer(hid_t) :: access
    integer :: code

    file = -1_hid_t
    call get_access(comm, access, broken)
    if (writable) then
      call h5fopen_f(path, H5F_ACC_RDWR_F, file, code, access)
    else
      call h5fopen_f(path, H5F_ACC_RDONLY_F, file, code, access)
    end if
    call note_code(code, broken)
    call h5pclose_f(access, code)
    call note_code(code, broken)

  end subroutine hdf5_open_file

  !> Collective. Create an array and write it, each rank some of its rows.
  subroutine hdf5_write_array(location, name, number_type, buffer, n_component, first, n_local, &
                              n_row, broken)
    !> File or group.
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    !> HDF5 type of the numbers, in memory and in the file.
    integer(hid_t), intent(in) :: number_type
    !> This rank's rows, contiguous.
    type(c_ptr), intent(in) :: buffer
    !> Numbers in a row.
    integer, intent(in) :: n_component
    !> Rows in front of this rank's, rows of this rank and of all ranks; each may be 0.
    integer(gp), intent(in) :: first
    integer(gp), intent(in) :: n_local
    integer(gp), intent(in) :: n_row
    logical, intent(inout) :: broken

    integer(hid_t) :: dataset, file_space, memory_space, transfer_list
    integer :: code

    call h5screate_simple_f(2, [int(n_component, hsize_t), int(n_row, hsize_t)], file_space, code)
    call note_code(code, broken)
    call h5dcreate_f(location, name, number_type, file_space, dataset, code)
    call note_code(code, broken)
    ! HDF5 1.10 fails on a collective write of nothing
    if (n_component > 0 .and. n_row > 0_gp) then
      call select_rows(n_component, first, n_local, file_space, memory_space, transfer_list, broken)
      call h5dwrite_f(dataset, number_type, buffer, code, memory_space, file_space, transfer_list)
      call note_code(code, broken)
      call h5pclose_f(transfer_list, code)
      call note_code(code, broken)
      call h5sclose_f(memory_space, code)
      call note_code(code, broken)
    end if
    call h5dclose_f(dataset, code)
    call note_code(code, broken)
    call h5sclose_f(file_space, code)
    call note_code(code, broken)

  end subroutine hdf5_write_array

  !> Collective. Read some rows of an array.
  subroutine hdf5_read_array(location, name, number_type, buffer, n_component, first, n_local, &
                             n_row, broken)
    !> As in [[hdf5_write_array]]; ranks may read the same rows.
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    integer(hid_t), intent(in) :: number_type
    type(c_ptr), intent(in) :: buffer
    integer, intent(in) :: n_component
    integer(gp), intent(in) :: first
    integer(gp), intent(in) :: n_local
    integer(gp), intent(in) :: n_row
    logical, intent(inout) :: broken

    integer(hid_t) :: dataset, file_space, memory_space, transfer_list
    type(c_ptr) :: address
    integer :: code

    if (n_component == 0 .or. n_row == 0_gp) return
    address = buffer
    call h5dopen_f(location, name, dataset, code)
    call note_code(code, broken)
    call h5dget_space_f(dataset, file_space, code)
    call note_code(code, broken)
    call select_rows(n_component, first, n_local, file_space, memory_space, transfer_list, broken)
    call h5dread_f(dataset, number_type, address, code, memory_space, file_space, transfer_list)
    call note_code(code, broken)
    call h5pclose_f(transfer_list, code)
    call note_code(code, broken)
    call h5sclose_f(memory_space, code)
    call note_code(code, broken)
    call h5dclose_f(dataset, code)
    call note_code(code, broken)
    call h5sclose_f(file_space, code)
    call note_code(code, broken)

  end subroutine hdf5_read_array

  !> Collective. Read some numbers of a list, an array of rank 1, on all ranks.
  subroutine hdf5_read_list(location, name, first, values, broken)
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    !> Numbers in front of them.
    integer(gp), intent(in) :: first
    !> At least one.
    real(wp), contiguous, target, intent(inout) :: values(:)
    logical, intent(inout) :: broken

    integer(hid_t) :: dataset, file_space, memory_space
    integer(hsize_t) :: count(1)
    type(c_ptr) :: address
    integer :: code

    count = size(values, kind=hsize_t)
    call h5dopen_f(location, name, dataset, code)
    call note_code(code, broken)
    call h5dget_space_f(dataset, file_space, code)
    call note_code(code, broken)
    call h5sselect_hyperslab_f(file_space, H5S_SELECT_SET_F, [int(first, hsize_t)], count, code)
    call note_code(code, broken)
    call h5screate_simple_f(1, count, memory_space, code)
    call note_code(code, broken)
    address = c_loc(values)
    call h5dread_f(dataset, H5T_NATIVE_DOUBLE, address, code, memory_space, file_space)
    call note_code(code, broken)
    call h5sclose_f(memory_space, code)
    call note_code(code, broken)
    call h5dclose_f(dataset, code)
    call note_code(code, broken)
    call h5sclose_f(file_space, code)
    call note_code(code, broken)

  end subroutine hdf5_read_list

  !> Collective. Extents of an array: numbers in a row, and rows.
  subroutine hdf5_array_shape(location, name, n_component, n_row, broken)
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    !> 1 for an array of rank 1.
    integer, intent(out) :: n_component
    integer(gp), intent(out) :: n_row
    logical, intent(inout) :: broken

    integer(hid_t) :: dataset, space
    integer(hsize_t) :: extent(2), limit(2)
    integer :: code, n_rank

    n_component = 0
    n_row = 0_gp
    call h5dopen_f(location, name, dataset, code)
    call note_code(code, broken)
    if (code < 0) return
    call h5dget_space_f(dataset, space, code)
    call note_code(code, broken)
    call h5sget_simple_extent_ndims_f(space, n_rank, code)
    call note_code(code, broken)
    if (n_rank == 1 .or. n_rank == 2) then
      call h5sget_simple_extent_dims_f(space, extent(:n_rank), limit(:n_rank), code)
      call note_code(code, broken)
      n_component = 1
      if (n_rank == 2) n_component = int(extent(1))
      n_row = int(extent(n_rank), gp)
    else
      broken = .true.
    end if
    call h5sclose_f(space, code)
    call note_code(code, broken)
    call h5dclose_f(dataset, code)
    call note_code(code, broken)

  end subroutine hdf5_array_shape

  !> Collective. The integers attached to an open file, group or dataset.
  subroutine hdf5_read_integers(object, name, values, broken)
    integer(hid_t), intent(in) :: object
    character(len=*), intent(in) :: name
    !> As many as there are, 0 otherwise.
    integer(gp), intent(out) :: values(:)
    logical, intent(inout) :: broken

    integer(int64), allocatable, target :: buffer(:)
    integer(hid_t) :: attribute, space
    integer(hsize_t) :: n
    type(c_ptr) :: address
    integer :: code

    values = 0_gp
    call h5aopen_f(object, name, attribute, code)
    call note_code(code, broken)
    if (code < 0) return
    call h5aget_space_f(attribute, space, code)
    call note_code(code, broken)
    call h5sget_simple_extent_npoints_f(space, n, code)
    call note_code(code, broken)
    if (n == size(values, kind=hsize_t)) then
      allocate (buffer(max(1, size(values))))
      address = c_loc(buffer)
      call h5aread_f(attribute, h5kind_to_type(int64, H5_INTEGER_KIND), address, code)
      call note_code(code, broken)
      values = int(buffer(:size(values)), gp)
    else
      broken = .true.
    end if
    call h5sclose_f(space, code)
    call note_code(code, broken)
    call h5aclose_f(attribute, code)
    call note_code(code, broken)

  end subroutine hdf5_read_integers

  !> Collective. Names of what is in a group.
  subroutine hdf5_members(location, group, names, broken)
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: group
    character(len=MEMBER_LENGTH), allocatable, intent(out) :: names(:)
    logical, intent(inout) :: broken

    integer :: code, i, kind, n

    n = 0
    call h5gn_members_f(location, group, n, code)
    call note_code(code, broken)
    if (code < 0) n = 0
    allocate (names(n))
    do i = 1, n
      call h5gget_obj_info_idx_f(location, group, i - 1, names(i), kind, code)
      call note_code(code, broken)
    end do

  end subroutine hdf5_members

  !> How all ranks open a file together.
  subroutine get_access(comm, access, broken)
    type(comm_t), intent(in) :: comm
    integer(hid_t), intent(out) :: access
    logical, intent(inout) :: broken

    integer :: code

    call h5pcreate_f(H5P_FILE_ACCESS_F, access, code)
    call note_code(code, broken)
    call h5pset_fapl_mpio_f(access, comm%handle%mpi_val, MPI_INFO_NULL%mpi_val, code)
    call note_code(code, broken)

  end subroutine get_access

  !> Where this rank's rows are, in the file and in memory.
  subroutine select_rows(n_component, first, n_local, file_space, memory_space, transfer_list, &
                         broken)
    integer, intent(in) :: n_component
    integer(gp), intent(in) :: first
    integer(gp), intent(in) :: n_local
    integer(hid_t), intent(in) :: file_space
    integer(hid_t), intent(out) :: memory_space
    integer(hid_t), intent(out) :: transfer_list
    logical, intent(inout) :: broken

    integer(hsize_t) :: count(2)
    integer :: code

    count = [int(n_component, hsize_t), int(n_local, hsize_t)]
    call h5screate_simple_f(2, count, memory_space, code)
    call note_code(code, broken)
    if (n_local > 0_gp) then
      call h5sselect_hyperslab_f(file_space, H5S_SELECT_SET_F, [0_hsize_t, int(first, hsize_t)], &
                                 count, code)
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

  end subroutine select_rows

end module swage_hdf5_arrays
