!> CPU time of factors of matrices of a run: what a naive solver takes, and what kept factors do.
!>
!> usage: bench_solver CASE.nml [N]
!>
!> Takes N matrices (5 unless given) at equal distances in the run of the case, on one rank, after
!> the first iteration of an increment. The naive solver factorises the symmetric part in double
!> precision, LDL^T with pivoting, in MUMPS' own ordering PORD; analysis is not counted. Prints a
!> line for each matrix and kind of factors, then the means:
!> `factors; KIND; factorisation [s]; solution [s]; operations; entries`.
program bench_solver
  use swage, only: comm_t, environment_start, environment_stop, simulation_t, status_t, wp
  use swage_block_matrix, only: block_matrix_t
  use swage_dmumps_header, only: dmumps, dmumps_struc
  use swage_factor_layout, only: factor_layout_create, factor_layout_t, UNSYMMETRIC, &
                                 WITHOUT_PIVOTING
  use swage_kinds, only: gp
  use swage_mumps_double, only: double_factor_t => mumps_factor_t
  use swage_mumps_single, only: single_factor_t => mumps_factor_t
  implicit none(type, external)

  !> MUMPS' number of the ordering PORD.
  integer, parameter :: PORD = 4
  !> Nodes from which the kept factors have blocks of low rank, and their accuracy.
  integer, parameter :: LOW_RANK_NODES = 20000
  real(wp), parameter :: LOW_RANK = 1.0e-2_wp
  character(len=*), parameter :: KINDS(3) = [character(len=6) :: 'naive', 'direct', 'kept']
  type(comm_t) :: comm
  type(simulation_t) :: simulation
  type(status_t) :: status
  character(len=32) :: word
  real(wp) :: sums(4, 3)
  integer :: i, kind, n

  n = 5
  if (command_argument_count() > 1) then
    word = argument(2)
    read (word, *) n
  end if
  call environment_start(comm)
  if (comm%size > 1) error stop 'bench_solver measures on one rank'
  call simulation%start(argument(1), comm, status)
  sums = 0.0_wp
  do i = 1, n
    if (status%failed()) exit
    call simulation%advance_to(simulation%get_end() * (i - 0.5_wp) / n, status)
    if (.not. status%failed()) call measure(simulation, sums, status)
  end do
  do kind = 1, size(KINDS)
    call print_line('mean; '//KINDS(kind), sums(:, kind) / n)
  end do
  call simulation%finish(status)
  call environment_stop()
  if (status%failed()) error stop status%message

contains

  !> The matrix of the second iteration of the next increment, by all kinds of factors.
  subroutine measure(simulation, sums, status)
    type(simulation_t), intent(inout) :: simulation
    real(wp), intent(inout) :: sums(:, :)
    type(status_t), intent(inout) :: status

    real(wp) :: row(4)

    associate (problem => simulation%mechanics, time => simulation%get_time())
      call problem%begin_step(time, time + 0.02_wp * simulation%get_end(), .true., status)
      if (status%failed()) return
      call problem%evaluate(status)
      if (status%failed()) return
      ! This imposes the prescribed motion on the matrix
      call problem%correct(status)
      if (status%failed()) return
      call time_naive(problem%matrix, row)
      call print_line('factors; '//KINDS(1), row)
      sums(:, 1) = sums(:, 1) + row
      call time_direct(simulation, row, status)
      call print_line('factors; '//KINDS(2), row)
      sums(:, 2) = sums(:, 2) + row
      call time_kept(simulation, row, status)
      call print_line('factors; '//KINDS(3), row)
      sums(:, 3) = sums(:, 3) + row
      call problem%reject_step()
    end associate

  end subroutine measure

  subroutine time_naive(matrix, row)
    type(block_matrix_t), intent(in) :: matrix
    !> Factorisation and solution [s], operations, entries.
    real(wp), intent(out) :: row(4)

    type(dmumps_struc) :: id
    real(wp) :: block(matrix%n_slot, matrix%n_slot), start
    integer :: c, d, i, j, m
    integer(gp) :: k, n

    m = matrix%n_slot
    id%comm = comm%handle%mpi_val
    id%sym = 2
    id%par = 1
    id%job = -1
    call dmumps(id)
    id%icntl(1:3) = -1
    id%icntl(4) = 0
    id%icntl(7) = PORD
    id%icntl(14) = 100
    id%n = m * matrix%n_node
    allocate (id%irn(matrix%n_block * m**2), id%jcn(matrix%n_block * m**2), &
              id%a(matrix%n_block * m**2), id%rhs(id%n))
    n = 0_gp
    do i = 1, matrix%n_node
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1_gp
        j = matrix%column(k)
        if (i < j) cycle
        call matrix%symmetric_block(i, k, block)
        do d = 1, m
          do c = merge(d, 1, i == j), m
            n = n + 1_gp
            id%irn(n) = m * (i - 1) + c
            id%jcn(n) = m * (j - 1) + d
            id%a(n) = block(c, d)
          end do
        end do
      end do
    end do
    id%nnz = n
    id%job = 1
    call dmumps(id)
    if (id%infog(7) /= PORD) error stop 'MUMPS did not use PORD'
    start = seconds()
    id%job = 2
    call dmumps(id)
    row(1) = seconds() - start
    id%rhs = 1.0_wp
    start = seconds()
    id%job = 3
    call dmumps(id)
    row(2) = seconds() - start
    if (id%infog(1) < 0) error stop 'MUMPS fails'
    row(3) = id%rinfog(3)
    row(4) = merge(-1.0e6_wp, 1.0_wp, id%infog(29) < 0) * id%infog(29)
    deallocate (id%irn, id%jcn, id%a, id%rhs)
    id%job = -2
    call dmumps(id)

  end subroutine time_naive

  !> The factors of the solver `mumps`.
  subroutine time_direct(simulation, row, status)
    type(simulation_t), intent(in) :: simulation
    real(wp), intent(out) :: row(4)
    type(status_t), intent(inout) :: status

    type(double_factor_t) :: factor
    type(factor_layout_t) :: layout
    real(wp), allocatable :: b(:, :), x(:, :)
    real(wp) :: start

    associate (problem => simulation%mechanics)
      call factor_layout_create(comm, problem%unknowns%halo, problem%unknowns, layout, status)
      call factor%create(layout, problem%matrix, problem%matrix%version(), UNSYMMETRIC, 0.0_wp, &
                         status)
      start = seconds()
      call factor%factorise(layout, problem%matrix, status)
      row(1) = seconds() - start
      allocate (b(problem%matrix%n_slot, problem%matrix%n_node), source=1.0_wp)
      allocate (x, source=b)
      start = seconds()
      call factor%solve(layout, b, x, status)
      row(2) = seconds() - start
      call factor%get_cost(row(3), row(4))
      call factor%free()
    end associate

  end subroutine time_direct

  !> The factors of the solver `mumps_lagged`.
  subroutine time_kept(simulation, row, status)
    type(simulation_t), intent(in) :: simulation
    real(wp), intent(out) :: row(4)
    type(status_t), intent(inout) :: status

    type(factor_layout_t) :: layout
    type(single_factor_t) :: factor
    real(wp), allocatable :: b(:, :), x(:, :)
    real(wp) :: start
    integer :: i

    associate (problem => simulation%mechanics)
      call factor_layout_create(comm, problem%unknowns%halo, problem%unknowns, layout, status)
      call factor%create(layout, problem%matrix, problem%matrix%version(), WITHOUT_PIVOTING, &
                         merge(LOW_RANK, 0.0_wp, problem%matrix%n_node >= LOW_RANK_NODES), status)
      start = seconds()
      call factor%factorise(layout, problem%matrix, status)
      row(1) = seconds() - start
      allocate (b(problem%matrix%n_slot, problem%matrix%n_node), source=1.0_wp)
      allocate (x, source=b)
      start = seconds()
      do i = 1, 10
        call factor%solve(layout, b, x, status)
      end do
      row(2) = (seconds() - start) / 10
      call factor%get_cost(row(3), row(4))
      call factor%free()
    end associate

  end subroutine time_kept

  subroutine print_line(label, row)
    character(len=*), intent(in) :: label
    real(wp), intent(in) :: row(:)

    write (*, '(a,4('';'',es12.4))') label, row

  end subroutine print_line

  !> CPU time [s].
  function seconds() result(time)
    real(wp) :: time

    call cpu_time(time)

  end function seconds

  !> Of the command line.
  function argument(i) result(word)
    integer, intent(in) :: i
    character(len=:), allocatable :: word

    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(len=length) :: word)
    call get_command_argument(i, word)

  end function argument

end program bench_solver
