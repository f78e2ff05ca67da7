!> CPU time of contact between two bodies, by the number of facets and by what is done.
!>
!> usage: bench_contact FORMULATION LEAST MOST
!>
!> FORMULATION is `nodal` (master/slave) or `l2` (quasi-symmetric). The slave, a wavy sheet of
!> triangles with LEAST facets along a side, then twice as many, up to MOST, lies a little deep in a
!> master of other cells. Prints a line for each size: facets of the slave, then nanoseconds for
!> each of them: the start of a step (areas, sectors, trees, what counts), new positions in an
!> iteration (normals, boxes of the trees), the search for what is opposite, conditions made of
!> that, their own stiffness, forces and the stiffness of penalties, and adding all blocks to a
!> matrix that has them. Of a few repetitions the smallest counts.
program bench_contact
  use swage_body_contact, only: body_contact_create, body_contact_t
  use swage_comm, only: comm_t
  use swage_contact_conditions, only: condition_list_t, node_conditions
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_formulation_registry, only: contact_formulation_create
  use swage_contact_overlap, only: contact_overlap_t, find_overlap
  use swage_contact_pair, only: contact_pair_create, contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_state, only: enforcement_t
  use swage_contact_surface, only: DEFAULT_FEATURE_ANGLE
  use swage_coupling_matrix, only: coupling_matrix_create, coupling_matrix_t
  use swage_environment, only: environment_start, environment_stop
  use swage_kinds, only: gp, wp
  use swage_no_friction, only: no_friction_create, no_friction_t
  implicit none(type, external)

  real(wp), parameter :: NANOSECOND = 1.0e-9_wp
  !> Cells of the master along a side, by those of the slave.
  real(wp), parameter :: RATIO = 0.83_wp
  integer, parameter :: N_PHASE = 7
  type(comm_t) :: comm
  integer :: most, n, repetition
  real(wp) :: least(N_PHASE), time(N_PHASE)

  call environment_start(comm)
  n = number(2)
  most = number(3)
  do while (n <= most)
    least = huge(1.0_wp)
    do repetition = 1, max(3, 128 / n)
      call measure(argument(1) == 'l2', n, comm, time)
      least = min(least, time)
    end do
    write (*, '(i0,*(1x,f0.1))') 2 * n**2, least / (2 * n**2 * NANOSECOND)
    n = 2 * n
  end do
  call environment_stop()

