!> What the log says about a run: how it starts, each increment, and what it took.
module swage_run_report
  use swage_build_info, only: BUILD_COMPILER, BUILD_TYPE, SWAGE_VERSION
  use swage_case, only: case_t
  use swage_comm, only: comm_t
  use swage_field_list, only: field_list_t
  use swage_kinds, only: gp, wp
  use swage_log, only: clock_text, log_t
  use swage_mechanics, only: mechanics_t
  use swage_memory, only: peak_memory
  use swage_newton, only: newton_report_t
  use swage_number, only: number_text
  use swage_phase_times, only: phase_times_t, PHASE_NAMES, PHASE_OUTPUT
  use swage_spelling, only: listed
  use swage_status, only: status_t
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: tally_t, headline, details, steps_text, increment_line, totals, time_text, unit_of_time

  !> Counts of a run.
  type :: tally_t
    !> Accepted increments and their Newton iterations.
    integer :: n_increment = 0
    integer :: n_iteration = 0
    !> Attempts that failed, and their iterations.
    integer :: n_cut = 0
    integer :: n_failed_iteration = 0
    !> CPU time at the start [s].
    real(wp) :: cpu_start = 0.0_wp
    !> Time spent on output.
    type(phase_times_t) :: times
  end type tally_t

  character(len=1), parameter :: LINE_FEED = achar(10)

