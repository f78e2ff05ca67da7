!> Results as one VTKHDF file a run, for ParaView 5.12 and VTK 9.3 or later, or as files of one step
!> each, which older ones read, too.
!>
!> The file holds unstructured grids that may change in every step; each rank is a part of its own,
!> so that nodes shared by ranks appear once a part. It knows named fields, no physics.
!> Source: VTK file formats, VTKHDF 2.0, unstructured grid with temporal data; 1.0 without.
module swage_vtkhdf
  use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
  use, intrinsic :: iso_fortran_env, only: int32, int64, int8, real32
  use hdf5, only: h5dclose_f, h5dopen_f, h5fclose_f, h5gclose_f, h5gcreate_f, &
                  h5gopen_f, h5kind_to_type, hid_t, H5_INTEGER_KIND, &
                  H5T_IEEE_F32LE, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_NATIVE_REAL, &
                  H5T_STD_I32LE, H5T_STD_I64LE, H5T_STD_U8LE
  use swage_comm, only: comm_t
  use swage_disk_room, only: check_room, reserve_t
  use swage_finite, only: is_finite
  use swage_hdf5, only: hdf5_create_file, hdf5_create_table, hdf5_flush, hdf5_open_new_file, &
                        hdf5_start, hdf5_write_integers, hdf5_write_rows, hdf5_write_text, &
                        note_code, LIST
  use swage_hdf5_arrays, only: hdf5_array_shape, hdf5_open_file, hdf5_read_integers, hdf5_read_list
  use swage_kinds, only: gp, wp
  use swage_mandel, only: SQRT2
  use swage_output_path, only: describe_refusal
  use swage_result_checks, only: check_mesh, check_values
  use swage_result_copy, only: copy_results, kept_rows_t, CLOSED
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_text, only: text
  use swage_units, only: shown, units_t
  implicit none(type, external)
  private

  public :: vtkhdf_t, VTK_LINE, VTK_TRIANGLE, VTK_TETRAHEDRON

  !> VTK's numbers of the cells Swage draws.
  integer, parameter :: VTK_LINE = 3
  integer, parameter :: VTK_TRIANGLE = 5
  integer, parameter :: VTK_TETRAHEDRON = 10

  !> Tables of the mesh; also where a field lives.
  integer, parameter :: POINTS_OF = 1
  integer, parameter :: CELLS_OF = 2
  integer, parameter :: CORNERS_OF = 3
  integer, parameter :: OFFSETS_OF = 4

  !> Bounds of the rows a table allocates at a time.
  integer(gp), parameter :: MIN_CHUNK = 64_gp
  integer(gp), parameter :: MAX_CHUNK = 16384_gp

  !> Bytes of a number in double precision, or of a long integer.
  integer(gp), parameter :: DOUBLE_BYTES = 8_gp

  !> A field of the file.
  type :: field_t
    character(len=64) :: name = ''
    !> `POINTS_OF` or `CELLS_OF`.
    integer :: support = POINTS_OF
    integer :: n_component = 1
    logical :: is_integer = .false.
    !> True when the current step has it.
    logical :: is_written = .false.
  end type field_t

  !> An open result file. Owns HDF5 handles: call `close`; do not copy.
  !>
  !> A step is `begin_step`, one call a field, `end_step`. All steps hold the same fields: those of
  !> the first. Only `end_step` makes a step visible, and leaves the file complete on the disk; a
  !> step abandoned by an error is overwritten by the next one.
  !> Every binding is collective over the communicator given to `open`. Whatever fails raises
  !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks.
  type :: vtkhdf_t
    private
    type(comm_t) :: comm
    type(units_t) :: units
    character(len=:), allocatable :: path
    !> True when real fields are stored in single precision.
    logical :: is_single = .true.
    !> True when the file has a place for more than one step.
    logical :: is_temporal = .true.
    logical :: is_in_step = .false.
    !> True while the file says that it is not closed, and nothing has failed.
    logical :: is_marked = .false.
    !> True when the tables of the mesh exist.
    logical :: has_mesh = .false.
    integer(hid_t) :: file = -1_hid_t
    type(reserve_t) :: reserve
    integer(hid_t) :: root = -1_hid_t
    integer(hid_t) :: steps = -1_hid_t
    !> Groups of the fields on points and cells, and of their first rows in each step.
    integer(hid_t) :: data(2) = -1_hid_t
    integer(hid_t) :: data_offsets(2) = -1_hid_t
    type(field_t), allocatable :: fields(:)
    !> Finished steps, and their parts: one for each rank that wrote.
    integer(gp) :: n_step = 0_gp
    integer(gp) :: n_part = 0_gp
    !> Rows of the mesh tables that belong to finished steps.
    integer(gp) :: n_done(4) = 0_gp
    !> Rows of the current step: of this rank, of the ranks before it, of all ranks.
    integer(gp) :: n_local(4) = 0_gp
    integer(gp) :: n_before(4) = 0_gp
    integer(gp) :: n_total(4) = 0_gp
    !> Time of the current, then of the last step.
    real(wp) :: time = 0.0_wp
    real(wp) :: time_done = -huge(1.0_wp)
  contains
    !> Create the file; one that exists is replaced.
    procedure, public :: open => vtkhdf_open
    !> Go on behind the steps that a file held when a snapshot was taken.
    procedure, public :: resume => vtkhdf_resume
    !> Forget the steps that came after it.
    procedure, public :: rewind => vtkhdf_rewind
    !> Put into a snapshot where the file ends.
    procedure, public :: save => vtkhdf_save
    !> Attach a text about the run to the file.
    procedure, public :: describe => vtkhdf_describe
    !> Start a step with its mesh.
    procedure, public :: begin_step => vtkhdf_begin_step
    !> Write a field on the points of the current step.
    generic, public :: point_field => point_scalars, point_vectors
    !> Write a field on its cells.
    generic, public :: cell_field => cell_scalars, cell_vectors, cell_integers
    !> The same for a field of symmetric tensors.
    procedure, public :: point_tensor_field => vtkhdf_point_tensor_field
    procedure, public :: cell_tensor_field => vtkhdf_cell_tensor_field
    !> Finish the step: from now on it can be read, even if the run is killed.
    procedure, public :: end_step => vtkhdf_end_step
    !> Release every handle. Harmless when nothing is open.
    procedure, public :: close => vtkhdf_close
    procedure, private :: point_scalars
    procedure, private :: point_vectors
    procedure, private :: cell_scalars
    procedure, private :: cell_vectors
    procedure, private :: cell_integers
    procedure, private :: create_tables
    procedure, private :: admit_field
    procedure, private :: create_field
    procedure, private :: write_reals
    procedure, private :: write_mesh
    procedure, private :: write_rows_of
    procedure, private :: write_of_step
    procedure, private :: find_field
    procedure, private :: room_of_step
  end type vtkhdf_t

