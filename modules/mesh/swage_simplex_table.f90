!> A hash table of cells or facets by their nodes, whatever the order these are given in.
module swage_simplex_table
  use swage_kinds, only: gp
  implicit none(type, external)
  private

  public :: simplex_table_t, simplex_table_create

  !> Simplices seen so far, numbered from 1 in the order of their arrival.
  type :: simplex_table_t
    private
    !> Simplices in the table.
    integer, public :: n = 0
    !> Ascending nodes of each; shape (n_corner, capacity).
    integer, allocatable :: key(:, :)
    !> First simplex of each chain, 0 none; shape (0:2^k - 1).
    integer, allocatable :: head(:)
    !> Next simplex of the same chain, 0 none; shape (capacity).
    integer, allocatable :: next(:)
  contains
    !> Number of a simplex, 0 when it is not there.
    procedure, public :: find => table_find
    !> Number of a simplex, which is added when it is not there.
    procedure, public :: insert => table_insert
  end type simplex_table_t

contains

  !> An empty table. Pages of the capacity that is never used cost no memory.
  pure subroutine simplex_table_create(n_corner, capacity, table)
    integer, intent(in) :: n_corner
    integer, intent(in) :: capacity
    type(simplex_table_t), intent(out) :: table

    integer :: n_chain

    n_chain = 64
    do while (n_chain < capacity .and. n_chain < 2**29)
      n_chain = 2 * n_chain
    end do
    allocate (table%key(n_corner, capacity), table%next(capacity), table%head(0:n_chain - 1))
    table%head = 0

  end subroutine simplex_table_create

  pure function table_find(self, nodes) result(number)
    class(simplex_table_t), intent(in) :: self
    !> Shape (n_corner).
    integer, intent(in) :: nodes(:)
    integer :: number

    integer :: key(size(nodes))

    key = ascending(nodes)
    number = self%head(chain_of(key, size(self%head)))
    do while (number > 0)
      if (all(self%key(:, number) == key)) return
      number = self%next(number)
    end do

  end function table_find

  pure subroutine table_insert(self, nodes, number)
    class(simplex_table_t), intent(inout) :: self
    !> Shape (n_corner).
    integer, intent(in) :: nodes(:)
    !> `n` after the call when it is new.
    integer, intent(out) :: number

    integer :: key(size(nodes))
    integer :: chain

    key = ascending(nodes)
    chain = chain_of(key, size(self%head))
    number = self%head(chain)
    do while (number > 0)
      if (all(self%key(:, number) == key)) return
      number = self%next(number)
    end do
    self%n = self%n + 1
    number = self%n
    self%key(:, number) = key
    self%next(number) = self%head(chain)
    self%head(chain) = number

  end subroutine table_insert

  !> Insertion sort of at most four numbers.
  pure function ascending(nodes) result(sorted)
    integer, intent(in) :: nodes(:)
    integer :: sorted(size(nodes))

    integer :: i, j, node

    sorted = nodes
    do i = 2, size(sorted)
      node = sorted(i)
      j = i - 1
      do while (j > 0)
        if (sorted(j) <= node) exit
        sorted(j + 1) = sorted(j)
        j = j - 1
      end do
      sorted(j + 1) = node
    end do

  end function ascending

  !> Chain of a key: near those of the neighbouring nodes, because meshes are read place by place
  !> and memory is fast where it has just been used; but wide enough for a node with many cells.
  pure function chain_of(key, n_chain) result(chain)
    !> Ascending.
    integer, intent(in) :: key(:)
    !> A power of two.
    integer, intent(in) :: n_chain
    integer :: chain

    !> Chains from one lowest node to the next, and those that one lowest node may use.
    integer(gp), parameter :: STRIDE = 16_gp, WINDOW = 256_gp
    integer(gp), parameter :: FACTOR = 40503_gp
    integer(gp), parameter :: MASK = 2_gp**44 - 1_gp
    integer(gp) :: hash
    integer :: i

    hash = 0_gp
    do i = 2, size(key)
      ! Masked to 44 bits, so that the product stays below 2^63.
      hash = iand((hash + int(key(i), gp)) * FACTOR, MASK)
      hash = ieor(hash, ishft(hash, -13))
    end do
    chain = int(iand(STRIDE * int(key(1), gp) + modulo(hash, WINDOW), int(n_chain - 1, gp)))

  end function chain_of

end module swage_simplex_table
