!> Small systems of equations on the nodes of a cube, shared out to any number of ranks.
module swage_test_systems
  use swage_block_matrix, only: block_matrix_create, block_matrix_t
  use swage_comm, only: comm_t
  use swage_coupling_matrix, only: coupling_matrix_create
  use swage_halo, only: halo_create, halo_t
  use swage_kinds, only: gp, wp
  use swage_point_batch, only: LANES
  use swage_test_meshes, only: box_mesh, rectangle_mesh
  use swage_test_random, only: random_t
  use swage_unknowns, only: unknowns_t, UNKNOWN_OF_MESH
  implicit none(type, external)
  private

  public :: system_t, system_create

  !> A matrix and a right-hand side, the same whatever the number of ranks.
  type :: system_t
    type(comm_t) :: comm
    type(halo_t) :: halo
    type(unknowns_t) :: unknowns
    type(block_matrix_t) :: matrix
    !> Shape (n_slot, n_node).
    real(wp), allocatable :: right_hand_side(:, :)
    !> The matrix of all ranks, on each of them; unknowns slot by slot, nodes as the mesh counts
    !> them; shape (n, n).
    real(wp), allocatable :: dense(:, :)
    !> Number of each local node in the whole mesh; shape (n_node).
    integer, allocatable :: whole(:)
    !> The same of the nodes that are coupled.
    integer, allocatable :: coupled(:)
  contains
    !> Fill the matrix like that of incompressible flow: stiff, coupled, and a small negative block.
    procedure :: fill => system_fill
    !> Collective. Couple the first nodes of the mesh with the last ones, after `fill`.
    procedure :: couple => system_couple
    !> Collective. Make them ready to be coupled.
    procedure :: start_coupling => system_start_coupling
    !> Collective. The whole matrix anew, after a change of the values.
    procedure :: make_dense => system_make_dense
    !> A vector of the whole mesh, on the local nodes.
    procedure :: to_local => system_to_local
    !> Collective. A vector of local nodes, of the whole mesh.
    procedure :: to_whole => system_to_whole
  end type system_t

