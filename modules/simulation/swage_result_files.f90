!> The files a run leaves behind: results, history and status.
module swage_result_files
  use swage_case, only: case_t
  use swage_comm, only: comm_t
  use swage_field_list, only: field_list_t, field_t, FIELD_NODAL
  use swage_file_system, only: remove_file
  use swage_group, only: group_t, NAME_LENGTH
  use swage_history, only: full_text, history_t
  use swage_kinds, only: gp, wp
  use swage_mechanics, only: mechanics_t
  use swage_mesh, only: mesh_t
  use swage_output_path, only: check_writable
  use swage_result_series, only: remove_series, result_series_t
  use swage_snapshot, only: snapshot_t
  use swage_spelling, only: did_you_mean, listed
  use swage_status, only: status_t
  use swage_status_file, only: status_file_t
  use swage_units, only: taken, units_t
  use swage_vtkhdf, only: vtkhdf_t, VTK_TETRAHEDRON, VTK_TRIANGLE
  implicit none(type, external)
  private

  public :: result_files_t, check_field_names

  !> Columns of the history that every run has, before those of the problem.
  character(len=*), parameter :: FIRST_COLUMNS(3) = [character(len=10) :: &
    'time', 'dt', 'iterations']
  character(len=*), parameter :: FIRST_DIMENSIONS(3) = [character(len=4) :: 'time', 'time', '1']

  !> The open files of a run. Owns handles: call `close`; do not copy. All bindings are collective,
  !> but for `add_attempt`.
  type :: result_files_t
    private
    type(comm_t) :: comm
    type(vtkhdf_t) :: results
    !> Files of one step each, in place of one for all.
    type(result_series_t) :: series
    logical :: per_step = .false.
    !> What every result file says of the run.
    type(units_t) :: units
    character(len=:), allocatable :: title, unit_system, dimension
    logical :: is_single = .true.
    type(history_t) :: history
    type(status_file_t) :: attempts
    !> Fields to write; all when empty.
    character(len=NAME_LENGTH), allocatable :: fields(:)
    !> Columns of the problem.
    character(len=64), allocatable :: columns(:)
    !> Time of the last result [time].
    real(wp) :: time_written = -huge(1.0_wp)
    logical :: is_open = .false.
  contains
    !> Create all files, replacing those that exist.
    procedure, public :: open => result_files_open
    !> Go on in files as they were when a snapshot was taken.
    procedure, public :: resume => result_files_resume
    !> Put into a snapshot where the files end.
    procedure, public :: save => result_files_save
    !> Add a row to the history.
    procedure, public :: add_row => result_files_add_row
    !> Add a line to the status file.
    procedure, public :: add_attempt => result_files_add_attempt
    !> Write the fields and the tools, unless that has been done for this time.
    procedure, public :: write_fields => result_files_write_fields
    !> Harmless when nothing is open.
    procedure, public :: close => result_files_close
  end type result_files_t

