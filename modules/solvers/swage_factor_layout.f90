!> What the factors of a matrix of unknown nodes need, whatever the matrix: the numbers of the
!> unknowns, the order of their elimination, and the way of a solution back to the owners.
!>
!> The order is METIS nested dissection of the graph of unknown nodes, found on rank 0, once for
!> each pattern that is analysed; the slots of a node stay together. Nothing else depends on the
!> pattern.
module swage_factor_layout
  use swage_block_matrix, only: block_matrix_t
  use swage_comm, only: comm_t
  use swage_coupling_matrix, only: coupling_matrix_t
  use swage_halo, only: halo_t
  use swage_kinds, only: gp, wp
  use swage_partition, only: order_nodes
  use swage_status, only: EXIT_SOLVER, status_t, STATUS_ERROR
  use swage_unknowns, only: unknowns_t
  implicit none(type, external)
  private

  public :: factor_layout_t, factor_layout_create, return_plan_t
  public :: UNSYMMETRIC, WITHOUT_PIVOTING, SYMMETRIC

  !> Kinds of factors: LU of the matrix; LDL^T of its symmetric part without pivoting, which a
  !> quasi-definite matrix allows; the same with pivoting.
  integer, parameter :: UNSYMMETRIC = 0
  integer, parameter :: WITHOUT_PIVOTING = 1
  integer, parameter :: SYMMETRIC = 2

  type :: factor_layout_t
    type(comm_t) :: comm
    !> Exchange of the unknown nodes between ranks.
    type(halo_t) :: halo
    integer :: n_slot = 0
    !> Unknown nodes of this rank, its own first.
    integer :: n_node = 0
    integer :: n_own_node = 0
    !> Unknowns of all ranks.
    integer :: n_unknown = 0
    !> As in [[unknowns_t]].
    integer(gp), allocatable :: node_global(:)
    integer(gp), allocatable :: node_offset(:)
    !> Place of each unknown in the elimination, on rank 0; empty elsewhere.
    integer, allocatable :: order(:)
    !> Version of the pattern that has this order, -1 before the first.
    integer, private :: ordered_version = -1
  contains
    !> Collective. Order the unknowns for a pattern.
    procedure, public :: find_order => factor_layout_find_order
  end type factor_layout_t

  !> Where the unknowns go that a solver leaves scattered over the ranks. The same for every
  !> solution with the same factors.
  type :: return_plan_t
    private
    !> Place in the scattered list of what is sent, by rank of the receiver, and how much.
    integer, allocatable :: sent(:), n_sent(:)
    !> Slot and node of what is received, by rank of the sender, and how much.
    integer, allocatable :: slot(:), node(:), n_received(:)
  contains
    !> Collective. Find the way.
    procedure, public :: create => return_plan_create
    !> Collective. Bring a solution to the owners.
    procedure, public :: apply => return_plan_apply
  end type return_plan_t

