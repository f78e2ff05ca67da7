!> Pairs of surfaces, and what conditions of contact between them must fulfil.
module swage_test_contact
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_formulation_registry, only: contact_formulation_create
  use swage_contact_pair, only: contact_pair_create, contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_surface, only: DEFAULT_FEATURE_ANGLE
  use swage_kinds, only: wp
  use swage_test_random, only: random_t
  implicit none(type, external)
  private

  public :: arc_pair, block_pair, formulation_of, imbalance, line_pair, sheet_pair, slope_error
  public :: stiffness_error, total_force

contains

  !> The formulation of the given name and choice.
  subroutine formulation_of(name, formulation, variant, projection, gap, quadrature, n_point)
    character(len=*), intent(in) :: name
    class(contact_formulation_t), allocatable, intent(out) :: formulation
    character(len=*), optional, intent(in) :: variant, projection, gap, quadrature
    integer, optional, intent(in) :: n_point

    type(contact_choice_t) :: choice

    if (present(variant)) choice%variant = variant
    if (present(projection)) choice%projection = projection
    if (present(gap)) choice%gap = gap
    if (present(quadrature)) choice%quadrature = quadrature
    if (present(n_point)) choice%n_point = n_point
    call contact_formulation_create(name, choice, formulation)

  end subroutine formulation_of

  !> Two lines: a slave above with the first nodes, from left to right, and a master below.
  subroutine line_pair(slave, master, smoothing, axisymmetric, pair, x)
    !> Coordinates of the nodes, from left to right; shape (2, :).
    real(wp), intent(in) :: slave(:, :), master(:, :)
    logical, intent(in) :: smoothing, axisymmetric
    type(contact_pair_t), intent(out) :: pair
    real(wp), allocatable, intent(out) :: x(:, :)

    integer :: i, n_master, n_slave
    integer, allocatable :: master_facet(:, :), slave_facet(:, :)

    n_slave = size(slave, 2)
    n_master = size(master, 2)
    allocate (x(3, n_slave + n_master), source=0.0_wp)
    x(:2, :n_slave) = slave
    x(:2, n_slave + 1:) = master
    allocate (slave_facet(2, n_slave - 1), master_facet(2, n_master - 1))
    do i = 1, n_slave - 1
      slave_facet(:, i) = [i, i + 1]
    end do
    do i = 1, n_master - 1
      master_facet(:, i) = n_slave + [i + 1, i]
    end do
    call contact_pair_create(2, axisymmetric, slave_facet, master_facet, n_slave + n_master, &
                             1.0_wp, 1.0_wp, smoothing, DEFAULT_FEATURE_ANGLE, pair)
    call pair%begin_step(x)

  end subroutine line_pair

  !> Two blocks one upon the other, 1 long and 0.5 high, each with its whole surface: the upper one,
  !> the slave, has the first nodes and lies a little deeper.
  subroutine block_pair(n_slave, n_master, overlap, pair, x)
    !> Facets along the interface.
    integer, intent(in) :: n_slave, n_master
    real(wp), intent(in) :: overlap
    type(contact_pair_t), intent(out) :: pair
    real(wp), allocatable, intent(out) :: x(:, :)

    integer :: n
    integer, allocatable :: master_facet(:, :), slave_facet(:, :)

    n = 2 * (n_slave + 2)
    allocate (x(3, n + 2 * (n_master + 2)), source=0.0_wp)
    allocate (slave_facet(2, n), master_facet(2, 2 * (n_master + 2)))
    call set_block(n_slave, slave_facet, x(:, :n))
    call set_block(n_master, master_facet, x(:, n + 1:))
    x(2, :n) = x(2, :n) - overlap
    x(2, n + 1:) = x(2, n + 1:) - 0.5_wp
    master_facet = master_facet + n
    call contact_pair_create(2, .false., slave_facet, master_facet, size(x, 2), 0.1_wp, 0.1_wp, &
                             .false., DEFAULT_FEATURE_ANGLE, pair)
    call pair%begin_step(x)

  end subroutine block_pair

  !> The rim of a block from its lower left corner, counter-clockwise, with two facets a side wall.
  subroutine set_block(n, facet, x)
    integer, intent(in) :: n
    integer, intent(out) :: facet(:, :)
    real(wp), intent(inout) :: x(:, :)

    integer :: i, n_node

    n_node = 2 * (n + 2)
    do i = 0, n
      x(:2, i + 1) = [real(i, wp) / n, 0.0_wp]
      x(:2, n + 3 + i) = [1.0_wp - real(i, wp) / n, 0.5_wp]
    end do
    x(:2, n + 2) = [1.0_wp, 0.25_wp]
    x(:2, n_node) = [0.0_wp, 0.25_wp]
    do i = 1, n_node
      facet(:, i) = [i, 1 + mod(i, n_node)]
    end do

  end subroutine set_block

  !> Two arcs that bulge upwards, of a radius near 2, which meet in the middle and gape at the ends.
  subroutine arc_pair(n_slave, n_master, hollow, smoothing, pair, x)
    integer, intent(in) :: n_slave, n_master
    !> Arcs that bulge downwards: the master is concave then.
    logical, intent(in) :: hollow
    logical, intent(in) :: smoothing
    type(contact_pair_t), intent(out) :: pair
    real(wp), allocatable, intent(out) :: x(:, :)

    integer :: i
    real(wp) :: angle, master(2, n_master), slave(2, n_slave), sense
    type(random_t) :: random

    sense = merge(-1.0_wp, 1.0_wp, hollow)
    do i = 1, n_slave
      call random%next(-0.1_wp, 0.1_wp, angle)
      angle = 0.4_wp * (2.0_wp * (i - 1 + angle) / (n_slave - 1) - 1.0_wp)
      slave(:, i) = [2.1_wp * sin(angle), sense * 2.1_wp * (cos(angle) - 1.0_wp) - 0.012_wp &
                     + (0.2_wp - 0.15_wp * sense) * angle**2]
    end do
    do i = 1, n_master
      call random%next(-0.1_wp, 0.1_wp, angle)
      angle = 0.5_wp * (2.0_wp * (i - 1 + angle) / (n_master - 1) - 1.0_wp)
      master(:, i) = [2.0_wp * sin(angle), sense * 2.0_wp * (cos(angle) - 1.0_wp)]
    end do
    call line_pair(slave, master, smoothing, .false., pair, x)

  end subroutine arc_pair

  !> Two sheets over the unit square: a slave above with the first nodes and a master below, whose
  !> inner nodes are moved at random.
  subroutine sheet_pair(n_slave, n_master, bulge, overlap, smoothing, pair, x)
    !> Facets along a side.
    integer, intent(in) :: n_slave, n_master
    !> Height of the middle of the master, and how deep the slave lies in it, more in the middle
    !> when there is a bulge.
    real(wp), intent(in) :: bulge, overlap
    logical, intent(in) :: smoothing
    type(contact_pair_t), intent(out) :: pair
    real(wp), allocatable, intent(out) :: x(:, :)

    integer :: n
    integer, allocatable :: master_facet(:, :), slave_facet(:, :)
    type(random_t) :: random

    n = (n_slave + 1)**2
    allocate (x(3, n + (n_master + 1)**2), source=0.0_wp)
    allocate (slave_facet(3, 2 * n_slave**2), master_facet(3, 2 * n_master**2))
    call set_sheet(n_slave, random, slave_facet, x(:, :n))
    call set_sheet(n_master, random, master_facet, x(:, n + 1:))
    x(3, :) = bulge * 16.0_wp * x(1, :) * (1.0_wp - x(1, :)) * x(2, :) * (1.0_wp - x(2, :))
    x(3, :n) = 0.9_wp * x(3, :n) - overlap
    slave_facet = slave_facet([1, 3, 2], :)
    master_facet = master_facet + n
    call contact_pair_create(3, .false., slave_facet, master_facet, size(x, 2), 1.0_wp, 1.0_wp, &
                             smoothing, DEFAULT_FEATURE_ANGLE, pair)
    call pair%begin_step(x)

  end subroutine sheet_pair

  !> Squares cut in two, seen from above counter-clockwise.
  subroutine set_sheet(n, random, facet, x)
    integer, intent(in) :: n
    type(random_t), intent(inout) :: random
    integer, intent(out) :: facet(:, :)
    real(wp), intent(inout) :: x(:, :)

    integer :: i, j, k, m

    m = 0
    do j = 0, n
      do i = 0, n
        k = 1 + i + j * (n + 1)
        x(1:2, k) = [real(i, wp), real(j, wp)] / n
        if (i > 0 .and. i < n) call move(x(1, k))
        if (j > 0 .and. j < n) call move(x(2, k))
        if (i == n .or. j == n) cycle
        facet(:, m + 1) = [k, k + 1, k + n + 2]
        facet(:, m + 2) = [k, k + n + 2, k + n + 1]
        m = m + 2
      end do
    end do

  contains

    subroutine move(coordinate)
      real(wp), intent(inout) :: coordinate

      real(wp) :: shift

      call random%next(-0.2_wp, 0.2_wp, shift)
      coordinate = coordinate + shift / n

    end subroutine move

  end subroutine set_sheet

  !> Largest sum of the forces, and of the shares, of one condition, by its area.
  function imbalance(rows) result(largest)
    type(contact_rows_t), intent(in) :: rows
    real(wp) :: largest

    integer :: row

    largest = 0.0_wp
    do row = 1, rows%n_row
      associate (first => rows%first(row), last => rows%first(row + 1) - 1)
        largest = max(largest, &
                      maxval(abs(sum(rows%force(:, first:last), dim=2))) / rows%area(row), &
                      abs(sum(rows%share(first:last))) / rows%area(row))
      end associate
    end do

  end function imbalance

  !> Forces of all conditions on the nodes, by pressures kept under their keys.
  subroutine total_force(rows, pressure, force)
    type(contact_rows_t), intent(in) :: rows
    !> Shape (n_condition).
    real(wp), intent(in) :: pressure(:)
    !> Shape (3, n_node).
    real(wp), intent(out) :: force(:, :)

    integer :: entry, row

    force = 0.0_wp
    do row = 1, rows%n_row
      do entry = rows%first(row), rows%first(row + 1) - 1
        force(:, rows%node(entry)) = force(:, rows%node(entry)) &
          + pressure(rows%key(row)) * rows%force(:, entry)
      end do
    end do

  end subroutine total_force

  !> Largest difference between `slope` and the central difference of area times gap along a random
  !> motion, by the largest of the latter.
  subroutine slope_error(formulation, pair, x, error, n_checked)
    class(contact_formulation_t), intent(inout) :: formulation
    type(contact_pair_t), intent(inout) :: pair
    real(wp), intent(in) :: x(:, :)
    real(wp), intent(out) :: error
    !> Conditions looked at.
    integer, intent(out) :: n_checked

    real(wp), parameter :: STEP = 1.0e-6_wp

    integer :: entry, key, n, row
    logical, allocatable :: mine(:)
    real(wp) :: largest
    real(wp), allocatable :: change(:), expected(:), motion(:, :)
    type(contact_rows_t) :: rows
    type(random_t) :: random

    n = formulation%count_conditions(pair)
    allocate (mine(size(x, 2)), source=.true.)
    allocate (motion(3, size(x, 2)), change(n), expected(n), source=0.0_wp)
    do entry = 1, size(x, 2)
      call random%fill(-1.0_wp, 1.0_wp, motion(:pair%slave%n_dim, entry))
    end do
    call pair%begin_step(x)
    call pair%update(x + STEP * motion)
    call formulation%evaluate(pair, mine, rows)
    do row = 1, rows%n_row
      expected(rows%key(row)) = rows%area(row) * rows%gap(row) / (2.0_wp * STEP)
    end do
    call pair%update(x - STEP * motion)
    call formulation%evaluate(pair, mine, rows)
    do row = 1, rows%n_row
      key = rows%key(row)
      expected(key) = expected(key) - rows%area(row) * rows%gap(row) / (2.0_wp * STEP)
    end do
    call pair%update(x)
    call formulation%evaluate(pair, mine, rows)
    error = 0.0_wp
    largest = 0.0_wp
    n_checked = rows%n_row
    do row = 1, rows%n_row
      key = rows%key(row)
      do entry = rows%first(row), rows%first(row + 1) - 1
        change(key) = change(key) + dot_product(rows%slope(:, entry), motion(:, rows%node(entry)))
      end do
      error = max(error, abs(change(key) - expected(key)))
      largest = max(largest, abs(expected(key)))
    end do
    error = error / largest

  end subroutine slope_error

  !> The same for the stiffness and the forces of pressures that are held.
  subroutine stiffness_error(formulation, pair, x, error)
    class(contact_formulation_t), intent(inout) :: formulation
    type(contact_pair_t), intent(inout) :: pair
    real(wp), intent(in) :: x(:, :)
    real(wp), intent(out) :: error

    real(wp), parameter :: STEP = 1.0e-6_wp

    integer :: i, n
    logical, allocatable :: mine(:)
    real(wp), allocatable :: change(:, :), force(:, :), lambda(:), motion(:, :), pressure(:), &
      expected(:, :)
    type(contact_blocks_t) :: blocks
    type(contact_rows_t) :: rows
    type(random_t) :: random

    n = formulation%count_conditions(pair)
    allocate (mine(size(x, 2)), source=.true.)
    allocate (pressure(n))
    call random%fill(0.5_wp, 1.5_wp, pressure)
    allocate (motion(3, size(x, 2)), source=0.0_wp)
    do i = 1, size(x, 2)
      call random%fill(-1.0_wp, 1.0_wp, motion(:pair%slave%n_dim, i))
    end do
    allocate (force(3, size(x, 2)), expected(3, size(x, 2)), change(3, size(x, 2)), source=0.0_wp)
    call pair%begin_step(x)
    call pair%update(x + STEP * motion)
    call formulation%evaluate(pair, mine, rows)
    call total_force(rows, pressure, expected)
    call pair%update(x - STEP * motion)
    call formulation%evaluate(pair, mine, rows)
    call total_force(rows, pressure, force)
    expected = (expected - force) / (2.0_wp * STEP)
    call pair%update(x)
    call formulation%evaluate(pair, mine, rows)
    allocate (lambda, source=pressure(rows%key(:rows%n_row)))
    call formulation%stiffness(pair, rows, lambda, blocks)
    do i = 1, blocks%n
      change(:, blocks%row(i)) = change(:, blocks%row(i)) &
        + matmul(blocks%block(:, :, i), motion(:, blocks%column(i)))
    end do
    error = maxval(abs(change - expected)) / maxval(abs(expected))

  end subroutine stiffness_error

end module swage_test_contact
