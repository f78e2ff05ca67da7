!> The command line of Swage. It does nothing that another program cannot do with `use swage`.
program main
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use swage, only: comm_t, environment_start, environment_stop, explain_all_groups, &
                   explain_group, simulation_t, status_t, BUILD_COMPILER, BUILD_FLAGS, &
                   BUILD_LIBRARIES, BUILD_TYPE, EXIT_INPUT, EXIT_STOPPED, STATUS_ERROR, &
                   SWAGE_VERSION, watch_signals
  implicit none(type, external)

  !> What the user wants.
  type :: request_t
    !> `run`, `check`, `explain`, `version` or `help`.
    character(len=8) :: action = 'run'
    !> Input file, or the group to explain.
    character(len=:), allocatable :: subject
    !> Start of the names of the result files; the input decides when empty.
    character(len=:), allocatable :: prefix
    !> Go on from the last restart file; begin where there is none.
    logical :: restart = .false.
    logical :: only_if_saved = .false.
  end type request_t

  type(comm_t) :: comm
  type(request_t) :: request
  type(status_t) :: status

  call environment_start(comm)
  call read_command_line(request, status)
  if (.not. status%failed()) call carry_out(request, comm, status)
  call comm%agree(status)
  if (status%failed() .and. comm%rank == 0) then
    flush (output_unit)
    if (status%exit_code == EXIT_STOPPED) then
      write (error_unit, '(2a)') 'swage: ', trim(status%message)
    else
      write (error_unit, '(2a)') 'swage: error: ', trim(status%message)
    end if
    flush (error_unit)
  end if
  call environment_stop()
  if (status%failed()) stop status%exit_code, quiet=.true.

contains

  subroutine carry_out(request, comm, status)
    type(request_t), intent(in) :: request
    type(comm_t), intent(in) :: comm
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: page

    select case (request%action)
    case ('help')
      if (comm%rank == 0) call print_help()
    case ('version')
      if (comm%rank == 0) call print_version()
    case ('explain')
      if (request%subject == '') then
        page = explain_all_groups()
      else
        call explain_group(request%subject, page, status)
      end if
      if (comm%rank == 0) write (output_unit, '(a)', advance='no') page
    case ('check')
      call check_case(request, comm, status)
    case default
      call run_case(request, comm, status)
    end select

  end subroutine carry_out

  subroutine run_case(request, comm, status)
    type(request_t), intent(in) :: request
    type(comm_t), intent(in) :: comm
    type(status_t), intent(inout) :: status

    type(simulation_t) :: simulation

    call watch_signals()
    call simulation%start(request%subject, comm, status, prefix=request%prefix, echo=.true., &
                          restart=request%restart, only_if_saved=request%only_if_saved)
    if (.not. status%failed()) call simulation%run(status)
    call simulation%finish(status)

  end subroutine run_case

  subroutine check_case(request, comm, status)
    type(request_t), intent(in) :: request
    type(comm_t), intent(in) :: comm
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: summary
    type(simulation_t) :: simulation

    call simulation%check(request%subject, comm, summary, status, prefix=request%prefix, &
                          restart=request%restart)
    if (.not. status%failed() .and. comm%rank == 0) then
      write (output_unit, '(a)') request%subject//': no faults found', summary
    end if
    call simulation%finish(status)

  end subroutine check_case

  subroutine read_command_line(request, status)
    type(request_t), intent(out) :: request
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: word
    integer :: i

    request%subject = ''
    request%prefix = ''
    if (command_argument_count() == 0) request%action = 'help'
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
      select case (word)
      case ('--help', '-h')
        request%action = 'help'
        return
      case ('--version')
        request%action = 'version'
        return
      case ('--explain')
        request%action = 'explain'
      case ('--check')
        request%action = 'check'
      case ('--restart')
        request%restart = .true.
      case ('--continue')
        request%restart = .true.
        request%only_if_saved = .true.
      case ('--output')
        i = i + 1
        request%prefix = argument(i)
        if (request%prefix == '') call complain(status, '--output needs a PREFIX')
      case default
        if (index(word, '-') == 1) call complain(status, 'unknown option '//word)
        if (request%subject /= '') then
          call complain(status, 'one argument too many: '//word)
        end if
        request%subject = word
      end select
    end do
    if (request%subject == '' .and. (request%action == 'run' .or. request%action == 'check')) then
      call complain(status, 'no input file given')
    end if

  end subroutine read_command_line

  subroutine complain(status, what)
    type(status_t), intent(inout) :: status
    character(len=*), intent(in) :: what

    call status%raise(STATUS_ERROR, 'read_command_line', what//'; see swage --help', EXIT_INPUT)

  end subroutine complain

  !> An argument of the command line; empty beyond the last.
  function argument(i) result(word)
    integer, intent(in) :: i
    character(len=:), allocatable :: word

    integer :: length

    if (i > command_argument_count()) then
      word = ''
      return
    end if
    call get_command_argument(i, length=length)
    allocate (character(len=length) :: word)
    call get_command_argument(i, word)

  end function argument

  subroutine print_help()

    write (output_unit, '(a)') &
      'Swage: metal forming by finite elements', &
      '', &
      '  swage CASE.nml [--output PREFIX]   run a case; results are PREFIX.vtkhdf, .csv, .sta', &
      '                                     and .log (PREFIX: the case without .nml)', &
      '  swage CASE.nml --restart           go on from the last PREFIX.restart.h5, in the same', &
      '                                     results; ways to ask for one: --explain restart', &
      '  swage CASE.nml --continue          the same, but begin where there is no restart file', &
      '  swage CASE.nml --check             read the case and its mesh, report faults', &
      '  swage --explain [GROUP]            the groups of the input file, the keys of one', &
      '  swage --version                    version, compiler and libraries', &
      '  swage --help                       this page', &
      '', &
      'Several ranks: mpirun -n 4 swage CASE.nml', &
      'Exit codes: 0 done, 2 input, 3 mesh, 4 no convergence, 5 linear solver or memory, 6 files', &
      '75 stopped on request, go on with --restart'

  end subroutine print_help

  subroutine print_version()

    integer :: i

    write (output_unit, '(a)') 'swage '//SWAGE_VERSION, 'compiler: '//BUILD_COMPILER, &
      'build: '//BUILD_TYPE, 'flags: '//BUILD_FLAGS
    do i = 1, size(BUILD_LIBRARIES)
      write (output_unit, '(a)') trim(BUILD_LIBRARIES(i))
    end do

  end subroutine print_version

end program main