contains

  !> What is computed, in a line, after the title if there is one.
  function headline(case, path, n_rank) result(lines)
    type(case_t), intent(in) :: case
    !> Of the input file.
    character(len=*), intent(in) :: path
    integer, intent(in) :: n_rank
    character(len=:), allocatable :: lines

    lines = 'case '//path//', '//case%job%dimension//', units '//case%job%unit_system//', '// &
      text(n_rank)//' rank'
    if (n_rank > 1) lines = lines//'s'
    if (case%job%title /= '') lines = case%job%title//LINE_FEED//lines

  end function headline

  !> By what, with which numbers, and what there is to write.
  function details(case, mechanics) result(lines)
    type(case_t), intent(in) :: case
    type(mechanics_t), intent(in) :: mechanics
    character(len=:), allocatable :: lines

    type(field_list_t) :: fields

    associate (newton => case%solver%newton)
      lines = 'Swage '//SWAGE_VERSION//', '//BUILD_COMPILER//', '//BUILD_TYPE//LINE_FEED// &
        'mesh '//case%mesh%path//LINE_FEED//'tolerance of forces '// &
        number_text(newton%tolerance(1))//', of volume '//number_text(newton%tolerance(2))// &
        ', at most '//text(newton%maximum_iterations)//' iterations'
    end associate
    if (case%job%fixed_geometry) lines = lines//LINE_FEED//'fixed geometry: small strains'
    call mechanics%collect_fields(fields)
    lines = lines//LINE_FEED//'fields: '//listed(fields%names(), ', ', '')
    if (size(case%output%fields) > 0) then
      lines = lines//LINE_FEED//'written: '//listed(case%output%fields, ', ', '')
    end if

  end function details

  !> The steps, one a line.
  function steps_text(case) result(lines)
    type(case_t), intent(in) :: case
    character(len=:), allocatable :: lines

    integer :: i

    lines = ''
    do i = 1, size(case%steps)
      if (i > 1) lines = lines//LINE_FEED
      associate (step => case%steps(i))
        lines = lines//'step '''//trim(case%step_names(i))//''': '//text(step%n_increment)// &
          ' increments of '//time_text(case, step%duration / step%n_increment)
      end associate
    end do

  end function steps_text

  !> What an accepted increment needed.
  function increment_line(case, increment, time, dt, report) result(line)
    type(case_t), intent(in) :: case
    integer, intent(in) :: increment
    !> End and length of the increment [time].
    real(wp), intent(in) :: time
    real(wp), intent(in) :: dt
    type(newton_report_t), intent(in) :: report
    character(len=:), allocatable :: line

    integer :: i

    line = 'increment '//text(increment)//', time '//time_text(case, time)//', dt '// &
      time_text(case, dt)//', '//text(report%n_iteration)//' iterations, errors'
    do i = 0, report%n_iteration
      line = line//' '//brief(report%errors(1, i))//'/'//brief(report%errors(2, i))
    end do

  end function increment_line

  !> Collective. Counts, times and memory of a run so far.
  function totals(tally, case, time, comm, mechanics, log) result(lines)
    type(tally_t), intent(in) :: tally
    type(case_t), intent(in) :: case
    !> Present time [time].
    real(wp), intent(in) :: time
    type(comm_t), intent(in) :: comm
    type(mechanics_t), intent(in) :: mechanics
    !> Knows how long the run has lasted and how often it has warned.
    type(log_t), intent(in) :: log
    character(len=:), allocatable :: lines

    type(phase_times_t) :: times
    real(wp) :: cpu, memory, memory_largest, mean
    integer :: i

    call cpu_time(cpu)
    cpu = cpu - tally%cpu_start
    times = mechanics%times
    times%cpu(PHASE_OUTPUT) = tally%times%cpu(PHASE_OUTPUT)
    times%wall(PHASE_OUTPUT) = tally%times%wall(PHASE_OUTPUT)
    if (allocated(mechanics%solver)) then
      times%cpu = times%cpu + mechanics%solver%times%cpu
      times%wall = times%wall + mechanics%solver%times%wall
    end if
    memory = peak_memory()
    memory_largest = memory
    call comm%sum(cpu)
    call comm%sum(times%cpu)
    do i = 1, size(times%wall)
      call comm%max(times%wall(i))
    end do
    call comm%sum(memory)
    call comm%max(memory_largest)

    mean = real(tally%n_iteration, wp) / real(max(1, tally%n_increment), wp)
    lines = text(tally%n_increment)//' increments to time '//time_text(case, time)//', '// &
      text(tally%n_iteration)//' iterations ('//rounded(mean, 2)//' per increment), '// &
      text(tally%n_cut)//' cuts ('//text(tally%n_failed_iteration)//' iterations lost)'//LINE_FEED
    if (allocated(mechanics%solver)) then
      lines = lines//text(mechanics%solver%n_factorisation)//' factorisations, '// &
        text(mechanics%solver%n_solution)//' solutions'
      if (mechanics%solver%n_iteration > 0) then
        lines = lines//', '//text(mechanics%solver%n_iteration)//' linear iterations'
      end if
      if (mechanics%solver%n_analysis > 1) then
        lines = lines//', '//text(mechanics%solver%n_analysis)//' analyses'
      end if
      lines = lines//LINE_FEED
    end if
    lines = lines//'CPU '//rounded(cpu, 2)//' s: '//phase_text(times%cpu)//LINE_FEED// &
      'elapsed '//clock_text(log%get_elapsed())//': '//phase_text(times%wall)//LINE_FEED// &
      'peak memory '//rounded(memory, 0)//' MB in all, '//rounded(memory_largest, 0)// &
      ' MB on the largest rank'
    if (log%n_warning > 0) lines = lines//LINE_FEED//text(log%n_warning)//' warnings'

  end function totals

  !> Seconds of each phase, `cells 1.23 s, contact ...`.
  pure function phase_text(seconds) result(string)
    real(wp), intent(in) :: seconds(:)
    character(len=:), allocatable :: string

    integer :: i

    string = ''
    do i = 1, size(seconds)
      if (i > 1) string = string//', '
      string = string//trim(PHASE_NAMES(i))//' '//rounded(seconds(i), 2)//' s'
    end do

  end function phase_text

  !> A time with its unit.
  function time_text(case, time) result(string)
    type(case_t), intent(in) :: case
    real(wp), intent(in) :: time
    character(len=:), allocatable :: string

    string = number_text(time)//' '//unit_of_time(case)

  end function time_text

  !> The unit of times.
  function unit_of_time(case) result(label)
    type(case_t), intent(in) :: case
    character(len=:), allocatable :: label

    type(status_t) :: ignored

    ! 'time' is a dimension of every unit system
    call case%job%units%get_label('time', label, ignored)

  end function unit_of_time

  !> A number with as many decimals as asked for.
  pure function rounded(value, n_decimal) result(string)
    real(wp), intent(in) :: value
    integer, intent(in) :: n_decimal
    character(len=:), allocatable :: string

    character(len=32) :: buffer, format

    if (n_decimal == 0) then
      write (buffer, '(i0)') nint(value, gp)
    else
      write (format, '(a,i0,a)') '(f24.', n_decimal, ')'
      write (buffer, format) value
    end if
    string = trim(adjustl(buffer))

  end function rounded

  !> A number in two digits.
  pure function brief(value) result(string)
    real(wp), intent(in) :: value
    character(len=:), allocatable :: string

    character(len=16) :: buffer

    write (buffer, '(es8.1e2)') value
    if (index(buffer, '*') > 0) write (buffer, '(es9.1e3)') value
    string = trim(adjustl(buffer))

  end function brief

end module swage_run_report
