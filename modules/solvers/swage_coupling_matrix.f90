!> Blocks between nodes of surfaces that touch, on top of the matrix of the cells: stiffness of
!> contact and friction between bodies.
!>
!> Every rank knows all nodes of the surfaces, and adds blocks between any of them, whoever owns
!> them; the matrix is the sum over the ranks. Its pattern only grows: contact that comes and goes
!> between the same nodes leaves the factors' analysis as it is. Each block knows with which version
!> it came, so that factors of an earlier pattern can be made again after a restart. The pattern of
!> a rank is symmetric.
module swage_coupling_matrix
  use swage_comm, only: comm_t
  use swage_kinds, only: gp, wp
  use swage_snapshot, only: OF_RANK, snapshot_t
  use swage_sort, only: sorting_order
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: coupling_matrix_t, coupling_matrix_create

  !> Entries of a snapshot.
  character(len=*), parameter :: SAVED_VERSION = 'coupling: version'
  character(len=*), parameter :: SAVED_ROWS = 'coupling: rows'
  character(len=*), parameter :: SAVED_COLUMNS = 'coupling: columns'
  character(len=*), parameter :: SAVED_SINCE = 'coupling: since'

  type :: coupling_matrix_t
    type(comm_t) :: comm
    !> Rows of a block: displacements alone.
    integer :: n_dim = 0
    !> Nodes of the surfaces.
    integer :: n_node = 0
    !> Number of the unknown node of all ranks, and on this rank, 0 where it has none; (n_node).
    integer(gp), allocatable :: node_global(:)
    integer, allocatable :: unknown_node(:)
    !> Whether this rank owns the unknown node; shape (n_node).
    logical, allocatable :: is_own(:)
    !> How often the pattern of any rank has grown.
    integer :: version = 0
    !> First block of each row, and one past the last of all; shape (n_node + 1).
    integer, allocatable :: row_start(:)
    !> Column of each block, ascending in a row; shape (n_block).
    integer, allocatable :: column(:)
    !> Version with which each block came; shape (n_block).
    integer, allocatable :: since(:)
    !> Shape (n_dim, n_dim, n_block), rows first.
    real(wp), allocatable :: values(:, :, :)
    !> Part of `values` that a symmetric factor is to leave out; see [[block_matrix_t]].
    real(wp), allocatable :: unsymmetric(:, :, :)
    !> Pairs that were expected last, their places, and how many of them blocks have been added to:
    !> most iterations expect the same pairs in the same order.
    integer, allocatable, private :: expected_row(:), expected_column(:), expected_place(:)
    integer, private :: n_added = 0
  contains
    !> Blocks of this rank.
    procedure :: n_block => coupling_matrix_n_block
    !> Place of a block, 0 when the pattern lacks it.
    procedure :: block_at => coupling_matrix_block_at
    !> Collective. Let the pattern hold some pairs of nodes, and their mirrors.
    procedure :: expect => coupling_matrix_expect
    !> Set all values to zero.
    procedure :: clear => coupling_matrix_clear
    !> Add to a block of the pattern.
    procedure :: add => coupling_matrix_add
    !> Block of the symmetric part, without what is unsymmetric.
    procedure :: symmetric_block => coupling_matrix_symmetric_block
    !> Collective. Turn the blocks to local axes, and clear constrained rows and columns.
    procedure :: impose => coupling_matrix_impose
    !> Collective. Add the product with a vector.
    procedure :: multiply_add => coupling_matrix_multiply_add
    !> Collective. Add the diagonal to that of the cells.
    procedure :: add_diagonal => coupling_matrix_add_diagonal
    !> Collective. Values of the nodes from those of the unknown nodes' owners.
    procedure :: gather => coupling_matrix_gather
    !> Put the pattern into a snapshot.
    procedure :: save => coupling_matrix_save
    !> Take it back; with another partition it begins anew.
    procedure :: load => coupling_matrix_load
    !> Add values of the nodes, summed over the ranks, to all copies of the unknown nodes.
    procedure, private :: scatter_sum => coupling_matrix_scatter_sum
  end type coupling_matrix_t

