!> Restart files: a snapshot of a run, from which any number of ranks can go on.
!>
!> A file is HDF5 behind 512 bytes of text, which say what it is, how long, and its checksum. They
!> are written last: a file without them is not finished, and one that does not agree with them is
!> damaged. It is written under another name and renamed when it is complete, and the one before
!> is kept, so that at any moment a complete one stands on the disk.
!>
!> Arrays lie in groups by scope and kind: `nodes/reals/pressure`. Rows of nodes and cells come in
!> the order of the ranks that wrote them, beside the numbers they have in the mesh.
module swage_restart_file
  use, intrinsic :: iso_c_binding, only: c_loc
  use, intrinsic :: iso_fortran_env, only: int64, int8
  use hdf5, only: h5fclose_f, h5gclose_f, h5gcreate_f, h5kind_to_type, hid_t, H5_INTEGER_KIND, &
                  H5T_NATIVE_DOUBLE, H5T_STD_U8LE
  use swage_checksum, only: bytes_of, checksum
  use swage_comm, only: comm_t
  use swage_disk_room, only: check_room, reserve_t
  use swage_file_system, only: file_size, remove_file, rename_file, same_file, sync_file
  use swage_hdf5, only: hdf5_create_file, hdf5_open_new_file, hdf5_start, note_code
  use swage_hdf5_arrays, only: hdf5_array_shape, hdf5_members, hdf5_open_file, hdf5_read_array, &
                               hdf5_write_array, MEMBER_LENGTH
  use swage_kinds, only: gp, wp
  use swage_output_path, only: describe_refusal
  use swage_path, only: describe_unreadable, is_folder
  use swage_row_map, only: row_map_create, row_map_t, slab_start
  use swage_snapshot, only: ENTRY_INTEGERS, ENTRY_REALS, ENTRY_TEXT, OF_CELLS, OF_NODES, OF_RANK, &
                            OF_RUN, OF_SOME_NODES, snapshot_entry_t, snapshot_t
  use swage_status, only: status_t, EXIT_FILE, EXIT_INPUT, STATUS_ERROR
  implicit none(type, external)
  private

  public :: restart_file_write, restart_file_read, restart_file_check, restart_file_find
  public :: restart_path, previous_restart_path, is_restart_file_of

  !> Bytes in front of what HDF5 writes, and how they begin.
  integer, parameter :: HEADER_LENGTH = 512
  character(len=*), parameter :: MAGIC = 'Swage restart file 1'
  !> Bytes read at a time for a checksum.
  integer(gp), parameter :: BLOCK = 1048576_gp
  !> Bytes of a number.
  integer(gp), parameter :: NUMBER_BYTES = 8_gp
  !> Bytes to have at hand besides those of the numbers, for each array and for the file.
  integer(gp), parameter :: ARRAY_OVERHEAD = 1024_gp
  integer(gp), parameter :: FILE_OVERHEAD = 65536_gp

  !> Groups by scope, by kind of number; of what describes the case; and of the numbers of rows.
  character(len=*), parameter :: SCOPES(5) = [character(len=10) :: &
    'run', 'nodes', 'cells', 'some_nodes', 'rank']
  character(len=*), parameter :: KINDS(3) = [character(len=8) :: 'reals', 'integers', 'text']
  character(len=*), parameter :: CASE = 'case'
  character(len=*), parameter :: NUMBERS = 'numbers'
  !> Arrays of `NUMBERS`: of nodes, of cells, and what tells one distribution from another.
  character(len=*), parameter :: NODE_NUMBERS = 'nodes'
  character(len=*), parameter :: CELL_NUMBERS = 'cells'
  character(len=*), parameter :: PARTITION = 'partition'

