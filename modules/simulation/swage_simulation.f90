!> A run from its input file to its results, one increment at a time.
module swage_simulation
  use swage_body_keys, only: interfaces_from_deck
  use swage_case, only: case_from_deck, case_t
  use swage_checkpoint, only: checkpoint_t, GO_ON, SAVE_AND_GO_ON, SAVE_AND_STOP
  use swage_comm, only: comm_t
  use swage_deck, only: deck_from_text, deck_load, deck_t
  use swage_field_list, only: field_list_t
  use swage_input_reference, only: group_kinds
  use swage_kinds, only: wp
  use swage_log, only: log_t
  use swage_mechanics, only: mechanics_create, mechanics_settings_t, mechanics_t
  use swage_mesh, only: mesh_t
  use swage_mesh_distribution, only: mesh_load
  use swage_mesh_interface, only: mesh_interface_t
  use swage_cell_geometry, only: THREE_DIMENSIONAL
  use swage_newton, only: newton_report_t, newton_solve
  use swage_output_path, only: check_writable
  use swage_phase_times, only: PHASE_OUTPUT
  use swage_restart_file, only: is_restart_file_of, restart_file_find, restart_file_read, &
                                restart_file_write, restart_path
  use swage_result_files, only: check_field_names, result_files_t
  use swage_run_report, only: details, headline, increment_line, steps_text, tally_t, time_text, &
                              totals, unit_of_time
  use swage_snapshot, only: snapshot_t
  use swage_spelling, only: did_you_mean, listed
  use swage_status, only: status_t, EXIT_CONVERGENCE, EXIT_INPUT, EXIT_MESH, EXIT_STOPPED, &
                          STATUS_ERROR, STATUS_RETRY
  use swage_step_control, only: step_control_create, step_control_t
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: simulation_t

  !> Attempts at an increment that start from the rate of the last one. When they have failed, that
  !> rate may be the reason, and every other attempt starts from rest; not all, for a body that is
  !> held by friction alone is as far from rest as before however short the increment.
  integer, parameter :: EXTRAPOLATED_ATTEMPTS = 2

  !> An increment was easy when it took at most this share of the iterations that are allowed.
  real(wp), parameter :: EASY_SHARE = 0.5_wp

  !> Iterations that any increment may take and still be easy.
  integer, parameter :: ALWAYS_EASY = 4

  !> A simulation. Owns files and factors: call `finish`; do not copy.
  !>
  !> All bindings that take a `status` are collective over the communicator given to `start`, and
  !> leave the same status on all ranks. After a failure only `finish` and the queries may be
  !> called; the problem then holds the last converged state.
  type :: simulation_t
    !> The problem; for programs that read more than named fields.
    type(mechanics_t) :: mechanics
    type(comm_t), private :: comm
    type(case_t), private :: case
    type(deck_t), private :: deck
    type(log_t), private :: log
    type(result_files_t), private :: files
    type(step_control_t), private :: control
    type(tally_t), private :: tally
    type(checkpoint_t), private :: checkpoint
    !> What the run starts from, until the files are open; and the name of that file.
    type(snapshot_t), private, allocatable :: snapshot
    character(len=:), private, allocatable :: origin
    !> A warning about it.
    character(len=:), private, allocatable :: remark
    !> The run goes on in the results of the one it starts from.
    logical, private :: continues = .false.
    !> The run writes files and has not been finished.
    logical, private :: is_running = .false.
  contains
    !> Read the input, build the problem, open the files, write the start.
    procedure, public :: start => simulation_start
    !> Read and build all the same, but solve and write nothing.
    procedure, public :: check => simulation_check
    !> Advance by one accepted increment.
    procedure, public :: advance => simulation_advance
    !> Advance until a time, which is met exactly.
    procedure, public :: advance_to => simulation_advance_to
    !> Advance to the end.
    procedure, public :: run => simulation_run
    !> Write the fields of the present state.
    procedure, public :: write => simulation_write
    !> Write a restart file of the present state.
    procedure, public :: save => simulation_save
    !> Write the last state and the totals, and close everything. Harmless when called twice.
    procedure, public :: finish => simulation_finish
    !> Copy of a field of this rank.
    procedure, public :: get_field => simulation_get_field
    !> Present time [time].
    procedure, public :: get_time => simulation_get_time
    !> End of the last step [time].
    procedure, public :: get_end => simulation_get_end
    !> Accepted increments.
    procedure, public :: get_increment => simulation_get_increment
    !> Start of the names of the result files.
    procedure, public :: get_prefix => simulation_get_prefix
    !> True when all steps are done.
    procedure, public :: is_done => simulation_is_done
    procedure, private :: prepare => simulation_prepare
    procedure, private :: restore => simulation_restore
    procedure, private :: open_files => simulation_open_files
    procedure, private :: begin_results => simulation_begin_results
    procedure, private :: advance_before => simulation_advance_before
    procedure, private :: attempt => simulation_attempt
    procedure, private :: accept => simulation_accept
    procedure, private :: save_or_stop => simulation_save_or_stop
    procedure, private :: give_up => simulation_give_up
    procedure, private :: write_report => simulation_write_report
  end type simulation_t