contains

  !> No pair of nodes yet.
  pure subroutine coupling_matrix_create(comm, n_dim, node_global, unknown_node, is_own, matrix)
    type(comm_t), intent(in) :: comm
    integer, intent(in) :: n_dim
    !> As in the type; the first is the same on all ranks.
    integer(gp), intent(in) :: node_global(:)
    integer, intent(in) :: unknown_node(:)
    logical, intent(in) :: is_own(:)
    type(coupling_matrix_t), intent(out) :: matrix

    matrix%comm = comm
    matrix%n_dim = n_dim
    matrix%n_node = size(node_global)
    allocate (matrix%node_global, source=node_global)
    allocate (matrix%unknown_node, source=unknown_node)
    allocate (matrix%is_own, source=is_own)
    allocate (matrix%row_start(matrix%n_node + 1), source=1)
    allocate (matrix%column(0), matrix%since(0))
    call allocate_values(matrix)
    allocate (matrix%expected_row(0), matrix%expected_column(0), matrix%expected_place(0))

  end subroutine coupling_matrix_create

  pure function coupling_matrix_n_block(self) result(n_block)
    class(coupling_matrix_t), intent(in) :: self
    integer :: n_block

    n_block = 0
    if (allocated(self%column)) n_block = size(self%column)

  end function coupling_matrix_n_block

  pure function coupling_matrix_block_at(self, row, column) result(place)
    class(coupling_matrix_t), intent(in) :: self
    integer, intent(in) :: row
    integer, intent(in) :: column
    integer :: place

    integer :: high, low

    low = self%row_start(row)
    high = self%row_start(row + 1) - 1
    do while (low <= high)
      place = (low + high) / 2
      if (self%column(place) == column) return
      if (self%column(place) < column) then
        low = place + 1
      else
        high = place - 1
      end if
    end do
    place = 0

  end function coupling_matrix_block_at

  !> Values are zero afterwards when the pattern has grown. Adding is fastest in the same order.
  subroutine coupling_matrix_expect(self, rows, columns)
    class(coupling_matrix_t), intent(inout) :: self
    !> Pairs of nodes, in any order, repeated or not.
    integer, intent(in) :: rows(:)
    integer, intent(in) :: columns(:)

    integer(gp), allocatable :: keys(:), new(:)
    integer, allocatable :: missing(:), old_column(:), old_since(:), old_start(:)
    integer :: grows, i, k, n_old, n_new

    n_old = size(self%column)
    call remember_expected(self, rows, columns)
    grows = merge(1, 0, any(self%expected_place == 0))
    call self%comm%max(grows)
    if (grows == 0) return

    ! Rows by columns as single numbers, those in the pattern ascending
    allocate (keys(n_old))
    do i = 1, self%n_node
      keys(self%row_start(i):self%row_start(i + 1) - 1) = &
        key_of(self%n_node, i, self%column(self%row_start(i):self%row_start(i + 1) - 1))
    end do
    ! What it lacks, the mirrors of that, and the diagonal
    allocate (missing, source=pack([(i, i=1, size(rows))], self%expected_place == 0))
    n_new = size(missing)
    allocate (new(2 * n_new + self%n_node))
    new(:n_new) = key_of(self%n_node, rows(missing), columns(missing))
    new(n_new + 1:2 * n_new) = key_of(self%n_node, columns(missing), rows(missing))
    new(2 * n_new + 1:) = [(key_of(self%n_node, i, i), i=1, self%n_node)]
    new = new(sorting_order(new))
    call move_alloc(self%column, old_column)
    call move_alloc(self%since, old_since)
    allocate (old_start, source=self%row_start)
    call set_pattern(self, merged(keys, new))
    self%version = self%version + 1
    self%since = self%version
    do i = 1, self%n_node
      do k = old_start(i), old_start(i + 1) - 1
        self%since(self%block_at(i, old_column(k))) = old_since(k)
      end do
    end do
    call find_expected(self)

  end subroutine coupling_matrix_expect

  !> Two ascending lists as one, without repetitions.
  pure function merged(a, b) result(both)
    integer(gp), intent(in) :: a(:), b(:)
    integer(gp), allocatable :: both(:)

    integer(gp), allocatable :: list(:)
    integer(gp) :: next
    integer :: i, j, n

    allocate (list(size(a) + size(b)))
    i = 1
    j = 1
    n = 0
    do while (i <= size(a) .or. j <= size(b))
      if (j > size(b)) then
        next = a(i)
        i = i + 1
      else if (i > size(a)) then
        next = b(j)
        j = j + 1
      else if (a(i) <= b(j)) then
        next = a(i)
        i = i + 1
      else
        next = b(j)
        j = j + 1
      end if
      if (n > 0) then
        if (list(n) == next) cycle
      end if
      n = n + 1
      list(n) = next
    end do
    allocate (both, source=list(:n))

  end function merged

  pure subroutine remember_expected(matrix, rows, columns)
    type(coupling_matrix_t), intent(inout) :: matrix
    integer, intent(in) :: rows(:)
    integer, intent(in) :: columns(:)

    matrix%n_added = 0
    if (size(rows) == size(matrix%expected_row)) then
      if (all(rows == matrix%expected_row .and. columns == matrix%expected_column)) return
    end if
    matrix%expected_row = rows
    matrix%expected_column = columns
    call find_expected(matrix)

  end subroutine remember_expected

  !> Places of the pairs that are expected; 0 where the pattern lacks them.
  pure subroutine find_expected(matrix)
    type(coupling_matrix_t), intent(inout) :: matrix

    !> Steps along a row before it is worth a bisection.
    integer, parameter :: MOST_STEPS = 4

    integer :: i, last, next

    if (size(matrix%expected_place) /= size(matrix%expected_row)) then
      deallocate (matrix%expected_place)
      allocate (matrix%expected_place(size(matrix%expected_row)))
    end if
    next = 1
    do i = 1, size(matrix%expected_row)
      associate (row => matrix%expected_row(i), column => matrix%expected_column(i))
        ! Lists often run along a row
        next = max(next, matrix%row_start(row))
        last = min(next + MOST_STEPS, matrix%row_start(row + 1)) - 1
        do while (next < last)
          if (matrix%column(next) >= column) exit
          next = next + 1
        end do
        if (next > last) then
          next = matrix%block_at(row, column)
        else if (matrix%column(next) /= column) then
          next = matrix%block_at(row, column)
        end if
        matrix%expected_place(i) = next
        next = next + 1
      end associate
    end do

  end subroutine find_expected

  !> Number of a pair.
  elemental function key_of(n_node, row, column) result(key)
    integer, intent(in) :: n_node
    integer, intent(in) :: row, column
    integer(gp) :: key

    key = int(row - 1, gp) * n_node + column

  end function key_of

  !> Rows and columns from sorted keys; those of before have been taken away.
  pure subroutine set_pattern(matrix, keys)
    type(coupling_matrix_t), intent(inout) :: matrix
    !> Ascending, without repetitions.
    integer(gp), intent(in) :: keys(:)

    integer :: i, n, row

    n = size(keys)
    allocate (matrix%column(n), matrix%since(n))
    call allocate_values(matrix)
    matrix%row_start = 0
    do i = 1, n
      row = int((keys(i) - 1_gp) / matrix%n_node) + 1
      matrix%column(i) = int(keys(i) - int(row - 1, gp) * matrix%n_node)
      matrix%row_start(row + 1) = matrix%row_start(row + 1) + 1
    end do
    matrix%row_start(1) = 1
    do i = 1, matrix%n_node
      matrix%row_start(i + 1) = matrix%row_start(i) + matrix%row_start(i + 1)
    end do

  end subroutine set_pattern

  !> Zeros for the blocks that there are.
  pure subroutine allocate_values(matrix)
    type(coupling_matrix_t), intent(inout) :: matrix

    integer :: n

    n = size(matrix%column)
    if (allocated(matrix%values)) deallocate (matrix%values, matrix%unsymmetric)
    allocate (matrix%values(matrix%n_dim, matrix%n_dim, n), source=0.0_wp)
    allocate (matrix%unsymmetric(matrix%n_dim, matrix%n_dim, n), source=0.0_wp)

  end subroutine allocate_values

  subroutine coupling_matrix_save(self, snapshot)
    class(coupling_matrix_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    if (self%version == 0) return
    call snapshot%put(SAVED_VERSION, self%version)
    call snapshot%put(SAVED_ROWS, self%row_start, OF_RANK)
    call snapshot%put(SAVED_COLUMNS, self%column, OF_RANK)
    call snapshot%put(SAVED_SINCE, self%since, OF_RANK)

  end subroutine coupling_matrix_save

  !> Values are zero afterwards.
  subroutine coupling_matrix_load(self, snapshot, status)
    class(coupling_matrix_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    type(status_t), intent(inout) :: status

    if (.not. snapshot%has(SAVED_ROWS)) return
    deallocate (self%column, self%since)
    allocate (self%column(snapshot%count(SAVED_COLUMNS)), self%since(snapshot%count(SAVED_SINCE)))
    call snapshot%get(SAVED_VERSION, self%version, status)
    call snapshot%get(SAVED_ROWS, self%row_start, status, OF_RANK)
    call snapshot%get(SAVED_COLUMNS, self%column, status, OF_RANK)
    call snapshot%get(SAVED_SINCE, self%since, status, OF_RANK)
    call allocate_values(self)
    call find_expected(self)

  end subroutine coupling_matrix_load

  pure subroutine coupling_matrix_clear(self)
    class(coupling_matrix_t), intent(inout) :: self

    self%values = 0.0_wp
    self%unsymmetric = 0.0_wp

  end subroutine coupling_matrix_clear

  pure subroutine coupling_matrix_add(self, row, column, block, is_unsymmetric)
    class(coupling_matrix_t), intent(inout) :: self
    !> Nodes of a block that the pattern has.
    integer, intent(in) :: row
    integer, intent(in) :: column
    !> Its leading n_dim rows and columns count.
    real(wp), intent(in) :: block(:, :)
    !> True for what a symmetric factor is to leave out.
    logical, intent(in) :: is_unsymmetric

    integer :: n, place

    n = self%n_dim
    place = 0
    self%n_added = self%n_added + 1
    if (self%n_added <= size(self%expected_row)) then
      if (self%expected_row(self%n_added) == row .and. &
          self%expected_column(self%n_added) == column) place = self%expected_place(self%n_added)
    end if
    if (place == 0) place = self%block_at(row, column)
    self%values(:, :, place) = self%values(:, :, place) + block(:n, :n)
    if (.not. is_unsymmetric) return
    self%unsymmetric(:, :, place) = self%unsymmetric(:, :, place) + block(:n, :n)

  end subroutine coupling_matrix_add

  !> Half of a block and of the transpose of its mirror, as far as this rank knows them.
  pure subroutine coupling_matrix_symmetric_block(self, row, place, part)
    class(coupling_matrix_t), intent(in) :: self
    !> Row of the block, and its place.
    integer, intent(in) :: row
    integer, intent(in) :: place
    !> Shape (n_dim, n_dim).
    real(wp), intent(out) :: part(:, :)

    integer :: mirror

    mirror = self%block_at(self%column(place), row)
    part = 0.5_wp * (self%values(:, :, place) - self%unsymmetric(:, :, place) &
                     + transpose(self%values(:, :, mirror) - self%unsymmetric(:, :, mirror)))

  end subroutine coupling_matrix_symmetric_block

  !> As constraints do with the matrix of the cells; the diagonal of constrained rows is theirs.
  subroutine coupling_matrix_impose(self, n_direction, axes, rest, load)
    class(coupling_matrix_t), intent(inout) :: self
    !> Constrained directions of each unknown node of this rank; shape (n unknown nodes).
    integer, intent(in) :: n_direction(:)
    !> Local axes as columns, the constrained ones first; (n_dim, n_dim, n unknown nodes).
    real(wp), intent(in) :: axes(:, :, :)
    !> Prescribed rest along the local axes, zero where free; (n_dim or more, n unknown nodes).
    real(wp), intent(in) :: rest(:, :)
    !> What the rest gives on the right-hand side is added, on every copy; shape of `rest`.
    real(wp), intent(inout) :: load(:, :)

    real(wp), allocatable :: all_axes(:, :), all_rest(:, :), count_of(:, :), product(:, :)
    integer :: i, j, k, n

    n = self%n_dim
    allocate (all_axes(n * n, self%n_node), all_rest(n, self%n_node), count_of(1, self%n_node))
    call self%gather(reshape(real(n_direction, wp), [1, size(n_direction)]), count_of)
    call self%gather(reshape(axes, [n * n, size(axes, 3)]), all_axes)
    call self%gather(rest(:n, :), all_rest)
    allocate (product(n, self%n_node), source=0.0_wp)
    do i = 1, self%n_node
      do k = self%row_start(i), self%row_start(i + 1) - 1
        j = self%column(k)
        ! Along the axes of the space, and nothing prescribed
        if (nint(count_of(1, i)) == 0 .and. nint(count_of(1, j)) == 0) cycle
        call turn(self%values(:, :, k), all_axes(:, i), all_axes(:, j))
        call turn(self%unsymmetric(:, :, k), all_axes(:, i), all_axes(:, j))
        product(:, i) = product(:, i) + matmul(self%values(:, :, k), all_rest(:, j))
        call clear_constrained(self%values(:, :, k), nint(count_of(1, i)), nint(count_of(1, j)))
        call clear_constrained(self%unsymmetric(:, :, k), nint(count_of(1, i)), &
                               nint(count_of(1, j)))
      end do
    end do
    call self%scatter_sum(product, load)

  end subroutine coupling_matrix_impose

  !> A block along the local axes of its nodes.
  pure subroutine turn(block, row_axes, column_axes)
    real(wp), intent(inout) :: block(:, :)
    !> Columns one after the other.
    real(wp), intent(in) :: row_axes(:), column_axes(:)

    real(wp) :: a(size(block, 1), size(block, 1)), b(size(block, 1), size(block, 1))

    a = reshape(row_axes, shape(a))
    b = reshape(column_axes, shape(b))
    a = matmul(transpose(a), block)
    block = matmul(a, b)

  end subroutine turn

  !> Set constrained rows and columns to zero.
  pure subroutine clear_constrained(block, n_row, n_column)
    real(wp), intent(inout) :: block(:, :)
    integer, intent(in) :: n_row, n_column

    block(:n_row, :) = 0.0_wp
    block(:, :n_column) = 0.0_wp

  end subroutine clear_constrained

  subroutine coupling_matrix_multiply_add(self, x, y)
    class(coupling_matrix_t), intent(in) :: self
    !> Right on own unknown nodes; shape (n_dim or more, n unknown nodes).
    real(wp), intent(in) :: x(:, :)
    !> Added to on every copy; shape of `x`.
    real(wp), intent(inout) :: y(:, :)

    real(wp), allocatable :: all_x(:, :), product(:, :)

    allocate (all_x(self%n_dim, self%n_node), product(self%n_dim, self%n_node))
    call self%gather(x(:self%n_dim, :), all_x)
    if (self%n_dim == 3) then
      call multiply_blocks_of_3(self%n_node, self%n_block(), self%row_start, self%column, &
                                self%values, all_x, product)
    else
      call multiply_blocks_of_2(self%n_node, self%n_block(), self%row_start, self%column, &
                                self%values, all_x, product)
    end if
    call self%scatter_sum(product, y)

  end subroutine coupling_matrix_multiply_add

  !> Product of this rank's blocks; their size is fixed, so that they stay in registers.
  pure subroutine multiply_blocks_of_3(n_node, n_block, row_start, column, values, x, y)
    integer, intent(in) :: n_node, n_block
    integer, intent(in) :: row_start(n_node + 1)
    integer, intent(in) :: column(n_block)
    real(wp), intent(in) :: values(3, 3, n_block)
    real(wp), intent(in) :: x(3, n_node)
    real(wp), intent(out) :: y(3, n_node)

    real(wp) :: a(3)
    integer :: i, j, k

    do i = 1, n_node
      a = 0.0_wp
      do k = row_start(i), row_start(i + 1) - 1
        j = column(k)
        a = a + values(:, 1, k) * x(1, j) + values(:, 2, k) * x(2, j) + values(:, 3, k) * x(3, j)
      end do
      y(:, i) = a
    end do

  end subroutine multiply_blocks_of_3

  !> The same in the plane.
  pure subroutine multiply_blocks_of_2(n_node, n_block, row_start, column, values, x, y)
    integer, intent(in) :: n_node, n_block
    integer, intent(in) :: row_start(n_node + 1)
    integer, intent(in) :: column(n_block)
    real(wp), intent(in) :: values(2, 2, n_block)
    real(wp), intent(in) :: x(2, n_node)
    real(wp), intent(out) :: y(2, n_node)

    real(wp) :: a(2)
    integer :: i, j, k

    do i = 1, n_node
      a = 0.0_wp
      do k = row_start(i), row_start(i + 1) - 1
        j = column(k)
        a = a + values(:, 1, k) * x(1, j) + values(:, 2, k) * x(2, j)
      end do
      y(:, i) = a
    end do

  end subroutine multiply_blocks_of_2

  subroutine coupling_matrix_add_diagonal(self, diagonal)
    class(coupling_matrix_t), intent(in) :: self
    !> On every copy; shape (n_dim or more, n unknown nodes).
    real(wp), intent(inout) :: diagonal(:, :)

    real(wp), allocatable :: mine(:, :)
    integer :: c, i, place

    allocate (mine(self%n_dim, self%n_node), source=0.0_wp)
    do i = 1, self%n_node
      place = self%block_at(i, i)
      if (place == 0) cycle
      mine(:, i) = [(self%values(c, c, place), c=1, self%n_dim)]
    end do
    call self%scatter_sum(mine, diagonal)

  end subroutine coupling_matrix_add_diagonal

  subroutine coupling_matrix_gather(self, values, gathered)
    class(coupling_matrix_t), intent(in) :: self
    !> Shape (n_component, n unknown nodes).
    real(wp), intent(in) :: values(:, :)
    !> Shape (n_component, n_node).
    real(wp), contiguous, intent(out) :: gathered(:, :)

    integer :: i

    gathered = 0.0_wp
    do i = 1, self%n_node
      if (self%is_own(i)) gathered(:, i) = values(:, self%unknown_node(i))
    end do
    call sum_over_ranks(self%comm, gathered)

  end subroutine coupling_matrix_gather

  subroutine coupling_matrix_scatter_sum(self, mine, values)
    class(coupling_matrix_t), intent(in) :: self
    !> Of this rank; shape (n_dim, n_node).
    real(wp), contiguous, intent(inout) :: mine(:, :)
    !> Shape (n_dim or more, n unknown nodes).
    real(wp), intent(inout) :: values(:, :)

    integer :: i, n

    n = self%n_dim
    call sum_over_ranks(self%comm, mine)
    do i = 1, self%n_node
      associate (node => self%unknown_node(i))
        if (node > 0) values(:n, node) = values(:n, node) + mine(:, i)
      end associate
    end do

  end subroutine coupling_matrix_scatter_sum

  !> Collective.
  subroutine sum_over_ranks(comm, table)
    type(comm_t), intent(in) :: comm
    real(wp), contiguous, target, intent(inout) :: table(:, :)

    real(wp), pointer :: list(:)

    if (comm%size == 1) return
    list(1:size(table)) => table
    call comm%sum(list)

  end subroutine sum_over_ranks

end module swage_coupling_matrix