contains

  !> Refuse names in `&output fields` that the problem does not have.
  subroutine check_field_names(mechanics, names, group, status)
    type(mechanics_t), intent(in) :: mechanics
    character(len=*), intent(in) :: names(:)
    !> The group `&output`.
    type(group_t), intent(inout) :: group
    !> `STATUS_ERROR` at the first unknown name.
    type(status_t), intent(inout) :: status

    type(field_list_t) :: fields
    integer :: i

    if (size(names) == 0) return
    call mechanics%collect_fields(fields)
    associate (known => fields%names())
      do i = 1, size(names)
        if (fields%find(trim(names(i))) > 0) cycle
        call group%refuse('fields', 'there is no field '''//trim(names(i))//''''// &
                          did_you_mean(names(i), known)//' Fields: '//listed(known, ', ', ''))
      end do
    end associate
    call group%finish(status)

  end subroutine check_field_names

  subroutine result_files_open(self, case, comm, mechanics, status)
    class(result_files_t), intent(inout) :: self
    type(case_t), intent(in) :: case
    type(comm_t), intent(in) :: comm
    type(mechanics_t), intent(in) :: mechanics
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when a file cannot be created.
    type(status_t), intent(inout) :: status

    call prepare(self, case, comm)
    ! One refusal must not cost the files that could be opened before it
    call check_writable(case%output%prefix, comm, status)
    if (status%failed()) return
    self%is_open = .true.
    associate (prefix => case%output%prefix, units => case%job%units)
      call self%attempts%open(prefix//'.sta', comm, units, status)
      if (status%failed()) return
      call self%history%open(prefix//'.csv', comm, units, status)
      if (status%failed()) return
      call declare_columns(self, mechanics, status)
      if (status%failed()) return
      ! Results of an earlier run do not stay beside the new ones
      if (self%per_step) then
        call self%series%open(prefix, comm)
        if (comm%rank == 0) call remove_file(prefix//'.vtkhdf')
      else
        call remove_series(prefix, comm)
        call open_results(self, prefix//'.vtkhdf', status)
      end if
    end associate

  end subroutine result_files_open

  !> Nothing is changed before all files have been compared with the snapshot.
  subroutine result_files_resume(self, case, comm, mechanics, snapshot, status)
    class(result_files_t), intent(inout) :: self
    type(case_t), intent(in) :: case
    type(comm_t), intent(in) :: comm
    type(mechanics_t), intent(in) :: mechanics
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` with `EXIT_FILE`, the same on all ranks, when a file is not there, is that of
    !> another run or cannot be written.
    type(status_t), intent(inout) :: status

    call prepare(self, case, comm)
    call check_writable(case%output%prefix, comm, status)
    if (status%failed()) return
    self%is_open = .true.
    associate (prefix => case%output%prefix, units => case%job%units)
      call snapshot%get('results: written until', self%time_written, status)
      call self%attempts%check(prefix//'.sta', comm, snapshot, status)
      if (status%failed()) return
      call self%history%open(prefix//'.csv', comm, units, status, snapshot)
      if (status%failed()) return
      call declare_columns(self, mechanics, status)
      if (status%failed()) return
      if (self%per_step) then
        call self%series%resume(prefix, comm, snapshot, status)
      else
        call self%results%resume(prefix//'.vtkhdf', comm, units, snapshot, status, self%is_single)
      end if
      if (status%failed()) return
    end associate
    call self%history%resume(snapshot, status)
    if (.not. status%failed()) call self%attempts%resume(snapshot, status)
    if (.not. status%failed() .and. .not. self%per_step) call self%results%rewind(status)

  end subroutine result_files_resume

  !> What is the same for new files and old ones.
  subroutine prepare(self, case, comm)
    class(result_files_t), intent(inout) :: self
    type(case_t), intent(in) :: case
    type(comm_t), intent(in) :: comm

    call self%close()
    self%comm = comm
    self%fields = case%output%fields
    self%per_step = case%output%per_step_files
    self%units = case%job%units
    self%title = case%job%title
    self%unit_system = case%job%unit_system
    self%dimension = case%job%dimension
    self%is_single = .not. case%output%double_precision
    self%time_written = -huge(1.0_wp)

  end subroutine prepare

  !> Collective. Create a result file.
  subroutine open_results(self, path, status)
    class(result_files_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(status_t), intent(inout) :: status

    call self%results%open(path, self%comm, self%units, status, self%is_single, &
                           temporal=.not. self%per_step)
    if (status%failed()) return
    call self%results%describe('title', self%title, status)
    call self%results%describe('units', self%unit_system, status)
    call self%results%describe('dimension', self%dimension, status)

  end subroutine open_results

  !> Columns of the history: those that every run has, and those of the problem.
  subroutine declare_columns(self, mechanics, status)
    class(result_files_t), intent(inout) :: self
    type(mechanics_t), intent(in) :: mechanics
    type(status_t), intent(inout) :: status

    character(len=64), allocatable :: dimensions(:)
    integer :: i

    call mechanics%history_columns(self%columns, dimensions)
    do i = 1, size(FIRST_COLUMNS)
      call self%history%add_column(FIRST_COLUMNS(i), FIRST_DIMENSIONS(i), status)
    end do
    do i = 1, size(self%columns)
      call self%history%add_column(self%columns(i), dimensions(i), status)
    end do

  end subroutine declare_columns

  !> Collective. Create the file of one step, which says its time.
  subroutine open_for_step(self, time, status)
    class(result_files_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: time
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: label

    call self%units%get_label('time', label, status)
    call open_results(self, self%series%next_path(), status)
    if (status%failed()) return
    call self%results%describe('time', full_text(time)//' '//label, status)

  end subroutine open_for_step

  subroutine result_files_save(self, snapshot)
    class(result_files_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put('results: written until', self%time_written)
    call self%attempts%save(snapshot)
    call self%history%save(snapshot)
    if (self%per_step) then
      call self%series%save(snapshot)
    else
      call self%results%save(snapshot)
    end if

  end subroutine result_files_save

  subroutine result_files_add_row(self, mechanics, time, dt, n_iteration, status)
    class(result_files_t), intent(inout) :: self
    type(mechanics_t), intent(in) :: mechanics
    !> End and length of the increment [time].
    real(wp), intent(in) :: time
    real(wp), intent(in) :: dt
    integer, intent(in) :: n_iteration
    !> `STATUS_ERROR`, the same on all ranks, when a value is not finite or the file not writable.
    type(status_t), intent(inout) :: status

    real(wp) :: first_values(size(FIRST_COLUMNS))
    real(wp), allocatable :: values(:)
    integer :: i

    call mechanics%history_values(values)
    first_values = [time, dt, real(n_iteration, wp)]
    do i = 1, size(FIRST_COLUMNS)
      call self%history%set(FIRST_COLUMNS(i), first_values(i), status)
    end do
    do i = 1, size(self%columns)
      call self%history%set(self%columns(i), values(i), status)
    end do
    call self%history%append(status)

  end subroutine result_files_add_row

  !> Not collective.
  subroutine result_files_add_attempt(self, increment, attempt, n_iteration, time, dt, outcome)
    class(result_files_t), intent(inout) :: self
    !> Number of the increment, and how often it has been tried, from 1.
    integer, intent(in) :: increment
    integer, intent(in) :: attempt
    integer, intent(in) :: n_iteration
    !> End and length of the increment [time].
    real(wp), intent(in) :: time
    real(wp), intent(in) :: dt
    !> `done`, or why it failed.
    character(len=*), intent(in) :: outcome

    call self%attempts%append(increment, attempt, n_iteration, time, dt, outcome)

  end subroutine result_files_add_attempt

  subroutine result_files_write_fields(self, mechanics, time, status)
    class(result_files_t), intent(inout) :: self
    type(mechanics_t), intent(in) :: mechanics
    !> [time]
    real(wp), intent(in) :: time
    !> `STATUS_ERROR`, the same on all ranks, when a value is not finite or the file not writable.
    type(status_t), intent(inout) :: status

    integer, allocatable :: connectivity(:), offsets(:), types(:)
    real(wp), allocatable :: points(:, :)
    type(field_list_t) :: fields
    integer :: i

    if (.not. self%is_open .or. time <= self%time_written) return
    call draw(mechanics, points, connectivity, offsets, types)
    call mechanics%collect_fields(fields)
    if (self%per_step) call open_for_step(self, time, status)
    if (status%failed()) return
    call self%results%begin_step(time, points, connectivity, offsets, types, status)
    do i = 1, fields%n_field
      if (status%failed()) return
      if (size(self%fields) > 0 .and. all(self%fields /= fields%fields(i)%name)) cycle
      call write_field(self%results, fields%fields(i), size(points, 2), size(types), status)
    end do
    if (status%failed()) return
    call self%results%end_step(status)
    if (self%per_step .and. .not. status%failed()) then
      call self%results%close()
      call self%series%add(time, status)
    end if
    if (.not. status%failed()) self%time_written = time

  end subroutine result_files_write_fields

  subroutine result_files_close(self)
    class(result_files_t), intent(inout) :: self

    if (.not. self%is_open) return
    call self%results%close()
    call self%history%close()
    call self%attempts%close()
    self%is_open = .false.

  end subroutine result_files_close

  !> Collective. The cells of this rank and, on rank 0, the tools behind them.
  subroutine draw(mechanics, points, connectivity, offsets, types)
    type(mechanics_t), intent(in) :: mechanics
    !> As `vtkhdf_t%begin_step` wants them.
    real(wp), allocatable, intent(out) :: points(:, :)
    integer, allocatable, intent(out) :: connectivity(:)
    integer, allocatable, intent(out) :: offsets(:)
    integer, allocatable, intent(out) :: types(:)

    integer(gp), allocatable :: tool_connectivity(:), tool_offsets(:)
    integer, allocatable :: tool_types(:)
    real(wp), allocatable :: tool_points(:, :)
    integer :: i, n_cell, n_corner, n_node

    call mechanics%tool_surface(tool_points, tool_connectivity, tool_offsets, tool_types)

    associate (mesh => mechanics%mesh)
      n_node = mesh%n_node
      n_cell = mesh%n_cell
      n_corner = size(mesh%cell_node, 1)
      allocate (points(3, n_node + size(tool_points, 2)), source=0.0_wp)
      points(:mesh%dimension, :n_node) = mesh%coordinates
      points(:, n_node + 1:) = tool_points

      allocate (connectivity(n_corner * n_cell + size(tool_connectivity)))
      connectivity(:n_corner * n_cell) = reshape(mesh%cell_node - 1, [n_corner * n_cell])
      connectivity(n_corner * n_cell + 1:) = int(tool_connectivity) + n_node

      allocate (types(n_cell + size(tool_types)), &
                source=merge(VTK_TRIANGLE, VTK_TETRAHEDRON, mesh%dimension == 2))
      types(n_cell + 1:) = tool_types
    end associate

    allocate (offsets(size(types) + 1))
    do i = 0, n_cell
      offsets(i + 1) = n_corner * i
    end do
    offsets(n_cell + 1:) = n_corner * n_cell + int(tool_offsets)

  end subroutine draw

  !> Collective. Write a field, with zeros on the tools.
  subroutine write_field(results, field, n_point, n_cell, status)
    type(vtkhdf_t), intent(inout) :: results
    type(field_t), intent(in) :: field
    !> Points and cells of this rank, those of tools included.
    integer, intent(in) :: n_point
    integer, intent(in) :: n_cell
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: description, dimension, name
    real(wp), allocatable :: scalars(:), values(:, :)

    ! Workaround: gfortran 12, associating names with trim() frees them twice
    name = trim(field%name)
    dimension = trim(field%dimension)
    description = trim(field%description)
    ! Zero as the reader sees it: degrees Celsius for a temperature
    allocate (values(size(field%values, 1), &
                     merge(n_point, n_cell, field%location == FIELD_NODAL)), &
              source=taken(0.0_wp, trim(field%dimension)))
    values(:, :size(field%values, 2)) = field%values
    allocate (scalars(size(values, 2)))
    scalars = values(1, :)

    if (field%location == FIELD_NODAL) then
      if (field%is_tensor) then
        call results%point_tensor_field(name, values, dimension, description, status)
      else if (size(values, 1) == 1) then
        call results%point_field(name, scalars, dimension, description, status)
      else
        call results%point_field(name, values, dimension, description, status)
      end if
    else if (field%is_tensor) then
      call results%cell_tensor_field(name, values, dimension, description, status)
    else if (size(values, 1) == 1) then
      call results%cell_field(name, scalars, dimension, description, status)
    else
      call results%cell_field(name, values, dimension, description, status)
    end if

  end subroutine write_field

end module swage_result_files