contains

  subroutine measure(integrates, n, comm, time)
    logical, intent(in) :: integrates
    !> Facets along a side.
    integer, intent(in) :: n
    type(comm_t), intent(in) :: comm
    real(wp), intent(out) :: time(N_PHASE)

    class(contact_formulation_t), allocatable :: formulation
    integer :: i, m
    integer, allocatable :: column(:), row(:)
    logical, allocatable :: mine(:)
    real(wp), allocatable :: force(:, :), x(:, :)
    real(wp) :: begin
    type(body_contact_t) :: contact
    type(condition_list_t) :: list
    type(contact_blocks_t) :: blocks, turning, unsymmetric
    type(contact_choice_t) :: choice
    type(contact_overlap_t) :: overlap
    type(contact_pair_t) :: pair
    type(contact_rows_t) :: rows
    type(coupling_matrix_t) :: matrix
    type(no_friction_t) :: law

    m = nint(RATIO * n)
    call make_pair(n, m, pair, x)
    allocate (mine(size(x, 2)), source=.false.)
    mine(:(n + 1)**2) = .true.
    call contact_formulation_create(merge('quasi_symmetric', 'master_slave   ', integrates), &
                                    choice, formulation)
    begin = seconds()
    call pair%begin_step(x)
    time(1) = seconds() - begin
    begin = seconds()
    call pair%update(x)
    time(2) = seconds() - begin
    ! Arrays have their sizes from the second time on
    do i = 1, 2
      list%n = 0
      begin = seconds()
      if (integrates) then
        call find_overlap(pair, mine, overlap)
      else
        call node_conditions(pair, pair%slave, pair%master, mine, list)
      end if
      time(3) = seconds() - begin
      begin = seconds()
      call formulation%evaluate(pair, mine, rows)
      time(4) = max(seconds() - begin - time(3), 0.0_wp)
    end do

    call no_friction_create(law)
    call body_contact_create('c', law, .true., [(i, i=1, size(mine))], mine, &
                             [(i, i=1, size(mine))], [(1.0_wp / n, i=1, size(mine))], &
                             [(1.0_wp, i=1, size(mine))], [(1.0_wp, i=1, size(mine))], &
                             enforcement_t(), 0.0_wp, contact)
    call contact%begin_step(rows, [(1.0_wp, i=1, size(mine))])
    allocate (force(3, size(mine)), source=0.0_wp)
    do i = 1, 2
      begin = seconds()
      call blocks%start()
      call unsymmetric%start()
      call contact%evaluate(rows, x, x, 1.0_wp, 1.0_wp, force, blocks, unsymmetric)
      time(6) = seconds() - begin
      begin = seconds()
      call formulation%stiffness(pair, rows, contact%row_pressure(:rows%n_row), turning)
      time(5) = seconds() - begin
    end do

    call coupling_matrix_create(comm, 3, [(int(i, gp), i=1, size(mine))], [(i, i=1, size(mine))], &
                                [(.true., i=1, size(mine))], matrix)
    allocate (row(blocks%n + turning%n), column(blocks%n + turning%n))
    do m = 1, 2
      begin = seconds()
      row = [blocks%row(:blocks%n), turning%row(:turning%n)]
      column = [blocks%column(:blocks%n), turning%column(:turning%n)]
      call matrix%expect(row, column)
      call matrix%clear()
      do i = 1, blocks%n
        call matrix%add(blocks%row(i), blocks%column(i), blocks%block(:, :, i), .false.)
      end do
      do i = 1, turning%n
        call matrix%add(turning%row(i), turning%column(i), turning%block(:, :, i), .false.)
      end do
      time(7) = seconds() - begin
    end do

  end subroutine measure

  !> Two sheets over the unit square.
  subroutine make_pair(n_slave, n_master, pair, x)
    !> Facets along a side.
    integer, intent(in) :: n_slave, n_master
    type(contact_pair_t), intent(out) :: pair
    real(wp), allocatable, intent(out) :: x(:, :)

    integer :: n
    integer, allocatable :: master(:, :), slave(:, :)

    n = (n_slave + 1)**2
    allocate (x(3, n + (n_master + 1)**2), source=0.0_wp)
    allocate (slave(3, 2 * n_slave**2), master(3, 2 * n_master**2))
    call set_sheet(n_slave, slave, x(:, :n))
    call set_sheet(n_master, master, x(:, n + 1:))
    x(3, :) = 0.02_wp * sin(7.0_wp * x(1, :)) * cos(5.0_wp * x(2, :))
    x(3, :n) = x(3, :n) - 0.02_wp / n_slave
    slave = slave([1, 3, 2], :)
    master = master + n
    call contact_pair_create(3, .false., slave, master, size(x, 2), 1.0_wp / n_slave, &
                             1.0_wp / n_slave, .false., DEFAULT_FEATURE_ANGLE, pair)

  end subroutine make_pair

  subroutine set_sheet(n, facet, x)
    integer, intent(in) :: n
    !> Shape (3, 2 n^2), normals upwards.
    integer, intent(out) :: facet(:, :)
    !> Shape (3, (n + 1)^2).
    real(wp), intent(inout) :: x(:, :)

    integer :: f, i, j, node

    f = 0
    do j = 0, n
      do i = 0, n
        node = j * (n + 1) + i + 1
        x(:2, node) = [real(i, wp), real(j, wp)] / n
        if (i == n .or. j == n) cycle
        facet(:, f + 1) = [node, node + 1, node + n + 2]
        facet(:, f + 2) = [node, node + n + 2, node + n + 1]
        f = f + 2
      end do
    end do

  end subroutine set_sheet

  function argument(i)
    integer, intent(in) :: i
    character(len=32) :: argument

    call get_command_argument(i, argument)

  end function argument

  function number(i)
    integer, intent(in) :: i
    integer :: number

    character(len=32) :: word

    word = argument(i)
    read (word, *) number

  end function number

  function seconds()
    real(wp) :: seconds

    call cpu_time(seconds)

  end function seconds

end program bench_contact
