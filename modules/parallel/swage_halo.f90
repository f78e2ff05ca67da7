!> Exchange of nodal values between the ranks that share nodes.
module swage_halo
  use swage_comm, only: comm_t
  use swage_kinds, only: gp, wp
  use swage_sort, only: sorting_order
  implicit none(type, external)
  private

  public :: halo_t, halo_create

  !> Which nodes this rank shares with which others. Holds no resource: copy it freely.
  !>
  !> A shared node has one owner, where it is `owned`, and copies on other ranks, its `ghosts`.
  type :: halo_t
    private
    type(comm_t) :: comm
    integer :: n_node = 0
    !> Local numbers of owned nodes that have copies elsewhere, by rank of the copy.
    integer, allocatable :: owned(:)
    !> Copies on each rank of nodes owned here; shape (0:n_rank - 1).
    integer, allocatable :: n_owned(:)
    !> Local numbers of nodes owned elsewhere, by rank of the owner.
    integer, allocatable :: ghost(:)
    !> Nodes here that each rank owns; shape (0:n_rank - 1).
    integer, allocatable :: n_ghost(:)
  contains
    !> Collective. Sum of all copies of each node, on every copy.
    procedure, public :: accumulate => halo_accumulate
    !> Collective. The owner's value on every copy.
    procedure, public :: update => halo_update
  end type halo_t

contains

  !> Collective. Find out which nodes are shared, from their global numbers.
  subroutine halo_create(comm, n_own_node, node_global, node_offset, halo)
    type(comm_t), intent(in) :: comm
    !> Nodes owned by this rank; they come first.
    integer, intent(in) :: n_own_node
    !> Global number of each local node; shape (n_node).
    integer(gp), contiguous, intent(in) :: node_global(:)
    !> Rank r owns the global numbers node_offset(r) + 1 to node_offset(r + 1); shape (0:n_rank).
    integer(gp), contiguous, intent(in) :: node_offset(0:)
    type(halo_t), intent(out) :: halo

    integer(gp), allocatable :: offered(:), wanted(:)
    integer, allocatable :: order(:)
    integer :: i, owner

    halo%comm = comm
    halo%n_node = size(node_global)
    allocate (halo%n_ghost(0:comm%size - 1), halo%n_owned(0:comm%size - 1))
    halo%n_ghost = 0

    ! Ascending global numbers are ordered by owner.
    allocate (order(halo%n_node - n_own_node))
    order = sorting_order(node_global(n_own_node + 1:))
    allocate (halo%ghost(size(order)))
    owner = 0
    do i = 1, size(order)
      halo%ghost(i) = n_own_node + order(i)
      do while (node_global(halo%ghost(i)) > node_offset(owner + 1))
        owner = owner + 1
      end do
      halo%n_ghost(owner) = halo%n_ghost(owner) + 1
    end do

    call comm%exchange(halo%n_ghost, halo%n_owned)
    allocate (wanted(size(order)), offered(sum(halo%n_owned)))
    wanted = node_global(halo%ghost)
    call comm%exchange(wanted, halo%n_ghost, offered, halo%n_owned)
    allocate (halo%owned(size(offered)))
    halo%owned = int(offered - node_offset(comm%rank))

  end subroutine halo_create

  !> The owner adds the others' terms to its own in the order of their ranks, so that the sum is
  !> the same every time, and sends the result to the copies, so that all have the same bits.
  subroutine halo_accumulate(self, values)
    class(halo_t), intent(in) :: self
    !> This rank's contributions on entry, sums on return; shape (n_component, n_node).
    real(wp), contiguous, intent(inout) :: values(:, :)

    real(wp), allocatable :: received(:), sent(:)
    integer :: i, n_component

    if (self%comm%size == 1) return
    n_component = size(values, 1)
    call pack_values(values, self%ghost, sent)
    allocate (received(n_component * size(self%owned)))
    call self%comm%exchange(sent, n_component * self%n_ghost, received, &
                            n_component * self%n_owned)

    do i = 1, size(self%owned)
      values(:, self%owned(i)) = values(:, self%owned(i)) &
        + received((i - 1) * n_component + 1:i * n_component)
    end do
    call self%update(values)

  end subroutine halo_accumulate

  subroutine halo_update(self, values)
    class(halo_t), intent(in) :: self
    !> Right on owned nodes on entry, on all on return; shape (n_component, n_node).
    real(wp), contiguous, intent(inout) :: values(:, :)

    real(wp), allocatable :: received(:), sent(:)
    integer :: i, n_component

    if (self%comm%size == 1) return
    n_component = size(values, 1)
    call pack_values(values, self%owned, sent)
    allocate (received(n_component * size(self%ghost)))
    call self%comm%exchange(sent, n_component * self%n_owned, received, &
                            n_component * self%n_ghost)
    do i = 1, size(self%ghost)
      values(:, self%ghost(i)) = received((i - 1) * n_component + 1:i * n_component)
    end do

  end subroutine halo_update

  !> Values of some nodes, one after the other.
  pure subroutine pack_values(values, nodes, packed)
    real(wp), intent(in) :: values(:, :)
    integer, intent(in) :: nodes(:)
    real(wp), allocatable, intent(out) :: packed(:)

    integer :: i, n_component

    n_component = size(values, 1)
    allocate (packed(n_component * size(nodes)))
    do i = 1, size(nodes)
      packed((i - 1) * n_component + 1:i * n_component) = values(:, nodes(i))
    end do

  end subroutine pack_values

end module swage_halo