contains

  !> Number the unknowns.
  subroutine factor_layout_create(comm, halo, unknowns, layout, status)
    type(comm_t), intent(in) :: comm
    type(halo_t), intent(in) :: halo
    type(unknowns_t), intent(in) :: unknowns
    type(factor_layout_t), intent(out) :: layout
    !> `STATUS_ERROR`, the same on all ranks, when there are too many unknowns.
    type(status_t), intent(inout) :: status

    layout%comm = comm
    layout%halo = halo
    layout%n_slot = unknowns%n_slot
    layout%n_node = unknowns%n_node
    layout%n_own_node = unknowns%n_own_node
    allocate (layout%node_global, source=unknowns%node_global)
    allocate (layout%node_offset(0:size(unknowns%node_offset) - 1))
    layout%node_offset(:) = unknowns%node_offset(:)
    if (unknowns%n_node_global * unknowns%n_slot > int(huge(1), gp)) then
      call status%raise(STATUS_ERROR, 'factor_layout_create', 'the mesh has more unknowns than '// &
                        'can be numbered with 32-bit integers: use a coarser mesh', EXIT_SOLVER)
      return
    end if
    layout%n_unknown = int(unknowns%n_node_global) * unknowns%n_slot

  end subroutine factor_layout_create

  subroutine factor_layout_find_order(self, matrix, version, status)
    class(factor_layout_t), intent(inout) :: self
    !> Its pattern counts, not its values.
    type(block_matrix_t), intent(in) :: matrix
    !> Of the pattern: the present one or one of before.
    integer, intent(in) :: version
    !> `STATUS_ERROR`, the same on all ranks, when METIS fails.
    type(status_t), intent(inout) :: status

    if (version == self%ordered_version) return
    call dissect(self, matrix, version, self%order, status)
    call self%comm%agree(status)
    if (.not. status%failed()) self%ordered_version = version

  end subroutine factor_layout_find_order

  subroutine return_plan_create(self, layout, index)
    class(return_plan_t), intent(inout) :: self
    type(factor_layout_t), intent(in) :: layout
    !> Numbers of the unknowns that the solver leaves on this rank, of all ranks, from 1.
    integer, intent(in) :: index(:)

    integer, allocatable :: index_in(:), index_out(:), next(:), rank_of(:)
    integer :: i, last, m, rank

    m = layout%n_slot
    last = layout%comm%size - 1
    if (allocated(self%sent)) deallocate (self%sent, self%n_sent, self%slot, self%node, &
                                          self%n_received)
    allocate (self%sent(size(index)), self%n_sent(0:last), self%n_received(0:last))
    allocate (rank_of(size(index)), next(0:last))
    self%n_sent = 0
    do i = 1, size(index)
      rank_of(i) = owner(layout%node_offset, int((index(i) - 1) / m + 1, gp))
      self%n_sent(rank_of(i)) = self%n_sent(rank_of(i)) + 1
    end do
    next(0) = 0
    do rank = 1, last
      next(rank) = next(rank - 1) + self%n_sent(rank - 1)
    end do
    do i = 1, size(index)
      next(rank_of(i)) = next(rank_of(i)) + 1
      self%sent(next(rank_of(i))) = i
    end do
    call layout%comm%exchange(self%n_sent, self%n_received)
    allocate (index_out, source=index(self%sent))
    allocate (index_in(sum(self%n_received)))
    call layout%comm%exchange(index_out, self%n_sent, index_in, self%n_received)
    allocate (self%slot(size(index_in)), self%node(size(index_in)))
    self%slot = mod(index_in - 1, m) + 1
    self%node = (index_in - 1) / m + 1 - int(layout%node_offset(layout%comm%rank))

  end subroutine return_plan_create

  subroutine return_plan_apply(self, comm, values, solution)
    class(return_plan_t), intent(in) :: self
    type(comm_t), intent(in) :: comm
    !> As scattered; shape of the index.
    real(wp), intent(in) :: values(:)
    !> On own nodes; others are left as they are. Shape (n_slot, n_node).
    real(wp), contiguous, intent(inout) :: solution(:, :)

    real(wp), allocatable :: received(:), sent(:)
    integer :: i

    if (comm%size == 1) then
      do i = 1, size(values)
        solution(self%slot(i), self%node(i)) = values(self%sent(i))
      end do
      return
    end if
    allocate (sent, source=values(self%sent))
    allocate (received(size(self%node)))
    call comm%exchange(sent, self%n_sent, received, self%n_received)
    do i = 1, size(received)
      solution(self%slot(i), self%node(i)) = received(i)
    end do

  end subroutine return_plan_apply

  !> Rank that owns a node.
  pure function owner(offset, node) result(rank)
    integer(gp), intent(in) :: offset(0:)
    integer(gp), intent(in) :: node
    integer :: rank

    integer :: high, low

    low = 0
    high = size(offset) - 2
    do while (low < high)
      rank = (low + high + 1) / 2
      if (offset(rank) < node) then
        low = rank
      else
        high = rank - 1
      end if
    end do
    rank = low

  end function owner

  !> Collective. Nested dissection of the graph of all unknown nodes, on rank 0.
  subroutine dissect(layout, matrix, version, order, status)
    class(factor_layout_t), intent(in) :: layout
    type(block_matrix_t), intent(in) :: matrix
    integer, intent(in) :: version
    !> Place of each unknown in the elimination, on rank 0; empty elsewhere.
    integer, allocatable, intent(out) :: order(:)
    type(status_t), intent(inout) :: status

    integer, allocatable :: from(:), neighbour(:), node_order(:), rows(:), sent(:), start(:), to(:)
    integer :: c, i, k, n

    ! Row, number of columns, columns
    n = 2 * matrix%n_node + int(matrix%n_block)
    if (allocated(matrix%coupling)) n = n + 2 * matrix%coupling%n_node + matrix%coupling%n_block()
    allocate (sent(n))
    k = 0
    do i = 1, matrix%n_node
      n = int(matrix%row_start(i + 1) - matrix%row_start(i))
      sent(k + 1) = int(layout%node_global(i))
      sent(k + 2) = n
      sent(k + 3:k + 2 + n) = int(layout%node_global(matrix%column(matrix%row_start(i): &
                                                                  matrix%row_start(i + 1) - 1)))
      k = k + 2 + n
    end do
    if (allocated(matrix%coupling)) call list_coupling(matrix%coupling, version, sent, k)
    associate (comm => layout%comm)
      allocate (to(0:comm%size - 1), from(0:comm%size - 1))
      to = 0
      to(0) = k
      call comm%exchange(to, from)
      allocate (rows(sum(from)))
      call comm%exchange(sent(:k), to, rows, from)
      if (comm%rank /= 0) then
        allocate (order(0))
        return
      end if
    end associate

    n = layout%n_unknown / layout%n_slot
    call build_graph(rows, n, start, neighbour)
    allocate (node_order(n), order(layout%n_unknown))
    call order_nodes(start, neighbour, node_order, status)
    if (status%failed()) return
    do i = 1, n
      do c = 1, layout%n_slot
        order(layout%n_slot * (i - 1) + c) = layout%n_slot * (node_order(i) - 1) + c
      end do
    end do

  end subroutine dissect

  !> Rows, numbers of columns, and columns, of all ranks.
  pure subroutine list_coupling(coupling, version, list, n)
    type(coupling_matrix_t), intent(in) :: coupling
    integer, intent(in) :: version
    !> Appended to.
    integer, intent(inout) :: list(:)
    !> Its numbers so far.
    integer, intent(inout) :: n

    integer :: i, k, length

    do i = 1, coupling%n_node
      length = n + 1
      list(length) = int(coupling%node_global(i))
      n = n + 2
      do k = coupling%row_start(i), coupling%row_start(i + 1) - 1
        if (coupling%since(k) > version) cycle
        n = n + 1
        list(n) = int(coupling%node_global(coupling%column(k)))
      end do
      list(length + 1) = n - length - 1
    end do

  end subroutine list_coupling

  !> Neighbours of each node, without itself, numbered from 1.
  pure subroutine build_graph(rows, n_node, start, neighbour)
    !> One after the other: row, number of columns, columns. A row may come more than once.
    integer, intent(in) :: rows(:)
    integer, intent(in) :: n_node
    integer, allocatable, intent(out) :: start(:)
    integer, allocatable, intent(out) :: neighbour(:)

    integer, allocatable :: before(:), last(:), stamp(:)
    integer :: i, k, n, part, pass

    ! Chain the parts of each row: `last` is the latest one, `before` what it follows
    allocate (last(n_node), before(size(rows)), stamp(n_node), start(n_node + 1), source=0)
    k = 1
    do while (k <= size(rows))
      before(k) = last(rows(k))
      last(rows(k)) = k
      k = k + 2 + rows(k + 1)
    end do

    do pass = 1, 2
      stamp = 0
      n = 0
      do i = 1, n_node
        start(i) = n + 1
        stamp(i) = i
        part = last(i)
        do while (part > 0)
          do k = part + 2, part + 1 + rows(part + 1)
            if (stamp(rows(k)) == i) cycle
            stamp(rows(k)) = i
            n = n + 1
            if (pass == 2) neighbour(n) = rows(k)
          end do
          part = before(part)
        end do
      end do
      start(n_node + 1) = n + 1
      if (pass == 1) allocate (neighbour(n))
    end do

  end subroutine build_graph

end module swage_factor_layout