contains

  !> `case.restart.h5` of the prefix `case`.
  pure function restart_path(prefix) result(path)
    character(len=*), intent(in) :: prefix
    character(len=:), allocatable :: path

    path = trim(prefix)//'.restart.h5'

  end function restart_path

  !> Where the restart file before the last one is kept.
  pure function previous_restart_path(prefix) result(path)
    character(len=*), intent(in) :: prefix
    character(len=:), allocatable :: path

    path = trim(prefix)//'.restart.previous.h5'

  end function previous_restart_path

  !> Collective. True when a path leads to one of the restart files of a prefix.
  function is_restart_file_of(prefix, path, comm) result(is_one)
    character(len=*), intent(in) :: prefix
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    logical :: is_one

    integer :: answer

    answer = 0
    if (comm%rank == 0 .and. path /= '') then
      if (same_file(path, restart_path(prefix))) answer = 1
      if (same_file(path, previous_restart_path(prefix))) answer = 1
    end if
    call comm%broadcast(answer)
    is_one = answer == 1

  end function is_restart_file_of

  !> Collective. Write a snapshot as the last restart file of a prefix; the last one becomes the
  !> one before. Both stay as they are when the call fails.
  subroutine restart_file_write(prefix, comm, snapshot, remark, status)
    !> Start of the names of the files.
    character(len=*), intent(in) :: prefix
    type(comm_t), intent(in) :: comm
    !> The same entries on all ranks.
    type(snapshot_t), intent(in) :: snapshot
    !> A line for the reader of the file, as its time.
    character(len=*), intent(in) :: remark
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: partial, path
    integer(hid_t) :: file
    logical :: broken
    integer :: code
    type(reserve_t) :: reserve

    path = restart_path(prefix)
    partial = path//'.partial'
    call check_room(path, room_of(snapshot, comm), comm, status)
    if (status%failed()) return

    broken = .false.
    call hdf5_start(broken)
    if (comm%rank == 0) call hdf5_create_file(partial, HEADER_LENGTH, broken)
    call settle_creation()
    if (status%failed()) return
    call reserve%take(partial, room_of(snapshot, comm), comm, status)
    if (status%failed()) then
      if (comm%rank == 0) call remove_file(partial)
      return
    end if
    call hdf5_open_new_file(partial, comm, .false., file, broken)
    call settle_creation()
    if (status%failed()) return

    call write_content(file, comm, snapshot, broken)
    call h5fclose_f(file, code)
    call note_code(code, broken)
    call reserve%give_back(partial)
    call settle(partial, comm, broken, status)
    if (.not. status%failed()) call seal(partial, comm, remark, status)
    if (comm%rank == 0) then
      if (status%failed()) then
        call remove_file(partial)
      else
        call rotate(prefix, partial, status)
      end if
    end if
    call comm%agree(status)

  contains

    subroutine settle_creation()
      if (broken) then
        call status%raise(STATUS_ERROR, 'restart_file_write', 'cannot create '//partial//': '// &
                          describe_refusal(partial), EXIT_FILE)
      end if
      call comm%agree(status)
    end subroutine settle_creation

  end subroutine restart_file_write

  !> Collective. Read a snapshot.
  subroutine restart_file_read(path, comm, snapshot, status)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> In: nodes, cells and properties of the case in hand. Out: with the entries of the file.
    type(snapshot_t), intent(inout) :: snapshot
    !> `STATUS_ERROR`, the same on all ranks: with `EXIT_FILE` when the file is not there or
    !> damaged, with `EXIT_INPUT` when it belongs to another case.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: fault
    integer(hid_t) :: file
    logical :: broken
    integer :: code

    call restart_file_check(path, comm, fault)
    if (fault /= '') then
      call status%raise(STATUS_ERROR, 'restart_file_read', path//': '//fault, EXIT_FILE)
      return
    end if
    broken = .false.
    call hdf5_start(broken)
    call hdf5_open_file(path, comm, .false., file, broken)
    call settle_reading(path, comm, broken, status)
    if (status%failed()) return
    call compare_case(path, file, comm, snapshot, status)
    if (.not. status%failed()) call read_content(path, file, comm, snapshot, status)
    call h5fclose_f(file, code)

  end subroutine restart_file_read

  !> Collective. What is wrong with a restart file, empty when it is complete.
  subroutine restart_file_check(path, comm, fault)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    character(len=:), allocatable, intent(out) :: fault

    character(len=HEADER_LENGTH) :: header
    character(len=256) :: reason
    integer(gp) :: n_byte, n_expected, total, wanted
    integer :: code, unit

    fault = ''
    n_byte = 0_gp
    wanted = 0_gp
    if (comm%rank == 0) then
      n_byte = file_size(path)
      if (n_byte < 0_gp) then
        fault = 'there is no such file'
      else
        open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
              action='read', iostat=code, iomsg=reason)
        if (code /= 0) then
          fault = describe_unreadable(path, reason)
        else
          read (unit, iostat=code) header
          close (unit)
          call parse_header(header, n_expected, wanted, fault)
          if (is_folder(path)) then
            fault = 'it is a folder, a file is expected'
          else if (code /= 0 .or. fault /= '') then
            fault = 'it is not a restart file of this version of Swage, or not a complete one'
          else if (n_byte /= n_expected) then
            fault = 'it is damaged: it has '//long_text(n_byte)//' bytes, and was written with '// &
              long_text(n_expected)
          end if
        end if
      end if
    end if
    call comm%broadcast(fault)
    if (fault /= '') return

    if (comm%rank /= 0) n_byte = 0_gp
    call comm%sum(n_byte)
    call checksum_of_file(path, n_byte, comm, total)
    if (comm%rank == 0 .and. total /= wanted) then
      fault = 'it is damaged: its checksum is not that of its content'
    end if
    call comm%broadcast(fault)

  end subroutine restart_file_check

  !> Collective. The last complete restart file of a prefix.
  subroutine restart_file_find(prefix, comm, required, path, remark, status)
    character(len=*), intent(in) :: prefix
    type(comm_t), intent(in) :: comm
    !> Whether there must be one.
    logical, intent(in) :: required
    !> Empty when there is none.
    character(len=:), allocatable, intent(out) :: path
    !> Why it is not the last one written; empty when it is.
    character(len=:), allocatable, intent(out) :: remark
    !> `STATUS_ERROR`, the same on all ranks: with `EXIT_INPUT` when there is none but should be,
    !> with `EXIT_FILE` when all are damaged.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: fault, previous_fault
    logical :: is_there(2)

    remark = ''
    path = restart_path(prefix)
    call restart_file_check(path, comm, fault)
    if (fault == '') return
    remark = path//': '//fault
    path = previous_restart_path(prefix)
    call restart_file_check(path, comm, previous_fault)
    if (previous_fault == '') return

    inquire (file=restart_path(prefix), exist=is_there(1))
    inquire (file=path, exist=is_there(2))
    if (any(is_there)) then
      call status%raise(STATUS_ERROR, 'restart_file_find', 'there is no restart file to go on '// &
                        'from: '//remark//'; '//path//': '//previous_fault//'. Start again '// &
                        'without --restart', EXIT_FILE)
    else if (required) then
      call status%raise(STATUS_ERROR, 'restart_file_find', 'there is no '// &
                        restart_path(prefix)//' to go on from; start without --restart', &
                        EXIT_INPUT)
    else
      path = ''
      remark = ''
    end if
    call comm%agree(status)

  end subroutine restart_file_find

  !> Collective. Everything but the header.
  subroutine write_content(file, comm, snapshot, broken)
    integer(hid_t), intent(in) :: file
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(in) :: snapshot
    logical, intent(inout) :: broken

    integer(gp), allocatable :: mine(:)
    integer :: i, j

    do i = 1, size(SCOPES)
      call create_group(file, trim(SCOPES(i)), broken)
      do j = 1, size(KINDS)
        call create_group(file, trim(SCOPES(i))//'/'//trim(KINDS(j)), broken)
      end do
    end do
    call create_group(file, CASE, broken)
    call create_group(file, NUMBERS, broken)
    do i = 1, snapshot%n_property
      call write_text(file, CASE//'/'//trim(snapshot%properties(i)%name), comm, &
                      snapshot%properties(i)%value, broken)
    end do

    call write_longs(file, NUMBERS//'/'//NODE_NUMBERS, comm, &
                     snapshot%node_key(:snapshot%n_own_node), 1, snapshot%n_own_node, broken)
    call write_longs(file, NUMBERS//'/'//CELL_NUMBERS, comm, snapshot%cell_key, 1, &
                     size(snapshot%cell_key), broken)
    allocate (mine(1))
    mine(1) = mark_of(snapshot)
    call write_longs(file, NUMBERS//'/'//PARTITION, comm, mine, 1, 1, broken)
    do i = 1, snapshot%n_entry
      call write_entry(file, comm, snapshot%n_own_node, snapshot%entries(i), broken)
    end do

  end subroutine write_content

  !> Collective. One entry.
  subroutine write_entry(file, comm, n_own_node, entry, broken)
    integer(hid_t), intent(in) :: file
    type(comm_t), intent(in) :: comm
    integer, intent(in) :: n_own_node
    type(snapshot_entry_t), intent(in) :: entry
    logical, intent(inout) :: broken

    character(len=:), allocatable :: path
    integer(gp), allocatable :: mine(:)
    integer :: n_column, n_component

    path = path_of(entry%scope, entry%kind, entry%name)
    n_column = entry%n_column
    select case (entry%scope)
    case (OF_RUN)
      ! Rank 0's values are everyone's
      if (comm%rank /= 0) n_column = 0
    case (OF_NODES)
      n_column = n_own_node
    case default
      ! All columns of all ranks
    end select
    n_component = entry%n_component
    call comm%max(n_component)

    select case (entry%kind)
    case (ENTRY_TEXT)
      call write_text(file, path, comm, entry%string, broken)
    case (ENTRY_REALS)
      call write_reals(file, path, comm, entry%reals, n_component, n_column, broken)
    case default
      call write_longs(file, path, comm, entry%integers, n_component, n_column, broken)
    end select
    if (entry%scope == OF_SOME_NODES) then
      call write_longs(file, NUMBERS//'/'//trim(entry%name), comm, entry%key, 1, n_column, broken)
    else if (entry%scope == OF_RANK) then
      allocate (mine(1))
      mine(1) = int(n_column, gp)
      call write_longs(file, NUMBERS//'/'//trim(entry%name), comm, mine, 1, 1, broken)
    end if

  end subroutine write_entry

  !> Collective. Some columns of each rank, in the order of the ranks.
  subroutine write_reals(file, path, comm, values, n_component, n_column, broken)
    integer(hid_t), intent(in) :: file
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> At least `n_component * n_column`.
    real(wp), intent(in) :: values(:)
    integer, intent(in) :: n_component
    integer, intent(in) :: n_column
    logical, intent(inout) :: broken

    real(wp), allocatable, target :: buffer(:)
    integer(gp) :: n_all, n_before

    call comm%locate(int(n_column, gp), n_before, n_all)
    allocate (buffer(max(1, n_component * n_column)))
    buffer(:n_component * n_column) = values(:n_component * n_column)
    call hdf5_write_array(file, path, H5T_NATIVE_DOUBLE, c_loc(buffer), n_component, n_before, &
                          int(n_column, gp), n_all, broken)

  end subroutine write_reals

  !> Collective. The same for integers.
  subroutine write_longs(file, path, comm, values, n_component, n_column, broken)
    integer(hid_t), intent(in) :: file
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    integer(gp), intent(in) :: values(:)
    integer, intent(in) :: n_component
    integer, intent(in) :: n_column
    logical, intent(inout) :: broken

    integer(int64), allocatable, target :: buffer(:)
    integer(gp) :: n_all, n_before

    call comm%locate(int(n_column, gp), n_before, n_all)
    allocate (buffer(max(1, n_component * n_column)))
    buffer(:n_component * n_column) = values(:n_component * n_column)
    call hdf5_write_array(file, path, h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(buffer), &
                          n_component, n_before, int(n_column, gp), n_all, broken)

  end subroutine write_longs

  !> Collective. A text, which all ranks have.
  subroutine write_text(file, path, comm, string, broken)
    integer(hid_t), intent(in) :: file
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    character(len=*), intent(in) :: string
    logical, intent(inout) :: broken

    integer(int8), allocatable, target :: buffer(:)
    integer(gp) :: n

    n = len(string, kind=gp)
    allocate (buffer(max(1, len(string))))
    buffer(:len(string)) = transfer(string, [0_int8])
    call hdf5_write_array(file, path, H5T_STD_U8LE, c_loc(buffer), 1, 0_gp, &
                          merge(n, 0_gp, comm%rank == 0), n, broken)

  end subroutine write_text

  !> Collective. Refuse the file of another case.
  subroutine compare_case(path, file, comm, snapshot, status)
    character(len=*), intent(in) :: path
    integer(hid_t), intent(in) :: file
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(in) :: snapshot
    type(status_t), intent(inout) :: status

    character(len=MEMBER_LENGTH), allocatable :: names(:)
    character(len=:), allocatable :: fault, value
    type(snapshot_t) :: there
    integer :: i
    logical :: broken

    broken = .false.
    call hdf5_members(file, CASE, names, broken)
    allocate (there%properties(0))
    do i = 1, size(names)
      call read_text(file, CASE//'/'//trim(names(i)), value, broken)
      call there%identify(trim(names(i)), value)
    end do
    call settle_reading(path, comm, broken, status)
    if (status%failed()) return
    fault = there%difference(snapshot)
    if (fault /= '') then
      call status%raise(STATUS_ERROR, 'restart_file_read', path//' belongs to another case: '// &
                        fault, EXIT_INPUT)
    end if
    call comm%agree(status)

  end subroutine compare_case

  !> Collective. All entries.
  subroutine read_content(path, file, comm, snapshot, status)
    character(len=*), intent(in) :: path
    integer(hid_t), intent(in) :: file
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(inout) :: snapshot
    type(status_t), intent(inout) :: status

    character(len=MEMBER_LENGTH), allocatable :: names(:)
    type(row_map_t) :: cell_map, node_map
    integer :: i, kind, scope
    logical :: broken, same_partition

    broken = .false.
    call read_map(file, NODE_NUMBERS, 'node', path, comm, snapshot%node_key, node_map, status)
    if (status%failed()) return
    call read_map(file, CELL_NUMBERS, 'cell', path, comm, snapshot%cell_key, cell_map, status)
    if (status%failed()) return
    call compare_partition(file, comm, snapshot, same_partition, broken)

    do scope = 1, size(SCOPES)
      if (scope == OF_RANK .and. .not. same_partition) cycle
      do kind = 1, size(KINDS)
        call hdf5_members(file, trim(SCOPES(scope))//'/'//trim(KINDS(kind)), names, broken)
        do i = 1, size(names)
          call snapshot%append(trim(names(i)), scope, kind)
          select case (scope)
          case (OF_NODES)
            call read_mapped(file, comm, node_map, size(snapshot%node_key), &
                             snapshot%entries(snapshot%n_entry), broken)
          case (OF_CELLS)
            call read_mapped(file, comm, cell_map, size(snapshot%cell_key), &
                             snapshot%entries(snapshot%n_entry), broken)
          case default
            call read_whole(file, comm, snapshot%entries(snapshot%n_entry), broken)
          end select
        end do
      end do
    end do
    call settle_reading(path, comm, broken, status)

  end subroutine read_content

  !> Collective. Where this rank's nodes or cells are in the file.
  subroutine read_map(file, name, what, path, comm, wanted, map, status)
    integer(hid_t), intent(in) :: file
    !> Of the array of numbers.
    character(len=*), intent(in) :: name
    !> `node` or `cell`.
    character(len=*), intent(in) :: what
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    integer(gp), intent(in) :: wanted(:)
    type(row_map_t), intent(out) :: map
    type(status_t), intent(inout) :: status

    integer(gp), allocatable :: number_of_row(:), slab(:, :)
    logical :: broken

    broken = .false.
    call read_slab_of_longs(file, NUMBERS//'/'//name, comm, slab, broken)
    call settle_reading(path, comm, broken, status)
    if (status%failed()) return
    allocate (number_of_row, source=slab(1, :))
    call row_map_create(comm, number_of_row, wanted, map)
    if (map%missing /= 0_gp) then
      call status%raise(STATUS_ERROR, 'restart_file_read', path//' belongs to another mesh: it '// &
                        'has no '//what//' '//long_text(map%missing), EXIT_INPUT)
    else if (map%twice /= 0_gp) then
      call status%raise(STATUS_ERROR, 'restart_file_read', path//' is of no use: its mesh has '// &
                        'two '//what//'s of number '//long_text(map%twice)//'; number them anew', &
                        EXIT_INPUT)
    end if
    call comm%agree(status)

  end subroutine read_map

  !> Collective. Whether the file was written by the same ranks, each with the same part.
  subroutine compare_partition(file, comm, snapshot, same, broken)
    integer(hid_t), intent(in) :: file
    type(comm_t), intent(in) :: comm
    type(snapshot_t), intent(in) :: snapshot
    logical, intent(out) :: same
    logical, intent(inout) :: broken

    integer(int64), allocatable, target :: buffer(:)
    integer(gp) :: agreement, n_row
    integer :: n_component

    call hdf5_array_shape(file, NUMBERS//'/'//PARTITION, n_component, n_row, broken)
    same = n_row == int(comm%size, gp)
    if (.not. same) return
    allocate (buffer(1), source=0_int64)
    call hdf5_read_array(file, NUMBERS//'/'//PARTITION, h5kind_to_type(int64, H5_INTEGER_KIND), &
                         c_loc(buffer), 1, int(comm%rank, gp), 1_gp, n_row, broken)
    agreement = merge(1_gp, 0_gp, buffer(1) == mark_of(snapshot))
    call comm%min(agreement)
    same = agreement == 1_gp

  end subroutine compare_partition

  !> Collective. An entry of nodes or cells.
  subroutine read_mapped(file, comm, map, n_column, entry, broken)
    integer(hid_t), intent(in) :: file
    type(comm_t), intent(in) :: comm
    type(row_map_t), intent(in) :: map
    !> Of this rank.
    integer, intent(in) :: n_column
    !> With name, scope and kind.
    type(snapshot_entry_t), intent(inout) :: entry
    logical, intent(inout) :: broken

    character(len=:), allocatable :: path
    integer(gp), allocatable :: long_columns(:, :), long_slab(:, :)
    real(wp), allocatable :: columns(:, :), slab(:, :)

    path = path_of(entry%scope, entry%kind, entry%name)
    if (entry%kind == ENTRY_REALS) then
      call read_slab_of_reals(file, path, comm, slab, broken)
      allocate (columns(size(slab, 1), n_column))
      call map%fetch(slab, columns)
      allocate (entry%reals, source=reshape(columns, [size(columns)]))
      entry%n_component = size(slab, 1)
    else
      call read_slab_of_longs(file, path, comm, long_slab, broken)
      allocate (long_columns(size(long_slab, 1), n_column))
      call map%fetch(long_slab, long_columns)
      allocate (entry%integers, source=reshape(long_columns, [size(long_columns)]))
      entry%n_component = size(long_slab, 1)
    end if
    entry%n_column = n_column

  end subroutine read_mapped

  !> Collective. An entry of which every rank has all columns, or its own as it wrote them.
  subroutine read_whole(file, comm, entry, broken)
    integer(hid_t), intent(in) :: file
    type(comm_t), intent(in) :: comm
    !> With name, scope and kind.
    type(snapshot_entry_t), intent(inout) :: entry
    logical, intent(inout) :: broken

    character(len=:), allocatable :: path
    integer(int64), allocatable, target :: longs(:)
    real(wp), allocatable, target :: reals(:)
    integer(gp) :: first, n_all, n_row

    path = path_of(entry%scope, entry%kind, entry%name)
    if (entry%kind == ENTRY_TEXT) then
      call read_text(file, path, entry%string, broken)
      return
    end if
    call hdf5_array_shape(file, path, entry%n_component, n_row, broken)
    first = 0_gp
    entry%n_column = int(n_row)
    if (entry%scope == OF_RANK) then
      allocate (longs(1), source=0_int64)
      call hdf5_read_array(file, NUMBERS//'/'//trim(entry%name), &
                           h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(longs), 1, &
                           int(comm%rank, gp), 1_gp, int(comm%size, gp), broken)
      entry%n_column = int(longs(1))
      deallocate (longs)
      call comm%locate(int(entry%n_column, gp), first, n_all)
    end if

    associate (n => entry%n_component * entry%n_column)
      if (entry%kind == ENTRY_REALS) then
        allocate (reals(max(1, n)), source=0.0_wp)
        call hdf5_read_array(file, path, H5T_NATIVE_DOUBLE, c_loc(reals), entry%n_component, &
                             first, int(entry%n_column, gp), n_row, broken)
        allocate (entry%reals, source=reals(:n))
      else
        allocate (longs(max(1, n)), source=0_int64)
        call hdf5_read_array(file, path, h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(longs), &
                             entry%n_component, first, int(entry%n_column, gp), n_row, broken)
        allocate (entry%integers, source=longs(:n))
      end if
      if (entry%scope == OF_SOME_NODES) then
        if (allocated(longs)) deallocate (longs)
        allocate (longs(max(1, entry%n_column)), source=0_int64)
        call hdf5_read_array(file, NUMBERS//'/'//trim(entry%name), &
                             h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(longs), 1, 0_gp, &
                             n_row, n_row, broken)
        allocate (entry%key, source=longs(:entry%n_column))
      end if
    end associate

  end subroutine read_whole

  !> Collective. This rank's slab of an array.
  subroutine read_slab_of_reals(file, path, comm, slab, broken)
    integer(hid_t), intent(in) :: file
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> Shape (n_component, rows of the slab).
    real(wp), allocatable, intent(out) :: slab(:, :)
    logical, intent(inout) :: broken

    real(wp), allocatable, target :: buffer(:)
    integer(gp) :: first, n_row
    integer :: n_component, n_local

    call hdf5_array_shape(file, path, n_component, n_row, broken)
    first = slab_start(n_row, comm%rank, comm%size)
    n_local = int(slab_start(n_row, comm%rank + 1, comm%size) - first)
    allocate (buffer(max(1, n_component * n_local)), source=0.0_wp)
    call hdf5_read_array(file, path, H5T_NATIVE_DOUBLE, c_loc(buffer), n_component, first, &
                         int(n_local, gp), n_row, broken)
    allocate (slab(n_component, n_local))
    slab = reshape(buffer(:n_component * n_local), [n_component, n_local])

  end subroutine read_slab_of_reals

  !> Collective. The same for integers.
  subroutine read_slab_of_longs(file, path, comm, slab, broken)
    integer(hid_t), intent(in) :: file
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    integer(gp), allocatable, intent(out) :: slab(:, :)
    logical, intent(inout) :: broken

    integer(int64), allocatable, target :: buffer(:)
    integer(gp) :: first, n_row
    integer :: n_component, n_local

    call hdf5_array_shape(file, path, n_component, n_row, broken)
    first = slab_start(n_row, comm%rank, comm%size)
    n_local = int(slab_start(n_row, comm%rank + 1, comm%size) - first)
    allocate (buffer(max(1, n_component * n_local)), source=0_int64)
    call hdf5_read_array(file, path, h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(buffer), &
                         n_component, first, int(n_local, gp), n_row, broken)
    allocate (slab(n_component, n_local))
    slab = reshape(buffer(:n_component * n_local), [n_component, n_local])

  end subroutine read_slab_of_longs

  !> Collective. A text, for all ranks.
  subroutine read_text(file, path, string, broken)
    integer(hid_t), intent(in) :: file
    character(len=*), intent(in) :: path
    character(len=:), allocatable, intent(out) :: string
    logical, intent(inout) :: broken

    integer(int8), allocatable, target :: buffer(:)
    integer(gp) :: n_row
    integer :: i, n_component

    call hdf5_array_shape(file, path, n_component, n_row, broken)
    allocate (buffer(max(1, int(n_row))), source=0_int8)
    call hdf5_read_array(file, path, H5T_STD_U8LE, c_loc(buffer), 1, 0_gp, n_row, n_row, broken)
    allocate (character(len=int(n_row)) :: string)
    do i = 1, len(string)
      string(i:i) = transfer(buffer(i), ' ')
    end do

  end subroutine read_text

  !> Collective. Write the header of a file that is complete, and bring it onto the disk.
  subroutine seal(path, comm, remark, status)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    character(len=*), intent(in) :: remark
    type(status_t), intent(inout) :: status

    character(len=HEADER_LENGTH) :: header
    character(len=20) :: size_text, total_text
    integer(gp) :: n_byte, total
    integer :: code, unit
    logical :: succeeded

    n_byte = 0_gp
    if (comm%rank == 0) n_byte = file_size(path)
    call comm%sum(n_byte)
    call checksum_of_file(path, n_byte, comm, total)
    if (comm%rank == 0) then
      write (size_text, '(i20)') n_byte
      write (total_text, '(i20)') total
      header = MAGIC//new_line('a')//'bytes '//size_text//new_line('a')//'checksum '// &
        total_text//new_line('a')//remark
      header(HEADER_LENGTH:) = new_line('a')
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
            action='readwrite', iostat=code)
      if (code == 0) then
        write (unit, pos=1, iostat=code) header
        close (unit)
      end if
      succeeded = code == 0
      if (succeeded) call sync_file(path, succeeded)
      if (.not. succeeded) then
        call status%raise(STATUS_ERROR, 'seal', 'cannot write '//path//': the disk may be full', &
                          EXIT_FILE)
      end if
    end if
    call comm%agree(status)

  end subroutine seal

  !> What the header says.
  subroutine parse_header(header, n_byte, total, fault)
    character(len=*), intent(in) :: header
    integer(gp), intent(out) :: n_byte
    integer(gp), intent(out) :: total
    !> Not empty when this is no header.
    character(len=:), allocatable, intent(out) :: fault

    character(len=8) :: words(2)
    integer :: code

    n_byte = 0_gp
    total = 0_gp
    fault = ''
    code = 1
    if (index(header, MAGIC//new_line('a')) == 1) then
      read (header(len(MAGIC) + 2:), *, iostat=code) words(1), n_byte, words(2), total
    end if
    if (code /= 0) fault = 'no header'

  end subroutine parse_header

  !> Collective. The sum of the checksums of all blocks behind the header, each salted with its
  !> place: the same for any number of ranks, each of which reads some.
  subroutine checksum_of_file(path, n_byte, comm, total)
    character(len=*), intent(in) :: path
    !> Of the file; the same on all ranks.
    integer(gp), intent(in) :: n_byte
    type(comm_t), intent(in) :: comm
    !> -1 when a rank could not read its part.
    integer(gp), intent(out) :: total

    integer(int8), allocatable :: buffer(:)
    integer(gp) :: first, i, last, n_block, n_failed
    integer :: code, unit

    total = 0_gp
    n_block = (max(0_gp, n_byte - HEADER_LENGTH) + BLOCK - 1_gp) / BLOCK
    open (newunit=unit, file=path, access='stream', form='unformatted', status='old', &
          action='read', iostat=code)
    if (code == 0) then
      do i = slab_start(n_block, comm%rank, comm%size), &
          slab_start(n_block, comm%rank + 1, comm%size) - 1_gp
        first = HEADER_LENGTH + i * BLOCK
        last = min(first + BLOCK, n_byte)
        if (allocated(buffer)) deallocate (buffer)
        allocate (buffer(last - first))
        read (unit, pos=first + 1_gp, iostat=code) buffer
        if (code /= 0) exit
        total = total + checksum(buffer, salt=i)
      end do
      close (unit)
    end if
    n_failed = merge(0_gp, 1_gp, code == 0)
    call comm%sum(n_failed)
    call comm%sum(total)
    if (n_failed > 0_gp) total = -1_gp

  end subroutine checksum_of_file

  !> Let a complete file take the place of the last one, and that the place of the one before.
  subroutine rotate(prefix, complete, status)
    character(len=*), intent(in) :: prefix
    character(len=*), intent(in) :: complete
    type(status_t), intent(inout) :: status

    logical :: succeeded

    succeeded = .true.
    if (file_size(restart_path(prefix)) >= 0_gp) then
      call rename_file(restart_path(prefix), previous_restart_path(prefix), succeeded)
    end if
    if (succeeded) call rename_file(complete, restart_path(prefix), succeeded)
    if (.not. succeeded) then
      call status%raise(STATUS_ERROR, 'rotate', 'cannot rename '//complete//' to '// &
                        restart_path(prefix), EXIT_FILE)
    end if

  end subroutine rotate

  !> What tells this rank's part of the mesh from another.
  pure function mark_of(snapshot) result(mark)
    type(snapshot_t), intent(in) :: snapshot
    integer(gp) :: mark

    integer :: i

    mark = int(snapshot%n_own_node, gp)
    do i = 1, size(snapshot%node_key)
      mark = checksum(bytes_of(snapshot%node_key(i)), salt=mark)
    end do
    do i = 1, size(snapshot%cell_key)
      mark = checksum(bytes_of(snapshot%cell_key(i)), salt=mark)
    end do

  end function mark_of

  !> Collective. Bytes that a file will need.
  function room_of(snapshot, comm) result(n_byte)
    type(snapshot_t), intent(in) :: snapshot
    type(comm_t), intent(in) :: comm
    integer(gp) :: n_byte

    integer :: i

    n_byte = size(snapshot%node_key, kind=gp) + size(snapshot%cell_key, kind=gp)
    do i = 1, snapshot%n_entry
      associate (entry => snapshot%entries(i))
        n_byte = n_byte + int(entry%n_component, gp) * entry%n_column
        if (allocated(entry%key)) n_byte = n_byte + entry%n_column
      end associate
    end do
    call comm%sum(n_byte)
    n_byte = n_byte * NUMBER_BYTES + snapshot%n_entry * ARRAY_OVERHEAD + FILE_OVERHEAD

  end function room_of

  !> Place of an array in the file.
  pure function path_of(scope, kind, name) result(path)
    integer, intent(in) :: scope
    integer, intent(in) :: kind
    character(len=*), intent(in) :: name
    character(len=:), allocatable :: path

    path = trim(SCOPES(scope))//'/'//trim(KINDS(kind))//'/'//trim(name)

  end function path_of

  !> Create a group.
  subroutine create_group(location, name, broken)
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    logical, intent(inout) :: broken

    integer(hid_t) :: group
    integer :: code

    call h5gcreate_f(location, name, group, code)
    call note_code(code, broken)
    call h5gclose_f(group, code)
    call note_code(code, broken)

  end subroutine create_group

  !> Collective. Turn a failure of HDF5 on any rank into a status on all.
  subroutine settle(path, comm, broken, status)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    logical, intent(in) :: broken
    type(status_t), intent(inout) :: status

    if (broken) then
      call status%raise(STATUS_ERROR, 'restart_file_write', 'cannot write '//path// &
                        ': the disk may be full', EXIT_FILE)
    end if
    call comm%agree(status)

  end subroutine settle

  !> Collective. The same after reading.
  subroutine settle_reading(path, comm, broken, status)
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    logical, intent(in) :: broken
    type(status_t), intent(inout) :: status

    if (broken) then
      call status%raise(STATUS_ERROR, 'restart_file_read', path//': it is damaged, or not from '// &
                        'this version of Swage', EXIT_FILE)
    end if
    call comm%agree(status)

  end subroutine settle_reading

  !> A long integer without blanks.
  pure function long_text(number) result(string)
    integer(gp), intent(in) :: number
    character(len=:), allocatable :: string

    character(len=20) :: buffer

    write (buffer, '(i0)') number
    string = trim(buffer)

  end function long_text

end module swage_restart_file