contains

  !> Faulty input is found before any file is opened: results of an earlier run survive it.
  subroutine simulation_start(self, path, comm, status, content, prefix, echo, restart, &
                              only_if_saved)
    class(simulation_t), intent(inout) :: self
    !> Of the input file; paths in it start in its folder.
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> `STATUS_ERROR` when input or mesh are faulty or the result files cannot be created.
    type(status_t), intent(inout) :: status
    !> Text to take in place of the file, which then need not exist.
    character(len=*), intent(in), optional :: content
    !> Start of the names of the result files, in place of the one that the input gives, unless
    !> empty.
    character(len=*), intent(in), optional :: prefix
    !> Whether rank 0 prints the log and the progress; false when absent.
    logical, intent(in), optional :: echo
    !> Whether to go on from the last restart file of the same prefix, in the same results; false
    !> when absent.
    logical, intent(in), optional :: restart
    !> Begin anew where there is no restart file, which is an error when false or absent.
    logical, intent(in), optional :: only_if_saved

    character(len=:), allocatable :: doubts, problem
    logical :: prints

    call self%finish(status)
    if (status%failed()) return
    call self%prepare(path, comm, status, content, prefix, restart, only_if_saved)
    if (status%failed()) return

    prints = .false.
    if (present(echo)) prints = echo
    call self%open_files(prints, status)
    if (status%failed()) return

    call self%log%write(headline(self%case, self%deck%path, comm%size))
    call self%log%note(details(self%case, self%mechanics))
    call self%mechanics%summary(problem)
    call self%log%write(problem)
    call self%mechanics%doubts(doubts)
    if (doubts /= '') call self%log%warn(doubts)
    call self%log%write(steps_text(self%case))
    call self%log%write('results '//self%case%output%result_path()//', .csv, .sta, .log')
    call self%begin_results(status)
    if (status%failed()) return
    call self%log%start_progress(self%get_time(), self%get_end(), unit_of_time(self%case))
    call self%checkpoint%start(self%case%restart, self%case%output%prefix//'.stop', comm)

  end subroutine simulation_start

  !> The first row and the first fields, unless an earlier run has written them.
  subroutine simulation_begin_results(self, status)
    class(simulation_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    if (self%origin /= '') then
      if (self%remark /= '') call self%log%warn(self%remark)
      call self%log%write('goes on from '//self%origin//', increment '// &
                          text(self%tally%n_increment)//', time '// &
                          time_text(self%case, self%get_time()))
    end if
    call self%write_report()
    if (self%continues) return
    call self%files%add_row(self%mechanics, self%get_time(), 0.0_wp, 0, status)
    if (.not. status%failed()) call self%write(status)

  end subroutine simulation_begin_results

  subroutine simulation_check(self, path, comm, summary, status, content, prefix, restart)
    class(simulation_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    !> What was found, in a few lines.
    character(len=:), allocatable, intent(out) :: summary
    !> As of [[simulation_t:start]], without files.
    type(status_t), intent(inout) :: status
    character(len=*), intent(in), optional :: content
    !> As of [[simulation_t:start]].
    character(len=*), intent(in), optional :: prefix
    logical, intent(in), optional :: restart

    character(len=:), allocatable :: doubts, problem

    summary = ''
    call self%finish(status)
    if (status%failed()) return
    call self%prepare(path, comm, status, content, prefix, restart)
    if (status%failed()) return
    call self%mechanics%summary(problem)
    call self%mechanics%doubts(doubts)
    if (doubts /= '') problem = problem//new_line('a')//'warning: '//doubts
    summary = problem//new_line('a')//steps_text(self%case)
    if (self%origin /= '') then
      summary = summary//new_line('a')//'from '//self%origin//', time '// &
        time_text(self%case, self%get_time())
    end if
    call self%finish(status)

  end subroutine simulation_check

  !> Everything up to the first file that is written.
  subroutine simulation_prepare(self, path, comm, status, content, prefix, restart, only_if_saved)
    class(simulation_t), intent(inout) :: self
    character(len=*), intent(in) :: path
    type(comm_t), intent(in) :: comm
    type(status_t), intent(inout) :: status
    character(len=*), intent(in), optional :: content
    character(len=*), intent(in), optional :: prefix
    logical, intent(in), optional :: restart
    logical, intent(in), optional :: only_if_saved

    type(mechanics_settings_t) :: settings
    type(mesh_interface_t), allocatable :: interfaces(:)
    type(mesh_t) :: mesh
    type(status_t) :: outcome
    type(tally_t) :: nothing

    self%comm = comm
    self%tally = nothing
    call forget(self%mechanics)
    call cpu_time(self%tally%cpu_start)
    if (present(content)) then
      call deck_from_text(content, path, self%deck, status)
    else
      call deck_load(path, comm, self%deck, status)
    end if
    if (.not. status%failed()) call self%deck%check_kinds(group_kinds(), status)
    if (.not. status%failed()) call case_from_deck(self%deck, self%case, status)
    if (.not. status%failed()) call check_mesh_file(self%case, comm%rank == 0, status)
    call comm%agree(status)
    if (status%failed()) return
    if (present(prefix)) then
      if (prefix /= '') then
        self%case%output%prefix = prefix
        self%case%output%title = ''
      end if
    end if
    call spare_inputs(self%deck, self%case%output%prefix, status)
    if (status%failed()) return

    associate (job => self%case%job, solver => self%case%solver)
      call interfaces_from_deck(self%deck, interfaces, status)
      if (status%failed()) return
      call mesh_load(self%case%mesh%path, merge(3, 2, job%kind == THREE_DIMENSIONAL), &
                     self%case%mesh%scale, comm, mesh, outcome, interfaces)
      if (outcome%exit_code == EXIT_INPUT .and. outcome%failed()) then
        ! Says itself where
        call status%raise(STATUS_ERROR, 'simulation_prepare', trim(outcome%message), EXIT_INPUT)
        return
      else if (outcome%failed()) then
        call status%raise(STATUS_ERROR, 'simulation_prepare', self%case%mesh%title//': '// &
                          trim(outcome%message), outcome%exit_code)
        return
      end if
      settings%kind = job%kind
      settings%fixed_geometry = job%fixed_geometry
      settings%linear_solver = solver%linear_solver
      settings%bubble_factor = solver%bubble_factor
      settings%grad_div = solver%grad_div
      settings%initial_temperature = job%temperature
      call mechanics_create(comm, self%deck, job%unit_system, mesh, settings, self%mechanics, &
                            status)
    end associate
    call comm%agree(status)
    if (status%failed()) return

    call check_field_names(self%mechanics, self%case%output%fields, self%case%output%group, status)
    call comm%agree(status)
    self%control = step_control_create(self%case%steps)
    if (.not. status%failed()) call self%restore(status, restart, only_if_saved)

  end subroutine simulation_prepare

  !> Collective. Take the state of an earlier run, if one is asked for.
  subroutine simulation_restore(self, status, restart, only_if_saved)
    class(simulation_t), intent(inout) :: self
    type(status_t), intent(inout) :: status
    logical, intent(in), optional :: restart
    logical, intent(in), optional :: only_if_saved

    character(len=:), allocatable :: found, title
    type(status_t) :: outcome
    logical :: required

    self%origin = self%case%restart%from
    self%remark = ''
    title = self%case%restart%title
    associate (prefix => self%case%output%prefix)
      self%continues = is_restart_file_of(prefix, self%origin, self%comm)
      required = .true.
      if (present(only_if_saved)) required = .not. only_if_saved
      found = ''
      if (present(restart)) then
        if (restart) call restart_file_find(prefix, self%comm, required, found, self%remark, status)
        if (status%failed()) return
      end if
      if (found /= '') then
        self%continues = .true.
        self%origin = found
        title = ''
      end if
    end associate
    if (self%origin == '') return

    allocate (self%snapshot)
    call self%mechanics%start_snapshot(self%snapshot)
    call restart_file_read(self%origin, self%comm, self%snapshot, outcome)
    if (outcome%failed()) then
      call status%raise(STATUS_ERROR, 'simulation_restore', title//trim(outcome%message), &
                        outcome%exit_code)
      return
    end if
    call self%control%load(self%snapshot, outcome)
    call load_tally(self%tally, self%snapshot, outcome)
    call self%comm%agree(outcome)
    if (.not. outcome%failed()) call self%mechanics%load(self%snapshot, outcome)
    if (outcome%failed()) then
      call status%raise(STATUS_ERROR, 'simulation_restore', title//self%origin//': '// &
                        trim(outcome%message), outcome%exit_code)
    end if

  end subroutine simulation_restore

  !> Counts of the run.
  subroutine save_tally(tally, snapshot)
    type(tally_t), intent(in) :: tally
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put('tally', [tally%n_increment, tally%n_iteration, tally%n_cut, &
                                tally%n_failed_iteration])

  end subroutine save_tally

  subroutine load_tally(tally, snapshot, status)
    type(tally_t), intent(inout) :: tally
    type(snapshot_t), intent(in) :: snapshot
    type(status_t), intent(inout) :: status

    integer :: counts(4)

    counts = 0
    call snapshot%get('tally', counts, status)
    tally%n_increment = counts(1)
    tally%n_iteration = counts(2)
    tally%n_cut = counts(3)
    tally%n_failed_iteration = counts(4)

  end subroutine load_tally

  !> Refuse a mesh that is not there, naming the key that asks for it.
  subroutine check_mesh_file(case, looks, status)
    type(case_t), intent(in) :: case
    !> Whether this rank looks for the file; one of them does.
    logical, intent(in) :: looks
    !> `STATUS_ERROR` with `EXIT_MESH`.
    type(status_t), intent(inout) :: status

    logical :: is_there

    if (.not. looks) return
    inquire (file=case%mesh%path, exist=is_there)
    if (is_there) return
    call status%raise(STATUS_ERROR, 'check_mesh_file', case%mesh%title//': there is no file '// &
                      case%mesh%path//'; Gmsh makes it from a .geo file, as tools/run does', &
                      EXIT_MESH)

  end subroutine check_mesh_file

  !> Make a problem as good as new.
  subroutine forget(mechanics)
    type(mechanics_t), intent(out) :: mechanics

    mechanics%time = 0.0_wp

  end subroutine forget

  subroutine simulation_open_files(self, prints, status)
    class(simulation_t), intent(inout) :: self
    logical, intent(in) :: prints
    type(status_t), intent(inout) :: status

    type(status_t) :: outcome

    call check_writable(self%case%output%prefix, self%comm, outcome)
    if (outcome%failed()) then
      call status%raise(STATUS_ERROR, 'simulation_open_files', self%case%output%title// &
                        trim(outcome%message), outcome%exit_code)
      return
    end if
    self%is_running = .true.
    call self%log%open(self%case%output%prefix//'.log', self%comm%rank, prints, status, &
                       append=self%continues)
    call self%comm%agree(status)
    if (status%failed()) return
    if (self%continues) then
      call self%files%resume(self%case, self%comm, self%mechanics, self%snapshot, status)
    else
      call self%files%open(self%case, self%comm, self%mechanics, status)
    end if
    if (allocated(self%snapshot)) deallocate (self%snapshot)

  end subroutine simulation_open_files

  subroutine simulation_advance(self, status)
    class(simulation_t), intent(inout) :: self
    !> `STATUS_ERROR` when the shortest allowed increment has failed, or repeating cannot help.
    type(status_t), intent(inout) :: status

    call self%advance_before(huge(1.0_wp), status)

  end subroutine simulation_advance

  subroutine simulation_advance_to(self, time, status)
    class(simulation_t), intent(inout) :: self
    !> [time]; beyond the end it means the end, in the past nothing happens.
    real(wp), intent(in) :: time
    !> As of [[simulation_t:advance]].
    type(status_t), intent(inout) :: status

    do while (.not. self%is_done() .and. self%control%get_event_horizon() < time)
      call self%advance_before(time, status)
      if (status%failed()) return
    end do

  end subroutine simulation_advance_to

  subroutine simulation_run(self, status)
    class(simulation_t), intent(inout) :: self
    !> As of [[simulation_t:advance]].
    type(status_t), intent(inout) :: status

    do while (.not. self%is_done())
      call self%advance(status)
      if (status%failed()) return
    end do

  end subroutine simulation_run

  !> One accepted increment that does not pass a time.
  subroutine simulation_advance_before(self, time, status)
    class(simulation_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: time
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: blame
    type(newton_report_t) :: report
    type(status_t) :: outcome
    type(step_control_t) :: before
    integer :: attempt
    logical :: is_possible
    real(wp) :: event, start, target_time

    if (self%is_done()) return
    before = self%control
    start = self%get_time()
    event = min(time, self%mechanics%next_event(self%control%get_event_horizon()))
    attempt = 0
    do
      attempt = attempt + 1
      call self%control%propose(event, self%mechanics%suggested_time_step(), target_time)
      call outcome%clear()
      call self%attempt(start, target_time, attempt, report, outcome)
      call self%write_report()
      if (.not. outcome%failed()) exit

      call self%mechanics%blame_contact(blame)
      outcome%message = trim(outcome%message)//blame
      call self%mechanics%reject_step()
      self%tally%n_cut = self%tally%n_cut + 1
      self%tally%n_failed_iteration = self%tally%n_failed_iteration + report%n_iteration
      call self%files%add_attempt(self%tally%n_increment + 1, attempt, report%n_iteration, &
                                  target_time, target_time - start, 'failed: '// &
                                  trim(outcome%message))
      is_possible = outcome%severity == STATUS_RETRY
      if (is_possible) call self%control%cut(is_possible)
      if (.not. is_possible) then
        self%control = before
        call self%give_up(target_time - start, outcome, status)
        return
      end if
      call self%log%write('increment '//text(self%tally%n_increment + 1)//' cut: dt '// &
                          time_text(self%case, target_time - start)//' failed: '// &
                          trim(outcome%message))
    end do

    call self%accept(target_time, attempt, report, status)
    if (.not. status%failed()) call self%save_or_stop(status)

  end subroutine simulation_advance_before

  !> Refuse results that would overwrite a table of the input.
  pure subroutine spare_inputs(deck, prefix, status)
    type(deck_t), intent(in) :: deck
    !> Of the results.
    character(len=*), intent(in) :: prefix
    type(status_t), intent(inout) :: status

    character(len=*), parameter :: SUFFIXES(*) = [character(len=4) :: '.csv', '.sta', '.log']
    character(len=:), allocatable :: description
    integer :: i

    do i = 1, size(SUFFIXES)
      description = deck%describe_path(prefix//SUFFIXES(i))
      if (description == '') cycle
      call status%raise(STATUS_ERROR, 'spare_inputs', description//': results of this run would ' &
                        //'overwrite it: rename the file, or give them another name by &output ' &
                        //'prefix')
      return
    end do

  end subroutine spare_inputs

  !> Solve one increment, without consequences.
  subroutine simulation_attempt(self, time_old, time_new, attempt, report, status)
    class(simulation_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: time_old
    real(wp), intent(in) :: time_new
    !> From 1.
    integer, intent(in) :: attempt
    type(newton_report_t), intent(out) :: report
    !> `STATUS_RETRY` when a shorter increment may succeed.
    type(status_t), intent(inout) :: status

    logical :: extrapolate

    extrapolate = attempt <= EXTRAPOLATED_ATTEMPTS .or. mod(attempt, 2) == 0
    extrapolate = extrapolate .and. self%tally%n_increment > 0
    if (extrapolate) extrapolate = .not. self%mechanics%changes_course(time_old)
    call self%mechanics%begin_step(time_old, time_new, extrapolate, status)
    call self%comm%agree(status)
    if (status%failed()) return
    call newton_solve(self%mechanics, self%case%solver%newton, report, status)
    call self%comm%agree(status)

  end subroutine simulation_attempt

  !> Make the end of an increment the present state, and tell everyone.
  subroutine simulation_accept(self, time, attempt, report, status)
    class(simulation_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: time
    integer, intent(in) :: attempt
    type(newton_report_t), intent(in) :: report
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: warning
    integer :: most_iterations
    real(wp) :: dt

    dt = time - self%get_time()
    most_iterations = max(ALWAYS_EASY, &
                          int(EASY_SHARE * self%case%solver%newton%maximum_iterations))
    call self%mechanics%accept_step()
    call self%control%accept(report%n_iteration <= most_iterations)
    self%tally%n_increment = self%tally%n_increment + 1
    self%tally%n_iteration = self%tally%n_iteration + report%n_iteration

    call self%files%add_attempt(self%tally%n_increment, attempt, report%n_iteration, time, &
                                dt, 'done')
    call self%log%note(increment_line(self%case, self%tally%n_increment, time, dt, report))
    call self%tally%times%begin(PHASE_OUTPUT)
    call self%files%add_row(self%mechanics, time, dt, report%n_iteration, status)
    call self%tally%times%end(PHASE_OUTPUT)
    if (status%failed()) return
    if (is_due(self)) call self%write(status)
    if (status%failed()) return
    call self%log%show_progress(self%tally%n_increment, time, dt, report%n_iteration)
    call self%write_report()
    do
      call self%mechanics%find_extrapolation(warning)
      if (warning == '') exit
      call self%log%warn(warning)
    end do

  end subroutine simulation_accept

  !> An increment failed for good: keep the last converged state and say where the run stopped.
  subroutine simulation_give_up(self, dt, outcome, status)
    class(simulation_t), intent(inout) :: self
    !> Length of the last attempt [time].
    real(wp), intent(in) :: dt
    type(status_t), intent(in) :: outcome
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: place, remedy
    type(status_t) :: saved, written
    integer :: step

    step = self%control%get_step()
    place = trim(self%case%step_titles(step))//': increment '// &
      text(self%tally%n_increment + 1)//' after time '//time_text(self%case, self%get_time())
    ! The restart file first: who goes on from it drops the fields of this time
    call self%save(saved)
    call self%write(written)
    remedy = ''
    if (.not. written%failed()) then
      remedy = '; the last converged state is in '//self%case%output%result_path()
    end if
    if (.not. saved%failed()) then
      remedy = remedy//'; swage '//self%deck%path//' --restart goes on from it'
    end if
    if (outcome%severity == STATUS_RETRY) then
      call status%raise(STATUS_ERROR, 'simulation_advance', place//' failed down to dt '// &
                        time_text(self%case, dt)//' (maximum_cuts = '// &
                        text(self%case%steps(step)%maximum_cuts)//'): '// &
                        trim(outcome%message)//'. Give more increments or cuts'//remedy, &
                        EXIT_CONVERGENCE)
    else
      call status%raise(STATUS_ERROR, 'simulation_advance', place//': '// &
                        trim(outcome%message)//remedy, outcome%exit_code)
    end if

  end subroutine simulation_give_up

  !> Write a restart file when one is due, and stop when that is wanted.
  subroutine simulation_save_or_stop(self, status)
    class(simulation_t), intent(inout) :: self
    !> `STATUS_ERROR` with `EXIT_STOPPED` when the run is to stop, with `EXIT_FILE` when it cannot
    !> because the file cannot be written. A file that was only due is then a warning.
    type(status_t), intent(inout) :: status

    type(status_t) :: saved
    integer :: action

    call self%checkpoint%next(self%tally%n_increment, self%is_done(), action)
    if (action == GO_ON) return
    call self%save(saved)
    call self%checkpoint%done(action)
    if (action == SAVE_AND_GO_ON) then
      if (saved%failed()) call self%log%warn(trim(saved%message))
      return
    end if
    if (saved%failed()) then
      status = saved
      return
    end if
    call status%raise(STATUS_ERROR, 'simulation_advance', 'stopped by '// &
                      self%checkpoint%reason//' after increment '// &
                      text(self%tally%n_increment)//', time '// &
                      time_text(self%case, self%get_time())//': swage '//self%deck%path// &
                      ' --restart goes on from '//restart_path(self%case%output%prefix), &
                      EXIT_STOPPED)
    ! Only some ranks know the reason, rank 0 among them
    call self%comm%agree(status)

  end subroutine simulation_save_or_stop

  subroutine simulation_save(self, status)
    class(simulation_t), intent(inout) :: self
    !> `STATUS_ERROR` with `EXIT_FILE` when it cannot be written; earlier ones are kept.
    type(status_t), intent(inout) :: status

    type(snapshot_t) :: snapshot
    character(len=:), allocatable :: place

    call self%tally%times%begin(PHASE_OUTPUT)
    call self%mechanics%start_snapshot(snapshot)
    call self%mechanics%save(snapshot)
    call self%control%save(snapshot)
    call save_tally(self%tally, snapshot)
    call self%files%save(snapshot)
    place = 'increment '//text(self%tally%n_increment)//', time '// &
      time_text(self%case, self%get_time())
    call restart_file_write(self%case%output%prefix, self%comm, snapshot, place, status)
    call self%tally%times%end(PHASE_OUTPUT)
    if (.not. status%failed()) then
      call self%log%note('restart file '//restart_path(self%case%output%prefix)//': '//place)
    end if

  end subroutine simulation_save

  subroutine simulation_write(self, status)
    class(simulation_t), intent(inout) :: self
    !> `STATUS_ERROR` with `EXIT_FILE` when the file cannot be written.
    type(status_t), intent(inout) :: status

    call self%tally%times%begin(PHASE_OUTPUT)
    call self%files%write_fields(self%mechanics, self%get_time(), status)
    call self%tally%times%end(PHASE_OUTPUT)

  end subroutine simulation_write

  !> After a failure the log says so, and the exit code of `status` stays what it was.
  subroutine simulation_finish(self, status)
    class(simulation_t), intent(inout) :: self
    !> On entry, how the run went. `STATUS_ERROR` with `EXIT_FILE` when the end cannot be written.
    type(status_t), intent(inout) :: status

    if (self%is_running) then
      if (.not. status%failed()) call self%write(status)
      call self%log%end_progress()
      if (status%failed() .and. status%exit_code == EXIT_STOPPED) then
        call self%log%note(trim(status%message))
      else if (status%failed()) then
        call self%log%note('error: '//trim(status%message))
      end if
      call self%log%write(totals(self%tally, self%case, self%get_time(), self%comm, &
                                 self%mechanics, self%log))
    end if
    call self%files%close()
    call self%log%close()
    call self%mechanics%finish()
    if (allocated(self%snapshot)) deallocate (self%snapshot)
    self%is_running = .false.

  end subroutine simulation_finish

  subroutine simulation_get_field(self, name, values, status)
    class(simulation_t), intent(in) :: self
    character(len=*), intent(in) :: name
    !> At the present time; shape (n_component, n_node or n_cell) of this rank's part of the mesh.
    real(wp), allocatable, intent(out) :: values(:, :)
    !> `STATUS_ERROR` when there is no such field: lists those there are.
    type(status_t), intent(inout) :: status

    type(field_list_t) :: fields
    integer :: place

    call self%mechanics%collect_fields(fields)
    place = fields%find(name)
    if (place > 0) then
      call move_alloc(fields%fields(place)%values, values)
      return
    end if
    associate (known => fields%names())
      call status%raise(STATUS_ERROR, 'simulation_get_field', 'there is no field '''//name// &
                        ''''//did_you_mean(name, known)//' Fields: '//listed(known, ', ', ''))
    end associate

  end subroutine simulation_get_field

  pure function simulation_get_time(self) result(time)
    class(simulation_t), intent(in) :: self
    real(wp) :: time

    time = self%control%get_time()

  end function simulation_get_time

  pure function simulation_get_end(self) result(time)
    class(simulation_t), intent(in) :: self
    real(wp) :: time

    time = self%control%get_end()

  end function simulation_get_end

  pure function simulation_get_increment(self) result(n_increment)
    class(simulation_t), intent(in) :: self
    integer :: n_increment

    n_increment = self%tally%n_increment

  end function simulation_get_increment

  pure function simulation_get_prefix(self) result(prefix)
    class(simulation_t), intent(in) :: self
    character(len=:), allocatable :: prefix

    prefix = self%case%output%prefix

  end function simulation_get_prefix

  pure function simulation_is_done(self) result(done)
    class(simulation_t), intent(in) :: self
    logical :: done

    done = self%control%is_done()

  end function simulation_is_done

  !> Results are due at the ends of steps and every so many points of the grid.
  function is_due(self) result(due)
    class(simulation_t), intent(in) :: self
    logical :: due

    due = self%control%is_at_step_end()
    if (self%control%is_on_grid()) then
      due = due .or. mod(self%control%get_grid_count(), self%case%output%every) == 0
    end if

  end function is_due

  !> Hand what the problem has to say to the log.
  subroutine simulation_write_report(self)
    class(simulation_t), intent(inout) :: self

    character(len=:), allocatable :: report

    call self%mechanics%take_report(report)
    if (report /= '') call self%log%note(report)

  end subroutine simulation_write_report

end module swage_simulation