contains

  !> Collective. Nodes of the unit square (n_dim 2) or cube (3) in `n` intervals a side.
  subroutine system_create(comm, n_dim, n, system)
    type(comm_t), intent(in) :: comm
    integer, intent(in) :: n_dim
    integer, intent(in) :: n
    type(system_t), intent(out) :: system

    integer, allocatable :: cells(:, :), local(:), number(:), owner(:)
    real(wp), allocatable :: x(:, :)
    integer :: cell, first, i, last, n_cell, n_node, rank

    system%comm = comm
    if (n_dim == 2) then
      call rectangle_mesh(n, n, x, cells)
    else
      call box_mesh(n, x, cells)
    end if
    n_cell = size(cells, 2)
    n_node = size(x, 2)

    ! A node belongs to the first rank that has a cell of it
    allocate (owner(n_node), source=comm%size)
    do rank = comm%size - 1, 0, -1
      call cells_of(rank, comm%size, n_cell, first, last)
      do cell = first, last
        owner(cells(:, cell)) = rank
      end do
    end do
    allocate (number(n_node), local(n_node), source=0)
    associate (u => system%unknowns)
      allocate (u%node_offset(0:comm%size))
      last = 0
      do rank = 0, comm%size - 1
        u%node_offset(rank) = last
        do i = 1, n_node
          if (owner(i) /= rank) cycle
          last = last + 1
          number(i) = last
        end do
      end do
      u%node_offset(comm%size) = last

      call cells_of(comm%rank, comm%size, n_cell, first, last)
      u%n_slot = n_dim + 1
      u%n_node_global = n_node
      u%n_own_node = count(owner == comm%rank)
      u%n_node = 0
      do i = 1, n_node
        if (owner(i) == comm%rank) call append(i)
      end do
      do i = 1, n_node
        if (owner(i) == comm%rank) cycle
        if (any(cells(:, first:last) == i)) call append(i)
      end do
      system%whole = [(findloc(local, i, dim=1), i=1, u%n_node)]
      allocate (u%node_global(u%n_node))
      u%node_global = number(system%whole)
      allocate (u%kind(u%n_node), source=UNKNOWN_OF_MESH)
      u%mesh_node = [(i, i=1, u%n_node)]
      allocate (u%cell_node(n_dim + 1, last - first + 1))
      do cell = first, last
        u%cell_node(:, cell - first + 1) = local(cells(:, cell))
      end do
      call halo_create(comm, u%n_own_node, u%node_global, u%node_offset, system%halo)
      call block_matrix_create(u, system%matrix)
      allocate (system%right_hand_side(u%n_slot, u%n_node), source=0.0_wp)
    end associate
    allocate (system%dense(n_node * (n_dim + 1), n_node * (n_dim + 1)), source=0.0_wp)

  contains

    subroutine append(node)
      integer, intent(in) :: node

      system%unknowns%n_node = system%unknowns%n_node + 1
      local(node) = system%unknowns%n_node

    end subroutine append

  end subroutine system_create

  !> Cells of a rank, in the order of the whole mesh.
  pure subroutine cells_of(rank, n_rank, n_cell, first, last)
    integer, intent(in) :: rank
    integer, intent(in) :: n_rank
    integer, intent(in) :: n_cell
    integer, intent(out) :: first
    integer, intent(out) :: last

    first = rank * n_cell / n_rank + 1
    last = (rank + 1) * n_cell / n_rank

  end subroutine cells_of

  !> Each cell adds A B; B^T -C to its displacements and pressures, with A positive definite, C
  !> small and positive definite, and A made unsymmetric by `skew`.
  subroutine system_fill(self, skew, scatter)
    class(system_t), intent(inout) :: self
    !> Size of the unsymmetric part by the symmetric one [1].
    real(wp), intent(in) :: skew
    !> Stiffness of neighbouring cells differs by factors up to 10^scatter.
    real(wp), intent(in) :: scatter

    type(random_t) :: random
    real(wp), allocatable :: batch(:, :, :, :, :), cell_matrix(:, :)
    real(wp) :: stiffness
    integer :: cell, first, i, j, last, m, n_cell, n_cell_all, n_vertex, place

    associate (u => self%unknowns)
      m = u%n_slot
      n_vertex = size(u%cell_node, 1)
      n_cell = size(u%cell_node, 2)
      allocate (cell_matrix(m * n_vertex, m * n_vertex))
      allocate (batch(4, LANES, 4, 4, 4), source=0.0_wp)
      n_cell_all = n_cell
      call sum_integer(self%comm, n_cell_all)
      call cells_of(self%comm%rank, self%comm%size, n_cell_all, first, last)
      call self%matrix%clear()
      do cell = 1, last
        call random%next(0.0_wp, scatter, stiffness)
        call random_cell(random, m, n_vertex, skew, cell_matrix)
        if (cell < first) cycle
        do j = 1, n_vertex
          do i = 1, n_vertex
            associate (block => cell_matrix(m * (i - 1) + 1:m * i, m * (j - 1) + 1:m * j))
              block(:m - 1, :m - 1) = block(:m - 1, :m - 1) * 10.0_wp**stiffness
              block(m, m) = block(m, m) * 10.0_wp**(-stiffness)
              batch(:m, 1, :m, i, j) = block
            end associate
          end do
        end do
        call self%matrix%add_cells([cell - first + 1], batch)
      end do
      do i = 1, u%n_node
        do j = 1, m
          place = m * (self%whole(i) - 1) + j
          self%right_hand_side(j, i) = sin(1.7_wp * place)
        end do
      end do
    end associate
    call self%make_dense()

  end subroutine system_fill

  !> Random, of the form of [[system_fill]].
  subroutine random_cell(random, m, n_vertex, skew, cell_matrix)
    type(random_t), intent(inout) :: random
    integer, intent(in) :: m
    integer, intent(in) :: n_vertex
    real(wp), intent(in) :: skew
    real(wp), intent(out) :: cell_matrix(:, :)

    real(wp) :: factor(m * n_vertex, m * n_vertex)
    logical :: pressure(m * n_vertex)
    integer :: i, j

    do j = 1, size(factor, 2)
      call random%fill(-1.0_wp, 1.0_wp, factor(:, j))
    end do
    pressure = [(mod(i, m) == 0, i=1, m * n_vertex)]
    cell_matrix = matmul(factor, transpose(factor))
    do j = 1, size(factor, 2)
      do i = 1, size(factor, 1)
        if (pressure(i) .and. pressure(j)) then
          cell_matrix(i, j) = -1.0e-2_wp * cell_matrix(i, j)
        else if (pressure(i)) then
          cell_matrix(i, j) = 0.3_wp * factor(j, i)
        else if (pressure(j)) then
          cell_matrix(i, j) = 0.3_wp * factor(i, j)
        else
          cell_matrix(i, j) = cell_matrix(i, j) + skew * (factor(i, j) - factor(j, i))
        end if
      end do
    end do

  end subroutine random_cell

  !> Springs between nodes of opposite sides, each added by the rank whose turn it is, and what is
  !> unsymmetric like friction. Where there are springs already they become more.
  subroutine system_couple(self, n_pair, stiffness, friction, n_linked)
    class(system_t), intent(inout) :: self
    !> Nodes on each side, the same every time; node i of one side gets springs to nodes i and i + 1
    !> of the other.
    integer, intent(in) :: n_pair
    real(wp), intent(in) :: stiffness
    !> Unsymmetric part by the stiffness [1].
    real(wp), intent(in) :: friction
    !> Nodes of each side that get springs; all when absent.
    integer, intent(in), optional :: n_linked

    integer, allocatable :: columns(:), rows(:)
    real(wp) :: block(3, 3), column(3, 3)
    integer :: i, j, n, pass

    n = n_pair
    if (present(n_linked)) n = n_linked
    if (.not. allocated(self%matrix%coupling)) call self%start_coupling(n_pair)
    associate (coupling => self%matrix%coupling)
      ! Where friction points, and what it follows
      column = 0.0_wp
      column(1, 2) = friction * stiffness
      do pass = 1, 2
        allocate (rows(0), columns(0))
        do i = 1, n
          do j = i, min(i + 1, n)
            if (modulo(i + j, self%comm%size) /= self%comm%rank) cycle
            if (pass == 1) then
              rows = [rows, i]
              columns = [columns, n_pair + j]
            else
              block = stiffness * spread([1.0_wp, 0.5_wp, 0.25_wp * (i + j)], 1, 3) &
                * spread([1.0_wp, 0.5_wp, 0.25_wp * (i + j)], 2, 3)
              call coupling%add(i, i, block, .false.)
              call coupling%add(n_pair + j, n_pair + j, block, .false.)
              call coupling%add(i, n_pair + j, -block, .false.)
              call coupling%add(n_pair + j, i, -block, .false.)
              call coupling%add(i, n_pair + j, column, .true.)
            end if
          end do
        end do
        if (pass == 1) call coupling%expect(rows, columns)
        deallocate (rows, columns)
      end do
    end associate
    call self%make_dense()

  end subroutine system_couple

  !> Collective. No springs yet.
  subroutine system_start_coupling(self, n_pair)
    class(system_t), intent(inout) :: self
    !> Nodes on each side.
    integer, intent(in) :: n_pair

    integer(gp), allocatable :: node_global(:)
    integer, allocatable :: unknown_node(:), whole(:)
    logical, allocatable :: is_own(:)
    integer :: i, n

    n = int(self%unknowns%n_node_global)
    allocate (whole, source=[(i, i=1, n_pair), (n - n_pair + i, i=1, n_pair)])
    allocate (unknown_node(2 * n_pair), is_own(2 * n_pair))
    allocate (node_global(2 * n_pair), source=0_gp)
    do i = 1, size(whole)
      unknown_node(i) = findloc(self%whole, whole(i), dim=1)
      is_own(i) = unknown_node(i) > 0 .and. unknown_node(i) <= self%unknowns%n_own_node
      if (is_own(i)) node_global(i) = self%unknowns%node_global(unknown_node(i))
    end do
    call self%comm%sum(node_global)
    allocate (self%coupled, source=whole)
    allocate (self%matrix%coupling)
    call coupling_matrix_create(self%comm, self%unknowns%n_slot - 1, node_global, unknown_node, &
                                is_own, self%matrix%coupling)

  end subroutine system_start_coupling

  subroutine system_make_dense(self)
    class(system_t), intent(inout) :: self

    integer :: i, j, m, place
    integer(gp) :: k

    m = self%unknowns%n_slot
    self%dense = 0.0_wp
    do i = 1, self%matrix%n_node
      do k = self%matrix%row_start(i), self%matrix%row_start(i + 1) - 1_gp
        j = self%whole(self%matrix%column(k))
        associate (block => self%dense(m * (self%whole(i) - 1) + 1:m * self%whole(i), &
                                       m * (j - 1) + 1:m * j))
          block = block + self%matrix%values(:, :, k)
        end associate
      end do
    end do
    if (allocated(self%matrix%coupling)) then
      associate (coupling => self%matrix%coupling)
        do i = 1, coupling%n_node
          do place = coupling%row_start(i), coupling%row_start(i + 1) - 1
            j = self%coupled(coupling%column(place))
            associate (block => self%dense(m * (self%coupled(i) - 1) + 1:m * self%coupled(i) - 1, &
                                           m * (j - 1) + 1:m * j - 1))
              block = block + coupling%values(:, :, place)
            end associate
          end do
        end do
      end associate
    end if
    do i = 1, size(self%dense, 2)
      call self%comm%sum(self%dense(:, i))
    end do

  end subroutine system_make_dense

  pure function system_to_local(self, vector) result(values)
    class(system_t), intent(in) :: self
    !> Unknowns of the whole mesh, node by node.
    real(wp), intent(in) :: vector(:)
    real(wp) :: values(self%unknowns%n_slot, self%unknowns%n_node)

    integer :: i, m

    m = self%unknowns%n_slot
    do i = 1, self%unknowns%n_node
      values(:, i) = vector(m * (self%whole(i) - 1) + 1:m * self%whole(i))
    end do

  end function system_to_local

  function system_to_whole(self, values) result(vector)
    class(system_t), intent(in) :: self
    !> Shape (n_slot, n_node).
    real(wp), intent(in) :: values(:, :)
    real(wp) :: vector(size(self%dense, 1))

    integer :: i, m

    m = self%unknowns%n_slot
    vector = 0.0_wp
    do i = 1, self%unknowns%n_own_node
      vector(m * (self%whole(i) - 1) + 1:m * self%whole(i)) = values(:, i)
    end do
    call self%comm%sum(vector)

  end function system_to_whole

  subroutine sum_integer(comm, value)
    type(comm_t), intent(in) :: comm
    integer, intent(inout) :: value

    integer(gp) :: long

    long = value
    call comm%sum(long)
    value = int(long)

  end subroutine sum_integer

end module swage_test_systems
