!> The groups of an input file that belong to the run as a whole: what is computed, on which mesh,
!> in which steps, how accurately, and what is written.
module swage_case
  use swage_cell_geometry, only: AXISYMMETRIC, PLANE_STRAIN, THREE_DIMENSIONAL
  use swage_checkpoint, only: restart_keys_t, take_restart
  use swage_deck, only: deck_t
  use swage_group, only: group_t, NAME_LENGTH
  use swage_kinds, only: wp
  use swage_linear_solver_registry, only: linear_solver_names, LINEAR_SOLVER_NAME_LENGTH
  use swage_newton, only: newton_control_t
  use swage_result_series, only: INDEX_END
  use swage_status, only: status_t, STATUS_ERROR
  use swage_step_control, only: step_grid_t, MOST_CUTS
  use swage_units, only: units_create, units_t, ROOM_TEMPERATURE
  implicit none(type, external)
  private

  public :: case_t, job_t, mesh_file_t, solver_keys_t, output_keys_t, case_from_deck
  public :: explain_job, explain_mesh, explain_step, explain_solver, explain_output

  character(len=*), parameter :: UNIT_SYSTEMS(*) = [character(len=10) :: 'SI', 'mm-tonne-s']
  character(len=*), parameter :: GEOMETRIES(*) = [character(len=7) :: 'updated', 'fixed']

  !> Names of the kinds of problem, and what they are called inside, in the same order.
  character(len=*), parameter :: DIMENSIONS(*) = [character(len=12) :: &
    'plane_strain', 'axisymmetric', '3d']
  integer, parameter :: KINDS(*) = [PLANE_STRAIN, AXISYMMETRIC, THREE_DIMENSIONAL]

  !> Longest start of a message; what is beyond is cut.
  integer, parameter :: TITLE_LENGTH = 256

  !> What `&job` says.
  type :: job_t
    character(len=:), allocatable :: title
    !> Name of the unit system, and the system.
    character(len=:), allocatable :: unit_system
    type(units_t) :: units
    !> `plane_strain`, `axisymmetric` or `3d`; the same as a number.
    character(len=:), allocatable :: dimension
    integer :: kind = THREE_DIMENSIONAL
    !> True when coordinates never move.
    logical :: fixed_geometry = .false.
    !> Kelvin, uniform [temperature].
    real(wp) :: temperature = ROOM_TEMPERATURE
  end type job_t

  !> What `&mesh` says.
  type :: mesh_file_t
    !> As seen from where the program runs.
    character(len=:), allocatable :: path
    !> Factor of all coordinates [1].
    real(wp) :: scale = 1.0_wp
    !> Start of a complaint about the file: `case.nml:3: &mesh: file = 'billet.msh'`.
    character(len=:), allocatable :: title
  end type mesh_file_t

  !> What `&solver` says.
  type :: solver_keys_t
    type(newton_control_t) :: newton
    !> One of [[linear_solver_names]].
    character(len=:), allocatable :: linear_solver
    !> Factors of the bubble's block and of the cell-wise volume term [1].
    real(wp) :: bubble_factor = 1.0_wp
    real(wp) :: grad_div = 1.0_wp
  end type solver_keys_t

  !> What `&output` says.
  type :: output_keys_t
    !> Result files are `prefix.csv` and so on.
    character(len=:), allocatable :: prefix
    !> Start of messages about it; empty when the input does not give it.
    character(len=:), allocatable :: title
    !> Points of the time grid from one result to the next.
    integer :: every = 1
    !> Fields that are written; all when empty.
    character(len=NAME_LENGTH), allocatable :: fields(:)
    !> Real fields in double precision.
    logical :: double_precision = .false.
    !> A file for each result, `prefix_0001.hdf` and on, in place of `prefix.vtkhdf`.
    logical :: per_step_files = .false.
    !> The group, for complaints about `fields`, which only the problem knows.
    type(group_t) :: group
  contains
    !> The file to open for the results.
    procedure :: result_path => output_keys_result_path
  end type output_keys_t

  !> Everything that is read here; values are checked.
  type :: case_t
    type(job_t) :: job
    type(mesh_file_t) :: mesh
    type(step_grid_t), allocatable :: steps(:)
    character(len=NAME_LENGTH), allocatable :: step_names(:)
    !> Starts of messages about them.
    character(len=TITLE_LENGTH), allocatable :: step_titles(:)
    type(solver_keys_t) :: solver
    type(output_keys_t) :: output
    type(restart_keys_t) :: restart
  end type case_t