contains

  !> Collective. An existing file is lost only once it could be opened for writing.
  subroutine vtkhdf_open(self, path, comm, units, status, single, temporal)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> Gives the labels.
    type(units_t), intent(in) :: units
    !> `STATUS_ERROR` when the file cannot be created.
    type(status_t), intent(inout) :: status
    !> Store real fields in single precision; true when absent. Points and times are double.
    logical, intent(in), optional :: single
    !> False when the file is to hold one step, whose time only the caller knows; true when absent.
    logical, intent(in), optional :: temporal

    logical :: broken

    call self%close()
    self%comm = comm
    self%units = units
    self%path = trim(path)
    self%is_single = .true.
    if (present(single)) self%is_single = single
    self%is_temporal = .true.
    if (present(temporal)) self%is_temporal = temporal
    call check_room(self%path, room_of(0_gp), comm, status)
    if (status%failed()) return

    broken = .false.
    call hdf5_start(broken)
    if (comm%rank == 0) call hdf5_create_file(self%path, 0, broken)
    call settle_creation()
    if (.not. status%failed()) call self%reserve%take(self%path, room_of(0_gp), comm, status)
    if (status%failed()) return
    call hdf5_open_new_file(self%path, comm, .true., self%file, broken)
    call settle_creation()
    if (status%failed()) then
      call self%close()
      return
    end if

    call self%create_tables(status)

  contains

    subroutine settle_creation()
      if (broken) then
        call status%raise(STATUS_ERROR, 'vtkhdf_open', 'cannot create '//self%path//': '// &
                          describe_refusal(self%path), EXIT_FILE)
      end if
      call comm%agree(status)
    end subroutine settle_creation

  end subroutine vtkhdf_open

  subroutine vtkhdf_save(self, snapshot)
    class(vtkhdf_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    character(len=:), allocatable :: names
    integer, allocatable :: kinds(:)
    integer :: i

    names = ''
    allocate (kinds(3 * size(self%fields)))
    do i = 1, size(self%fields)
      associate (field => self%fields(i))
        kinds(3 * i - 2:3 * i) = [field%support, field%n_component, &
                                  merge(1, 0, field%is_integer)]
        names = names//field%name
      end associate
    end do
    call snapshot%put('results: counts', [self%n_step, self%n_part, self%n_done])
    call snapshot%put('results: last time', self%time_done)
    call snapshot%put('results: kinds of fields', kinds)
    call snapshot%put('results: fields', names//'|')

  end subroutine vtkhdf_save

  !> Collective. The file is compared with the snapshot and left as it is; one that was not closed,
  !> because its run was killed, is replaced by a copy of its steps up to the snapshot. A snapshot
  !> taken before the first step is of no use.
  subroutine vtkhdf_resume(self, path, comm, units, snapshot, status, single)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(units_t), intent(in) :: units
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` when the file cannot be opened, or is not that of the snapshot, grown or not.
    type(status_t), intent(inout) :: status
    !> As when the file was created.
    logical, intent(in), optional :: single

    type(kept_rows_t) :: kept
    logical :: broken, is_closed

    call self%close()
    self%comm = comm
    self%units = units
    self%path = trim(path)
    self%is_single = .true.
    if (present(single)) self%is_single = single
    self%is_temporal = .true.
    call take_fields(self, snapshot, status)
    call comm%agree(status)
    if (status%failed()) return

    call compare_file(self, is_closed, status)
    if (status%failed()) then
      call self%close()
      return
    end if
    if (.not. is_closed) then
      kept = kept_rows_t(points=self%n_done(POINTS_OF), cells=self%n_done(CELLS_OF), &
                         corners=self%n_done(CORNERS_OF), offsets=self%n_done(OFFSETS_OF), &
                         parts=self%n_part, steps=self%n_step)
      call copy_results(self%path, comm, kept, status)
      if (status%failed()) return
    end if
    broken = .false.
    call open_existing(self, .true., broken)
    if (broken) then
      call status%raise(STATUS_ERROR, 'vtkhdf_resume', self%path//' cannot be continued: it is '// &
                        'damaged, or may not be written', EXIT_FILE)
    end if
    call comm%agree(status)
    if (status%failed()) call self%close()

  end subroutine vtkhdf_resume

  !> Collective. Refuse a file that is not that of the snapshot; it is closed afterwards.
  subroutine compare_file(self, is_closed, status)
    class(vtkhdf_t), intent(inout) :: self
    !> Whether the file says that whoever wrote it has closed it; the same on all ranks.
    logical, intent(out) :: is_closed
    type(status_t), intent(inout) :: status

    integer(gp) :: mark(1), n_step(1)
    logical :: broken, is_same, is_there, is_unmarked
    integer :: answer

    answer = 0
    broken = .false.
    call hdf5_start(broken)
    call open_existing(self, .false., broken)
    if (self%file < 0_hid_t) then
      inquire (file=self%path, exist=is_there)
      if (is_there) then
        call status%raise(STATUS_ERROR, 'vtkhdf_resume', self%path//' cannot be continued: it '// &
                          'is damaged, or may not be read', EXIT_FILE)
      else
        call refuse('there is no such file')
      end if
    end if
    call self%comm%agree(status)
    if (.not. status%failed()) then
      if (.not. broken) call hdf5_read_integers(self%steps, 'NSteps', n_step, broken)
      if (.not. broken) call compare_time(self, is_same, broken)
      if (broken) then
        call refuse('it is no result file, or damaged')
      else
        if (n_step(1) < self%n_step) is_same = .false.
        if (.not. is_same) call refuse('it is that of another run')
        is_unmarked = .false.
        call hdf5_read_integers(self%file, CLOSED, mark, is_unmarked)
        if (is_unmarked .or. mark(1) /= 1_gp) answer = 1
      end if
      call self%comm%agree(status)
    end if
    call close_handles(self)
    call self%comm%max(answer)
    is_closed = answer == 0

  contains

    subroutine refuse(fault)
      character(len=*), intent(in) :: fault

      call status%raise(STATUS_ERROR, 'vtkhdf_resume', self%path//' does not belong to the '// &
                        'restart file: '//fault//'. Bring the file back, or write new results: '// &
                        '&restart from with another &output prefix', EXIT_FILE)

    end subroutine refuse

  end subroutine compare_file

  !> Collective. Open the file and its groups.
  subroutine open_existing(self, writable, broken)
    class(vtkhdf_t), intent(inout) :: self
    logical, intent(in) :: writable
    logical, intent(inout) :: broken

    call hdf5_open_file(self%path, self%comm, writable, self%file, broken)
    call open_group(self%file, 'VTKHDF', self%root, broken)
    call open_group(self%root, 'PointData', self%data(POINTS_OF), broken)
    call open_group(self%root, 'CellData', self%data(CELLS_OF), broken)
    call open_group(self%root, 'Steps', self%steps, broken)
    call open_group(self%steps, 'PointDataOffsets', self%data_offsets(POINTS_OF), broken)
    call open_group(self%steps, 'CellDataOffsets', self%data_offsets(CELLS_OF), broken)

  end subroutine open_existing

  !> What the file holds, from a snapshot.
  subroutine take_fields(self, snapshot, status)
    class(vtkhdf_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: names
    integer, allocatable :: kinds(:)
    integer(gp) :: counts(6)
    integer :: i, n

    allocate (kinds(snapshot%count('results: kinds of fields')))
    call snapshot%get('results: counts', counts, status)
    call snapshot%get('results: last time', self%time_done, status)
    call snapshot%get('results: kinds of fields', kinds, status)
    call snapshot%get('results: fields', names, status)
    if (status%failed()) return
    self%n_step = counts(1)
    self%n_part = counts(2)
    self%n_done = counts(3:6)
    self%has_mesh = self%n_step > 0_gp
    allocate (self%fields(size(kinds) / 3))
    do i = 1, size(self%fields)
      associate (field => self%fields(i))
        n = len(field%name)
        field%name = names(n * (i - 1) + 1:n * i)
        field%support = kinds(3 * i - 2)
        field%n_component = kinds(3 * i - 1)
        field%is_integer = kinds(3 * i) /= 0
      end associate
    end do

  end subroutine take_fields

  !> Collective. Whether the last step is at the time it should be.
  subroutine compare_time(self, is_same, broken)
    class(vtkhdf_t), intent(in) :: self
    logical, intent(out) :: is_same
    logical, intent(inout) :: broken

    real(wp) :: time(1)
    integer(gp) :: n_row
    integer :: n_component

    is_same = .false.
    call hdf5_array_shape(self%steps, 'Values', n_component, n_row, broken)
    if (broken .or. n_row < self%n_step .or. self%n_step == 0_gp) return
    time = 0.0_wp
    call hdf5_read_list(self%steps, 'Values', self%n_step - 1_gp, time, broken)
    is_same = abs(time(1) - self%time_done) <= 0.0_wp

  end subroutine compare_time

  subroutine vtkhdf_rewind(self, status)
    class(vtkhdf_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    logical :: broken

    broken = .false.
    ! Before anything else is changed
    call hdf5_write_integers(self%file, CLOSED, [0_gp], .false., broken)
    call hdf5_flush(self%file, broken)
    call settle(self, 'vtkhdf_rewind', broken, status)
    if (status%failed()) return
    self%is_marked = .true.
    call hdf5_write_integers(self%steps, 'NSteps', [self%n_step], .false., broken)
    call hdf5_flush(self%file, broken)
    call settle(self, 'vtkhdf_rewind', broken, status)

  end subroutine vtkhdf_rewind

  !> Groups, attributes and tables that every file has. The tables of the mesh come with the first
  !> step, whose size tells how to allocate them.
  subroutine create_tables(self, status)
    class(vtkhdf_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    character(len=*), parameter :: COUNTS(*) = [character(len=23) :: &
      'NumberOfPoints', 'NumberOfCells', 'NumberOfConnectivityIds']
    character(len=*), parameter :: LISTS(*) = [character(len=13) :: &
      'PartOffsets', 'NumberOfParts', 'PointOffsets']
    character(len=*), parameter :: COLUMNS(*) = [character(len=21) :: &
      'CellOffsets', 'ConnectivityIdOffsets']
    logical :: broken
    integer :: i

    broken = .false.
    call create_group(self%file, 'VTKHDF', self%root, broken)
    call hdf5_write_integers(self%root, 'Version', [merge(2_gp, 1_gp, self%is_temporal), 0_gp], &
                             .true., broken)
    call hdf5_write_text(self%root, 'Type', 'UnstructuredGrid', broken)
    call create_group(self%root, 'PointData', self%data(POINTS_OF), broken)
    call create_group(self%root, 'CellData', self%data(CELLS_OF), broken)
    do i = 1, size(COUNTS)
      call hdf5_create_table(self%root, trim(COUNTS(i)), H5T_STD_I64LE, LIST, MIN_CHUNK, broken)
    end do
    if (self%is_temporal) then
      call hdf5_write_integers(self%file, CLOSED, [0_gp], .true., broken)
      call create_group(self%root, 'Steps', self%steps, broken)
      call create_group(self%steps, 'PointDataOffsets', self%data_offsets(POINTS_OF), broken)
      call create_group(self%steps, 'CellDataOffsets', self%data_offsets(CELLS_OF), broken)
      call hdf5_write_integers(self%steps, 'NSteps', [0_gp], .true., broken)
      call hdf5_create_table(self%steps, 'Values', H5T_IEEE_F64LE, LIST, MIN_CHUNK, broken)
      call describe_unit(self, self%steps, 'Values', 'time', broken)
      do i = 1, size(LISTS)
        call hdf5_create_table(self%steps, trim(LISTS(i)), H5T_STD_I64LE, LIST, MIN_CHUNK, broken)
      end do
      ! VTK wants one column for each kind of cells; an unstructured grid has one kind
      do i = 1, size(COLUMNS)
        call hdf5_create_table(self%steps, trim(COLUMNS(i)), H5T_STD_I64LE, 1, MIN_CHUNK, broken)
      end do
    end if
    call settle(self, 'vtkhdf_open', broken, status)
    self%is_marked = self%is_temporal .and. .not. status%failed()

  end subroutine create_tables

  !> Attach the unit of a table that is no field.
  subroutine describe_unit(self, location, name, dimension, broken)
    class(vtkhdf_t), intent(in) :: self
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    character(len=*), intent(in) :: dimension
    logical, intent(inout) :: broken

    character(len=:), allocatable :: label
    type(status_t) :: status
    integer(hid_t) :: dataset
    integer :: code

    call self%units%get_label(dimension, label, status)
    broken = broken .or. status%failed()
    call h5dopen_f(location, name, dataset, code)
    call note_code(code, broken)
    call hdf5_write_text(dataset, 'unit', label, broken)
    call hdf5_write_text(dataset, 'dimension', dimension, broken)
    call h5dclose_f(dataset, code)
    call note_code(code, broken)

  end subroutine describe_unit

  !> Collective. The text becomes an attribute of the file's root: `title`, `dimension` ...
  subroutine vtkhdf_describe(self, key, string, status)
    class(vtkhdf_t), intent(inout) :: self
    !> Each only once.
    character(len=*), intent(in) :: key
    character(len=*), intent(in) :: string
    !> `STATUS_ERROR` when the file is not open or the key was used before.
    type(status_t), intent(inout) :: status

    logical :: broken

    if (self%root < 0_hid_t) then
      call status%raise(STATUS_ERROR, 'vtkhdf_describe', 'no result file is open', EXIT_FILE)
      return
    end if
    call self%comm%agree(status)
    if (status%failed()) return
    broken = .false.
    call hdf5_write_text(self%file, key, string, broken)
    call settle(self, 'vtkhdf_describe', broken, status)

  end subroutine vtkhdf_describe

  !> Collective. Each rank gives its part, which stands alone: cells name points of their own part
  !> only. Surfaces of tools are cells and points of rank 0's part.
  subroutine vtkhdf_begin_step(self, time, points, connectivity, offsets, types, status)
    class(vtkhdf_t), intent(inout) :: self
    !> [time]; not before the last step's.
    real(wp), intent(in) :: time
    !> Positions [length]; shape (3, n_point); the third is 0 in plane problems.
    real(wp), contiguous, intent(in) :: points(:, :)
    !> Points of the cells, one cell after the other, counted from 0.
    integer, contiguous, intent(in) :: connectivity(:)
    !> Where each cell starts in `connectivity`, from 0, and where the last one ends; shape
    !> (n_cell + 1); the single value 0 when there is no cell.
    integer, contiguous, intent(in) :: offsets(:)
    !> `VTK_TRIANGLE` and its like; shape (n_cell).
    integer, contiguous, intent(in) :: types(:)
    !> `STATUS_ERROR` when no file is open, the mesh contradicts itself, a number is not finite, or
    !> the write fails.
    type(status_t), intent(inout) :: status

    integer :: i

    if (self%root < 0_hid_t) then
      call status%raise(STATUS_ERROR, 'vtkhdf_begin_step', 'no result file is open', EXIT_FILE)
      return
    end if
    call check_mesh(points, connectivity, offsets, types, self%path, status)
    if (self%n_step > 0_gp .and. .not. self%is_temporal) then
      call status%raise(STATUS_ERROR, 'vtkhdf_begin_step', self%path// &
                        ': the file is to hold one step only', EXIT_FILE)
    else if (.not. is_finite(time)) then
      call status%raise(STATUS_ERROR, 'vtkhdf_begin_step', self%path// &
                        ': the time of the step is not a finite number', EXIT_FILE)
    else if (time < self%time_done) then
      call status%raise(STATUS_ERROR, 'vtkhdf_begin_step', self%path//': the step at time '// &
                        text(time)//' comes before the last one at '//text(self%time_done), &
                        EXIT_FILE)
    end if
    call self%comm%agree(status)
    if (status%failed()) return

    self%time = time
    self%is_in_step = .true.
    if (.not. allocated(self%fields)) allocate (self%fields(0))
    self%fields%is_written = .false.
    self%n_local = [size(points, 2, kind=gp), size(types, kind=gp), size(connectivity, kind=gp), &
                    size(offsets, kind=gp)]
    do i = 1, size(self%n_local)
      call self%comm%locate(self%n_local(i), self%n_before(i), self%n_total(i))
    end do
    call self%reserve%take(self%path, self%room_of_step(), self%comm, status)
    if (status%failed()) return
    call self%write_mesh(points, connectivity, offsets, types, status)

  end subroutine vtkhdf_begin_step

  !> Write the tables of the mesh; create them first when this is the first step.
  subroutine write_mesh(self, points, connectivity, offsets, types, status)
    class(vtkhdf_t), intent(inout) :: self
    real(wp), contiguous, intent(in) :: points(:, :)
    integer, contiguous, intent(in) :: connectivity(:)
    integer, contiguous, intent(in) :: offsets(:)
    integer, contiguous, intent(in) :: types(:)
    type(status_t), intent(inout) :: status

    integer(int64), allocatable, target :: numbers(:)
    integer(int8), allocatable, target :: kinds(:)
    real(wp), allocatable, target :: positions(:, :)
    integer(hid_t) :: long
    logical :: broken

    broken = .false.
    long = h5kind_to_type(int64, H5_INTEGER_KIND)
    if (.not. self%has_mesh) then
      call hdf5_create_table(self%root, 'Points', H5T_IEEE_F64LE, 3, &
                             chunk_of(self%n_total(POINTS_OF)), broken)
      call describe_unit(self, self%root, 'Points', 'length', broken)
      call hdf5_create_table(self%root, 'Connectivity', H5T_STD_I64LE, LIST, &
                             chunk_of(self%n_total(CORNERS_OF)), broken)
      call hdf5_create_table(self%root, 'Offsets', H5T_STD_I64LE, LIST, &
                             chunk_of(self%n_total(OFFSETS_OF)), broken)
      call hdf5_create_table(self%root, 'Types', H5T_STD_U8LE, LIST, &
                             chunk_of(self%n_total(CELLS_OF)), broken)
    end if

    ! Buffers are never of size 0, because such an array has no address
    allocate (positions(3, max(1, size(points, 2))))
    positions(:, :size(points, 2)) = points
    call self%write_rows_of(POINTS_OF, self%root, 'Points', H5T_NATIVE_DOUBLE, c_loc(positions), &
                            3, broken)
    allocate (numbers(max(1, size(connectivity), size(offsets))))
    numbers(:size(connectivity)) = int(connectivity, int64)
    call self%write_rows_of(CORNERS_OF, self%root, 'Connectivity', long, c_loc(numbers), LIST, &
                            broken)
    numbers(:size(offsets)) = int(offsets, int64)
    call self%write_rows_of(OFFSETS_OF, self%root, 'Offsets', long, c_loc(numbers), LIST, broken)
    allocate (kinds(max(1, size(types))))
    kinds(:size(types)) = int(types, int8)
    call self%write_rows_of(CELLS_OF, self%root, 'Types', H5T_STD_U8LE, c_loc(kinds), LIST, broken)
    self%has_mesh = .not. broken
    call settle(self, 'vtkhdf_begin_step', broken, status)

  end subroutine write_mesh

  !> Collective. Every step has the same fields as the first.
  subroutine point_vectors(self, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    !> Unique among the fields on points; without `/` and `.`.
    character(len=*), intent(in) :: name
    !> One column a point of this rank; shape (n_component, n_point). `n_component` is the same on
    !> all ranks and in all steps.
    real(wp), contiguous, intent(in) :: values(:, :)
    !> As `length/time`; `1` for a pure number. The file has it as an attribute, beside the label
    !> of the run's unit system; absolute temperatures are shown in degrees Celsius.
    character(len=*), intent(in) :: dimension
    !> One line for a reader who has only the file.
    character(len=*), intent(in) :: description
    !> `STATUS_ERROR`, naming the field, when a value is not finite, the dimension is unknown, the
    !> sizes do not fit, the first step did not have the field, or the write fails.
    type(status_t), intent(inout) :: status

    call self%write_reals(POINTS_OF, name, values, dimension, description, status)

  end subroutine point_vectors

  !> The same for one number a point.
  subroutine point_scalars(self, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> Shape (n_point).
    real(wp), contiguous, intent(in) :: values(:)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    call self%write_reals(POINTS_OF, name, reshape(values, [1, size(values)]), dimension, &
                          description, status)

  end subroutine point_scalars

  !> The same for cells.
  subroutine cell_vectors(self, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> Shape (n_component, n_cell).
    real(wp), contiguous, intent(in) :: values(:, :)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    call self%write_reals(CELLS_OF, name, values, dimension, description, status)

  end subroutine cell_vectors

  !> The same for one number a cell.
  subroutine cell_scalars(self, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> Shape (n_cell).
    real(wp), contiguous, intent(in) :: values(:)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    call self%write_reals(CELLS_OF, name, reshape(values, [1, size(values)]), dimension, &
                          description, status)

  end subroutine cell_scalars

  !> Symmetric tensors leave Mandel notation here and become components as VTK orders them:
  !> 11, 22, 33, 12, 23, 13.
  subroutine vtkhdf_point_tensor_field(self, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> Mandel; shape (6, n_point).
    real(wp), contiguous, intent(in) :: values(:, :)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    call self%write_reals(POINTS_OF, name, components_of(values), dimension, description, status)

  end subroutine vtkhdf_point_tensor_field

  !> The same for cells.
  subroutine vtkhdf_cell_tensor_field(self, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> Mandel; shape (6, n_cell).
    real(wp), contiguous, intent(in) :: values(:, :)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    call self%write_reals(CELLS_OF, name, components_of(values), dimension, description, status)

  end subroutine vtkhdf_cell_tensor_field

  !> Collective. One integer a cell: numbers of bodies, materials, ranks.
  subroutine cell_integers(self, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    !> Shape (n_cell).
    integer, contiguous, intent(in) :: values(:)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    integer(int32), allocatable, target :: buffer(:)
    logical :: broken
    integer :: i

    call self%admit_field(CELLS_OF, name, 1, size(values), .true., dimension, description, i, &
                          status)
    if (status%failed()) return

    allocate (buffer(max(1, size(values))))
    buffer(:size(values)) = int(values, int32)
    broken = .false.
    call self%write_rows_of(CELLS_OF, self%data(CELLS_OF), name, &
                            h5kind_to_type(int32, H5_INTEGER_KIND), c_loc(buffer), LIST, broken)
    call settle(self, 'vtkhdf_cell_field', broken, status, name)
    self%fields(i)%is_written = .not. status%failed()

  end subroutine cell_integers

  !> Write a real field of any number of components.
  subroutine write_reals(self, support, name, values, dimension, description, status)
    class(vtkhdf_t), intent(inout) :: self
    integer, intent(in) :: support
    character(len=*), intent(in) :: name
    real(wp), contiguous, intent(in) :: values(:, :)
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    real(real32), allocatable, target :: singles(:, :)
    real(wp), allocatable, target :: doubles(:, :)
    logical :: broken
    integer :: i, n, n_column

    n = size(values, 2)
    call check_values(name, values, self%is_single, self%comm%rank, status)
    call self%admit_field(support, name, size(values, 1), n, .false., dimension, description, i, &
                          status)
    if (status%failed()) return

    n_column = size(values, 1)
    if (n_column == 1) n_column = LIST
    broken = .false.
    ! HDF5 would convert, but then writes rank by rank
    if (self%is_single) then
      allocate (singles(size(values, 1), max(1, n)))
      singles(:, :n) = real(shown(values, dimension), real32)
      call self%write_rows_of(support, self%data(support), name, H5T_NATIVE_REAL, c_loc(singles), &
                              n_column, broken)
    else
      allocate (doubles(size(values, 1), max(1, n)))
      doubles(:, :n) = shown(values, dimension)
      call self%write_rows_of(support, self%data(support), name, H5T_NATIVE_DOUBLE, &
                              c_loc(doubles), n_column, broken)
    end if
    call settle(self, 'vtkhdf_field', broken, status, name)
    self%fields(i)%is_written = .not. status%failed()

  end subroutine write_reals

  !> Collective. Agree whether a field may be written now; create its tables in the first step.
  subroutine admit_field(self, support, name, n_component, n_item, is_integer, dimension, &
                         description, position, status)
    class(vtkhdf_t), intent(inout) :: self
    integer, intent(in) :: support
    character(len=*), intent(in) :: name
    integer, intent(in) :: n_component
    !> Columns given by this rank.
    integer, intent(in) :: n_item
    logical, intent(in) :: is_integer
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    !> Place in `self%fields`.
    integer, intent(out) :: position
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: fault, label
    integer :: most

    position = self%find_field(support, name)
    if (.not. self%is_in_step) then
      call status%raise(STATUS_ERROR, 'vtkhdf_field', 'field '//trim(name)//': no step has begun', &
                        EXIT_FILE)
      return
    end if

    fault = ''
    if (name == '' .or. scan(name, '/.') > 0 .or. len_trim(name) > len(self%fields%name)) then
      fault = 'a name has 1 to 64 characters and neither / nor .'
    else if (n_item /= self%n_local(support)) then
      fault = text(n_item)//' items given, but the part has '//text(int(self%n_local(support)))
    else if (position == 0 .and. self%n_step > 0_gp) then
      fault = 'the first step did not have it; all steps hold the same fields'
    else if (position > 0) then
      associate (field => self%fields(position))
        if (field%is_written) fault = 'written twice in one step'
        if (field%n_component /= n_component .or. (field%is_integer .neqv. is_integer)) then
          fault = 'not the same kind or number of components as before'
        end if
      end associate
    end if
    if (fault /= '') then
      call status%raise(STATUS_ERROR, 'vtkhdf_field', 'field '//trim(name)//': '//fault, EXIT_FILE)
    end if
    call self%units%get_label(dimension, label, status)
    call self%comm%agree(status)
    if (status%failed() .or. position > 0) return

    most = n_component
    call self%comm%max(most)
    if (most /= n_component) then
      call status%raise(STATUS_ERROR, 'vtkhdf_field', 'field '//trim(name)//': '// &
                        text(n_component)//' components on this rank, '//text(most)// &
                        ' on another', EXIT_FILE)
    end if
    call self%comm%agree(status)
    if (status%failed()) return

    call self%create_field(support, name, n_component, is_integer, dimension, label, description, &
                           status)
    position = size(self%fields)

  end subroutine admit_field

  !> Collective. Create the tables of a new field.
  subroutine create_field(self, support, name, n_component, is_integer, dimension, label, &
                          description, status)
    class(vtkhdf_t), intent(inout) :: self
    integer, intent(in) :: support
    character(len=*), intent(in) :: name
    integer, intent(in) :: n_component
    logical, intent(in) :: is_integer
    character(len=*), intent(in) :: dimension
    !> The dimension in the run's units.
    character(len=*), intent(in) :: label
    character(len=*), intent(in) :: description
    type(status_t), intent(inout) :: status

    type(field_t), allocatable :: longer(:)
    integer(hid_t) :: dataset, file_type
    logical :: broken
    integer :: code, n

    call self%reserve%take(self%path, &
                           room_of(self%n_total(support) * n_component * DOUBLE_BYTES), &
                           self%comm, status)
    if (status%failed()) return

    broken = .false.
    file_type = H5T_IEEE_F64LE
    if (self%is_single) file_type = H5T_IEEE_F32LE
    if (is_integer) file_type = H5T_STD_I32LE
    call hdf5_create_table(self%data(support), trim(name), file_type, &
                           merge(LIST, n_component, n_component == 1), &
                           chunk_of(self%n_total(support)), broken)
    call h5dopen_f(self%data(support), trim(name), dataset, code)
    call note_code(code, broken)
    call hdf5_write_text(dataset, 'unit', label, broken)
    call hdf5_write_text(dataset, 'dimension', dimension, broken)
    call hdf5_write_text(dataset, 'description', description, broken)
    call h5dclose_f(dataset, code)
    call note_code(code, broken)
    if (self%is_temporal) then
      call hdf5_create_table(self%data_offsets(support), trim(name), H5T_STD_I64LE, LIST, &
                             MIN_CHUNK, broken)
    end if
    call settle(self, 'vtkhdf_field', broken, status, name)

    n = size(self%fields)
    allocate (longer(n + 1))
    longer(:n) = self%fields
    longer(n + 1)%name = name
    longer(n + 1)%support = support
    longer(n + 1)%n_component = n_component
    longer(n + 1)%is_integer = is_integer
    call move_alloc(longer, self%fields)

  end subroutine create_field

  !> Collective. The step becomes visible last, after all it needs is on the disk.
  subroutine vtkhdf_end_step(self, status)
    class(vtkhdf_t), intent(inout) :: self
    !> `STATUS_ERROR` when no step has begun, a field of the first step is missing, or the write
    !> fails.
    type(status_t), intent(inout) :: status

    integer :: i
    logical :: broken

    if (.not. self%is_in_step) then
      call status%raise(STATUS_ERROR, 'vtkhdf_end_step', 'no step has begun', EXIT_FILE)
      return
    end if
    i = findloc(self%fields%is_written, .false., dim=1)
    if (i > 0) then
      call status%raise(STATUS_ERROR, 'vtkhdf_end_step', 'field '//trim(self%fields(i)%name)// &
                        ': missing in this step; all steps hold the same fields', EXIT_FILE)
    end if
    call self%comm%agree(status)
    if (status%failed()) return

    broken = .false.
    call self%write_of_step(broken)
    call hdf5_flush(self%file, broken)
    if (self%is_temporal) then
      call hdf5_write_integers(self%steps, 'NSteps', [self%n_step + 1_gp], .false., broken)
      call hdf5_flush(self%file, broken)
    end if
    call self%reserve%give_back(self%path)
    call settle(self, 'vtkhdf_end_step', broken, status)
    if (status%failed()) return

    self%is_in_step = .false.
    self%n_step = self%n_step + 1_gp
    self%n_part = self%n_part + self%comm%size
    self%n_done = self%n_done + self%n_total
    self%time_done = self%time

  end subroutine vtkhdf_end_step

  !> Collective. The rows that describe the step: sizes of the parts, and where all tables start.
  subroutine write_of_step(self, broken)
    class(vtkhdf_t), intent(inout) :: self
    logical, intent(inout) :: broken

    real(wp), allocatable, target :: time
    integer(gp) :: first_part
    integer :: i

    first_part = self%n_part
    call write_of_part('NumberOfPoints', self%n_local(POINTS_OF))
    call write_of_part('NumberOfCells', self%n_local(CELLS_OF))
    call write_of_part('NumberOfConnectivityIds', self%n_local(CORNERS_OF))
    if (.not. self%is_temporal) return

    allocate (time, source=self%time)
    call hdf5_write_rows(self%steps, 'Values', H5T_NATIVE_DOUBLE, c_loc(time), LIST, self%n_step, &
                         merge(1_gp, 0_gp, self%comm%rank == 0), self%n_step + 1_gp, broken)
    call write_number(self%steps, 'PartOffsets', first_part, LIST)
    call write_number(self%steps, 'NumberOfParts', int(self%comm%size, gp), LIST)
    call write_number(self%steps, 'PointOffsets', self%n_done(POINTS_OF), LIST)
    call write_number(self%steps, 'CellOffsets', self%n_done(CELLS_OF), 1)
    call write_number(self%steps, 'ConnectivityIdOffsets', self%n_done(CORNERS_OF), 1)
    do i = 1, size(self%fields)
      associate (field => self%fields(i))
        call write_number(self%data_offsets(field%support), trim(field%name), &
                          self%n_done(field%support), LIST)
      end associate
    end do

  contains

    !> One number a rank.
    subroutine write_of_part(name, value)
      character(len=*), intent(in) :: name
      integer(gp), intent(in) :: value

      integer(int64), allocatable, target :: buffer

      allocate (buffer, source=int(value, int64))
      call hdf5_write_rows(self%root, name, h5kind_to_type(int64, H5_INTEGER_KIND), &
                           c_loc(buffer), LIST, first_part + self%comm%rank, 1_gp, &
                           first_part + self%comm%size, broken)

    end subroutine write_of_part

    !> One number a step.
    subroutine write_number(group, name, value, n_component)
      integer(hid_t), intent(in) :: group
      character(len=*), intent(in) :: name
      integer(gp), intent(in) :: value
      integer, intent(in) :: n_component

      integer(int64), allocatable, target :: buffer

      allocate (buffer, source=int(value, int64))
      call hdf5_write_rows(group, name, h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(buffer), &
                           n_component, self%n_step, merge(1_gp, 0_gp, self%comm%rank == 0), &
                           self%n_step + 1_gp, broken)

    end subroutine write_number

  end subroutine write_of_step

  !> Collective. Safe after any failure. When none was, the file says that it is closed.
  subroutine vtkhdf_close(self)
    class(vtkhdf_t), intent(inout) :: self

    logical :: broken
    type(status_t) :: ignored

    if (self%is_marked) then
      broken = .false.
      call hdf5_flush(self%file, broken)
      call settle(self, 'vtkhdf_close', broken, ignored)
    end if
    ! Still, after all that it stands for is on the disk
    if (self%is_marked) then
      call hdf5_write_integers(self%file, CLOSED, [1_gp], .false., broken)
      call hdf5_flush(self%file, broken)
    end if
    self%is_marked = .false.
    call close_handles(self)
    self%is_in_step = .false.
    self%has_mesh = .false.
    if (allocated(self%fields)) deallocate (self%fields)
    self%n_step = 0_gp
    self%n_part = 0_gp
    self%n_done = 0_gp
    self%time_done = -huge(1.0_wp)

  end subroutine vtkhdf_close

  !> Collective. Close the file and its groups.
  subroutine close_handles(self)
    class(vtkhdf_t), intent(inout) :: self

    integer :: code, i

    do i = 1, 2
      call close_group(self%data(i))
      call close_group(self%data_offsets(i))
    end do
    call close_group(self%steps)
    call close_group(self%root)
    if (self%file >= 0_hid_t) then
      call h5fclose_f(self%file, code)
      call self%reserve%give_back(self%path)
    end if
    self%file = -1_hid_t

  end subroutine close_handles

  !> Write this step's rows of a table behind those of finished steps.
  subroutine write_rows_of(self, table, location, name, memory_type, buffer, n_component, broken)
    class(vtkhdf_t), intent(in) :: self
    !> `POINTS_OF` and its like: whose rows they are.
    integer, intent(in) :: table
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    integer(hid_t), intent(in) :: memory_type
    type(c_ptr), intent(in) :: buffer
    integer, intent(in) :: n_component
    logical, intent(inout) :: broken

    if (self%n_total(table) == 0_gp) return
    call hdf5_write_rows(location, trim(name), memory_type, buffer, n_component, &
                         self%n_done(table) + self%n_before(table), self%n_local(table), &
                         self%n_done(table) + self%n_total(table), broken)

  end subroutine write_rows_of

  !> Bytes to have at hand for the current step: its mesh and the fields known so far.
  pure function room_of_step(self) result(n_byte)
    class(vtkhdf_t), intent(in) :: self
    integer(gp) :: n_byte

    integer :: i

    n_byte = 3_gp * self%n_total(POINTS_OF) + sum(self%n_total)
    do i = 1, size(self%fields)
      n_byte = n_byte + self%fields(i)%n_component * self%n_total(self%fields(i)%support)
    end do
    n_byte = room_of(n_byte * DOUBLE_BYTES)

  end function room_of_step

  !> Bytes to have at hand before writing some: tables grow by whole chunks, and HDF5 writes an
  !> index, too.
  pure function room_of(n_byte) result(n_needed)
    integer(gp), intent(in) :: n_byte
    integer(gp) :: n_needed

    integer(gp), parameter :: SPARE = 262144_gp

    n_needed = 2_gp * n_byte + SPARE

  end function room_of

  !> Place of a field in the list; 0 when it is new.
  function find_field(self, support, name) result(position)
    class(vtkhdf_t), intent(in) :: self
    integer, intent(in) :: support
    character(len=*), intent(in) :: name
    integer :: position

    position = 0
    if (.not. allocated(self%fields)) return
    position = findloc(self%fields%name == name .and. self%fields%support == support, .true., dim=1)

  end function find_field

  !> Collective. Turn a failure of HDF5 on any rank into a status on all; the file will not count as
  !> closed any more.
  subroutine settle(self, origin, broken, status, name)
    class(vtkhdf_t), intent(inout) :: self
    character(len=*), intent(in) :: origin
    logical, intent(in) :: broken
    type(status_t), intent(inout) :: status
    !> The field in hand.
    character(len=*), intent(in), optional :: name

    character(len=:), allocatable :: what

    what = ''
    if (present(name)) what = ' (field '//trim(name)//')'
    if (broken) then
      call status%raise(STATUS_ERROR, origin, 'cannot write '//self%path//what// &
                        ': the disk may be full or the file damaged', EXIT_FILE)
    end if
    call self%comm%agree(status)
    if (status%failed()) self%is_marked = .false.

  end subroutine settle

  !> Create a group and leave it open.
  subroutine create_group(location, name, group, broken)
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    integer(hid_t), intent(inout) :: group
    logical, intent(inout) :: broken

    integer :: code

    call h5gcreate_f(location, name, group, code)
    call note_code(code, broken)

  end subroutine create_group

  !> Open a group that exists; once something is broken, leave it.
  subroutine open_group(location, name, group, broken)
    integer(hid_t), intent(in) :: location
    character(len=*), intent(in) :: name
    integer(hid_t), intent(inout) :: group
    logical, intent(inout) :: broken

    integer :: code

    if (broken) return
    call h5gopen_f(location, name, group, code)
    call note_code(code, broken)

  end subroutine open_group

  !> Close a group if it is open.
  subroutine close_group(group)
    integer(hid_t), intent(inout) :: group

    integer :: code

    if (group >= 0_hid_t) call h5gclose_f(group, code)
    group = -1_hid_t

  end subroutine close_group

  !> Rows to allocate at a time, from those of the first step.
  pure function chunk_of(n_row) result(n_chunk)
    integer(gp), intent(in) :: n_row
    integer(gp) :: n_chunk

    n_chunk = min(MAX_CHUNK, max(MIN_CHUNK, n_row))

  end function chunk_of

  !> Components of symmetric tensors as VTK orders them, from Mandel notation.
  pure function components_of(mandel) result(components)
    !> Shape (6, n).
    real(wp), intent(in) :: mandel(:, :)
    real(wp), allocatable :: components(:, :)

    allocate (components, source=mandel)
    components(4, :) = mandel(6, :) / SQRT2
    components(5, :) = mandel(4, :) / SQRT2
    components(6, :) = mandel(5, :) / SQRT2

  end function components_of

end module swage_vtkhdf