contains

  !> Read the groups `&job`, `&mesh`, `&step`, `&solver`, `&output` and `&restart`.
  subroutine case_from_deck(deck, case, status)
    type(deck_t), intent(in) :: deck
    type(case_t), intent(out) :: case
    !> `STATUS_ERROR` when a group or key is missing, unknown or wrong.
    type(status_t), intent(inout) :: status

    type(group_t) :: group
    integer :: i, n_step

    call deck%get_only('job', group, status)
    call take_job(group, case%job)
    call group%finish(status)
    if (status%failed()) return

    call deck%get_only('mesh', group, status)
    call take_mesh(group, case%mesh)
    call group%finish(status)
    if (status%failed()) return
    case%mesh%title = group%describe('file')
    case%mesh%path = deck%resolve(case%mesh%path)

    n_step = deck%count('step')
    if (n_step == 0) then
      call status%raise(STATUS_ERROR, 'case_from_deck', deck%path//': there is no &step; add '// &
                        'one, as &step duration = 1.0, increments = 50 /')
      return
    end if
    allocate (case%steps(n_step), case%step_names(n_step), case%step_titles(n_step))
    do i = 1, n_step
      call deck%get('step', i, group)
      case%step_names(i) = group%name
      case%step_titles(i) = group%describe('increments')
      call take_step(group, case%steps(i))
      call group%finish(status)
      if (status%failed()) return
    end do

    call deck%get_only('solver', group, status)
    call take_solver(group, case%solver)
    call group%finish(status)
    if (status%failed()) return

    call deck%get_only('output', group, status)
    case%output%prefix = ''
    call take_output(group, case%output)
    call group%finish(status)
    if (status%failed()) return
    case%output%group = group
    if (case%output%prefix == '') then
      case%output%title = ''
      case%output%prefix = without_suffix(deck%path)
    else
      case%output%title = group%describe('prefix')//': '
      case%output%prefix = deck%resolve(case%output%prefix)
    end if

    call deck%get_only('restart', group, status)
    call take_restart(group, case%restart)
    call group%finish(status)
    if (status%failed()) return
    case%restart%title = ''
    if (case%restart%from /= '') then
      case%restart%title = group%describe('from')//': '
      case%restart%from = deck%resolve(case%restart%from)
    end if

  end subroutine case_from_deck

  !> The only place where the keys of `&job` are named.
  subroutine take_job(group, job)
    type(group_t), intent(inout) :: group
    type(job_t), intent(inout) :: job

    character(len=:), allocatable :: geometry
    type(status_t) :: status
    integer :: place

    job%title = ''
    job%unit_system = ''
    job%dimension = ''
    geometry = trim(GEOMETRIES(1))
    call group%take('title', job%title, 'A line about the case, for the log and the results.')
    call group%take('units', job%unit_system, 'Unit system of all numbers in the file: m, kg, '// &
                    's, Pa or mm, t, s, MPa.', choices=UNIT_SYSTEMS, required=.true.)
    call group%take('dimension', job%dimension, 'Kind of problem. Plane problems lie in x-y; '// &
                    'in an axisymmetric one x is the radius and y the axis.', &
                    choices=DIMENSIONS, required=.true.)
    call group%take('geometry', geometry, 'Whether the mesh moves with the material; with '// &
                    '''fixed'' strains and displacements are small.', choices=GEOMETRIES)
    call group%take('temperature', job%temperature, 'temperature', &
                    'Temperature of everything at the start.', above=0.0_wp)
    if (group%explaining .or. group%status%failed()) return

    call units_create(job%unit_system, job%units, status)
    if (status%failed()) call group%refuse('units', trim(status%message))
    job%fixed_geometry = geometry /= GEOMETRIES(1)
    place = findloc(DIMENSIONS == job%dimension, .true., dim=1)
    if (place > 0) job%kind = KINDS(place)

  end subroutine take_job

  !> The only place where the keys of `&mesh` are named.
  subroutine take_mesh(group, mesh)
    type(group_t), intent(inout) :: group
    type(mesh_file_t), intent(inout) :: mesh

    mesh%path = ''
    call group%take('file', mesh%path, 'Gmsh mesh (.msh, ASCII, 2.2 or 4.1), relative to the '// &
                    'folder of the input file.', required=.true.)
    call group%take('scale', mesh%scale, '1', 'Factor of all coordinates of the mesh, as '// &
                    '0.001 for a mesh drawn in mm and a case in m.', above=0.0_wp)

  end subroutine take_mesh

  !> The only place where the keys of `&step` are named.
  subroutine take_step(group, step)
    type(group_t), intent(inout) :: group
    type(step_grid_t), intent(inout) :: step

    call group%take('duration', step%duration, 'time', 'Time from the start of the step to its '// &
                    'end; steps follow each other as they stand in the file.', above=0.0_wp)
    call group%take('increments', step%n_increment, 'Number of equal increments; they are '// &
                    'shortened only where the solution or an event asks for it.', lower=1, &
                    required=.true.)
    call group%take('maximum_cuts', step%maximum_cuts, 'How often an increment may be halved '// &
                    'before the run gives up.', lower=0, upper=MOST_CUTS)

  end subroutine take_step

  !> The only place where the keys of `&solver` are named.
  subroutine take_solver(group, solver)
    type(group_t), intent(inout) :: group
    type(solver_keys_t), intent(inout) :: solver

    character(len=LINEAR_SOLVER_NAME_LENGTH), allocatable :: names(:)

    allocate (names, source=linear_solver_names())
    solver%linear_solver = trim(names(1))
    call group%take('tolerance', solver%newton%tolerance(1), '1', 'Largest unbalanced force '// &
                    'at the end of an increment, relative to internal and contact forces, and '// &
                    'the work it does by that of the increment.', &
                    above=0.0_wp, below=1.0_wp)
    call group%take('pressure_tolerance', solver%newton%tolerance(2), '1', 'The same for the '// &
                    'volume equation.', above=0.0_wp, below=1.0_wp)
    call group%take('maximum_iterations', solver%newton%maximum_iterations, 'Newton iterations '// &
                    'after which an increment is halved.', lower=1, upper=100)
    call group%take('linear_solver', solver%linear_solver, '''mumps_lagged'' keeps factors in '// &
                    'single precision over iterations and increments, and iterates with them; '// &
                    '''mumps'' factorises each matrix, unsymmetric, in double precision.', &
                    choices=names)
    call group%take('bubble_factor', solver%bubble_factor, '1', 'Factor of the stabilising '// &
                    'bubble; larger values smooth the pressure.', above=0.0_wp)
    call group%take('grad_div', solver%grad_div, '1', 'Factor of the flow stress in the term '// &
                    'that keeps the volume of each cell; 0 switches it off.', lower=0.0_wp)

  end subroutine take_solver

  !> The only place where the keys of `&output` are named.
  subroutine take_output(group, output)
    type(group_t), intent(inout) :: group
    type(output_keys_t), intent(inout) :: output

    call group%take('every', output%every, 'Increments of the time grid from one result to the '// &
                    'next; the start, the end of each step and the last state are always '// &
                    'written.', lower=1)
    call group%take_list('fields', output%fields, 'Fields to write, all by default; the log '// &
                         'lists those there are.')
    call group%take('double_precision', output%double_precision, 'Write fields in double '// &
                    'precision: files of twice the size.')
    call group%take('per_step_files', output%per_step_files, 'A file for each result, and an '// &
                    'index to open them by, as ParaView 5.11 and older need it.')
    call group%take('prefix', output%prefix, 'Start of the names of all result files, relative '// &
                    'to the folder of the input file, whose name without .nml is the default.')
    if (group%explaining) return
    if (index(output%prefix, '/', back=.true.) == max(1, len(output%prefix))) then
      call group%refuse('prefix', 'names a folder: the names of the results must start behind '// &
                        'it, as in '''//output%prefix//'case''')
    end if

  end subroutine take_output

  pure function output_keys_result_path(self) result(path)
    class(output_keys_t), intent(in) :: self
    character(len=:), allocatable :: path

    path = self%prefix//'.vtkhdf'
    if (self%per_step_files) path = self%prefix//INDEX_END

  end function output_keys_result_path

  !> Record the keys of `&job` in a group made for explaining; those below do the same.
  subroutine explain_job(group)
    type(group_t), intent(inout) :: group

    type(job_t) :: ignored

    call take_job(group, ignored)

  end subroutine explain_job

  subroutine explain_mesh(group)
    type(group_t), intent(inout) :: group

    type(mesh_file_t) :: ignored

    call take_mesh(group, ignored)

  end subroutine explain_mesh

  subroutine explain_step(group)
    type(group_t), intent(inout) :: group

    type(step_grid_t) :: ignored

    call take_step(group, ignored)

  end subroutine explain_step

  subroutine explain_solver(group)
    type(group_t), intent(inout) :: group

    type(solver_keys_t) :: ignored

    call take_solver(group, ignored)

  end subroutine explain_solver

  subroutine explain_output(group)
    type(group_t), intent(inout) :: group

    type(output_keys_t) :: ignored

    call take_output(group, ignored)

  end subroutine explain_output

  !> `folder/case` of `folder/case.nml`.
  pure function without_suffix(path) result(prefix)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: prefix

    character(len=*), parameter :: SUFFIX = '.nml'

    prefix = path
    if (len(path) <= len(SUFFIX)) return
    if (path(len(path) - len(SUFFIX) + 1:) == SUFFIX) prefix = path(:len(path) - len(SUFFIX))

  end function without_suffix

end module swage_case
