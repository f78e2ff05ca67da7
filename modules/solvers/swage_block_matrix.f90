!> A sparse matrix of small dense blocks, one for each pair of unknown nodes that share a cell.
!>
!> A cell where media meet has pressures at other unknown nodes than displacements: its matrix is
!> split, each pair of vertices over four blocks.
!>
!> Each rank holds what its own cells contribute; the matrix is the sum over the ranks, which the
!> direct solver and the matrix-vector product take at their own time.
module swage_block_matrix
  use swage_coupling_matrix, only: coupling_matrix_t
  use swage_halo, only: halo_t
  use swage_kinds, only: gp, wp
  use swage_point_batch, only: LANES
  use swage_relation, only: relation_from_pairs, relation_t
  use swage_unknowns, only: unknowns_t, UNKNOWN_PRESSURE
  implicit none(type, external)
  private

  public :: block_matrix_t, block_matrix_create

  type :: block_matrix_t
    !> Rows of a block.
    integer :: n_slot = 0
    !> Block rows.
    integer :: n_node = 0
    !> Blocks of this rank.
    integer(gp) :: n_block = 0_gp
    !> First block of each row, and one past the last of all; shape (n_node + 1).
    integer(gp), allocatable :: row_start(:)
    !> Column of each block, ascending in a row; shape (n_block).
    integer, allocatable :: column(:)
    !> Block on the diagonal of each row; shape (n_node).
    integer(gp), allocatable :: diagonal(:)
    !> Blocks of each cell, row vertex fastest; shape (n_vertex, n_vertex, n_cell). Short integers,
    !> which are read faster: as many blocks as they can count take 256 GB on one rank.
    integer, allocatable :: cell_block(:, :, :)
    !> Place of each cell among those that are split, 0 for others; not allocated when there is
    !> none; shape (n_cell).
    integer, allocatable :: split_of_cell(:)
    !> Blocks of split cells beside `cell_block`, which has displacements in row and column:
    !> pressure in the column, in the row, in both; shape (3, n_vertex, n_vertex, n_split).
    integer, allocatable :: split_block(:, :, :, :)
    !> Rows of this rank whose displacement slots are idle.
    integer, allocatable :: idle_row(:)
    !> Shape (n_slot, n_slot, n_block), rows first.
    real(wp), allocatable :: values(:, :, :)
    !> Blocks with a part that no symmetric matrix can stand for, as how friction grows with the
    !> pressure. It is in `values` too: the product is that of the whole matrix, and a symmetric
    !> factor leaves this part out, which mirrored would make it indefinite.
    integer :: n_extra = 0
    !> Row, and block, of each; shape (n_extra) or longer.
    integer, allocatable :: extra_row(:)
    integer(gp), allocatable :: extra_block(:)
    !> The part; shape (n_slot, n_slot, n_extra) or longer.
    real(wp), allocatable :: extra(:, :, :)
    !> Place of each block in the list, 0 if it has no such part; shape (n_block).
    integer, allocatable :: extra_of_block(:)
    !> Blocks between nodes that no cell joins, where bodies touch; part of the matrix.
    type(coupling_matrix_t), allocatable :: coupling
    !> Rows to which a cell is the first to contribute, in the order that
    !> [[block_matrix_t:expect]] was told, by cell; behind the cells those of no cell.
    type(relation_t), private :: new_rows
    !> Whether cells clear the rows that are new with them.
    logical, private :: renewing = .false.
  contains
    !> How often the pattern has grown.
    procedure :: version => block_matrix_version
    !> Set all values to zero.
    procedure :: clear => block_matrix_clear
    !> Tell the order in which the cells will come.
    procedure :: expect => block_matrix_expect
    !> Forget all values: all cells follow, in the order expected, before anything else.
    procedure :: renew => block_matrix_renew
    !> Add the matrices of a batch of cells, unknowns vertex by vertex.
    procedure :: add_cells => block_matrix_add_cells
    !> Add to the leading rows and columns of a block what a symmetric factor is to leave out.
    procedure :: add_unsymmetric => block_matrix_add_unsymmetric
    !> Block of the symmetric part, without what is listed as unsymmetric.
    procedure :: symmetric_block => block_matrix_symmetric_block
    !> Make the rows of idle slots those of the identity, once all cells have come.
    procedure :: complete => block_matrix_complete
    !> Collective. Product with a vector given on all copies of the nodes.
    procedure :: multiply => block_matrix_multiply
    !> Collective. Inverse roots of the sizes of the diagonal.
    procedure :: inverse_root_diagonal => block_matrix_inverse_root_diagonal
  end type block_matrix_t

contains

  !> Pattern of all pairs of unknown nodes of a cell; values zero.
  pure subroutine block_matrix_create(unknowns, matrix)
    type(unknowns_t), intent(in) :: unknowns
    type(block_matrix_t), intent(out) :: matrix

    integer, allocatable :: cell_of_node(:), first(:), node_of_cell(:, :), stamp(:)
    integer(gp), allocatable :: place(:)
    integer :: a, b, cell, i, j, n, n_cell, n_node, n_vertex, pass
    integer(gp) :: filled, k

    n_node = unknowns%n_node
    n_vertex = size(unknowns%cell_node, 1)
    n_cell = size(unknowns%cell_node, 2)
    matrix%n_slot = unknowns%n_slot
    matrix%n_node = n_node

    call list_split_cells(unknowns, matrix)
    ! All unknown nodes of each cell; those of displacement and pressure may be given twice
    n = n_vertex
    if (allocated(matrix%split_of_cell)) n = 2 * n_vertex
    allocate (node_of_cell(n, n_cell))
    node_of_cell(:n_vertex, :) = unknowns%cell_node
    if (n > n_vertex) node_of_cell(n_vertex + 1:, :) = unknowns%cell_pressure
    call list_cells(node_of_cell, n_node, first, cell_of_node)

    ! Count, then fill: a stamp says that a column was met in this row
    allocate (stamp(n_node), matrix%row_start(n_node + 1), matrix%diagonal(n_node))
    do pass = 1, 2
      stamp = 0
      filled = 0_gp
      matrix%row_start(1) = 1_gp
      do i = 1, n_node
        n = 0
        do j = first(i), first(i + 1) - 1
          do a = 1, size(node_of_cell, 1)
            associate (node => node_of_cell(a, cell_of_node(j)))
              if (stamp(node) == i) cycle
              stamp(node) = i
              n = n + 1
              if (pass == 2) matrix%column(filled + n) = node
            end associate
          end do
        end do
        ! A node of no cell still has its diagonal
        if (stamp(i) /= i) then
          n = n + 1
          if (pass == 2) matrix%column(filled + n) = i
        end if
        if (pass == 2) call sort(matrix%column(filled + 1:filled + n))
        filled = filled + n
        matrix%row_start(i + 1) = filled + 1_gp
      end do
      if (pass == 1) allocate (matrix%column(filled))
    end do
    matrix%n_block = filled
    allocate (matrix%values(matrix%n_slot, matrix%n_slot, filled), source=0.0_wp)
    allocate (matrix%extra_of_block(filled), source=0)
    allocate (matrix%extra_row(0), matrix%extra_block(0))
    allocate (matrix%extra(matrix%n_slot, matrix%n_slot, 0))

    ! Where the blocks of each cell lie: scatter the row, then look up
    allocate (matrix%cell_block(n_vertex, n_vertex, n_cell), place(n_node))
    do i = 1, n_node
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1_gp
        place(matrix%column(k)) = k
      end do
      matrix%diagonal(i) = place(i)
      do j = first(i), first(i + 1) - 1
        cell = cell_of_node(j)
        do a = 1, n_vertex
          if (unknowns%cell_node(a, cell) /= i) cycle
          do b = 1, n_vertex
            matrix%cell_block(a, b, cell) = int(place(unknowns%cell_node(b, cell)))
          end do
        end do
        if (allocated(matrix%split_of_cell)) call place_split(unknowns, cell, i, place, matrix)
      end do
    end do

  end subroutine block_matrix_create

  !> Cells with a pressure that is not at the node of the displacement; rows with idle slots.
  pure subroutine list_split_cells(unknowns, matrix)
    type(unknowns_t), intent(in) :: unknowns
    type(block_matrix_t), intent(inout) :: matrix

    integer, allocatable :: split_of_cell(:)
    integer :: cell, i, n

    associate (kind => unknowns%kind(:unknowns%n_own_node))
      allocate (matrix%idle_row(count(kind == UNKNOWN_PRESSURE)))
      matrix%idle_row(:) = pack([(i, i=1, size(kind))], kind == UNKNOWN_PRESSURE)
    end associate
    if (.not. allocated(unknowns%cell_pressure)) return
    allocate (split_of_cell(size(unknowns%cell_node, 2)), source=0)
    n = 0
    do cell = 1, size(split_of_cell)
      if (all(unknowns%cell_pressure(:, cell) == unknowns%cell_node(:, cell))) cycle
      n = n + 1
      split_of_cell(cell) = n
    end do
    if (n == 0) return
    call move_alloc(split_of_cell, matrix%split_of_cell)
    i = size(unknowns%cell_node, 1)
    allocate (matrix%split_block(3, i, i, n), source=0)

  end subroutine list_split_cells

  !> Where the blocks in a row of a cell lie that have pressures in row or column, if it is split.
  pure subroutine place_split(unknowns, cell, row, place, matrix)
    type(unknowns_t), intent(in) :: unknowns
    integer, intent(in) :: cell
    integer, intent(in) :: row
    !> Block of each column of the row.
    integer(gp), intent(in) :: place(:)
    type(block_matrix_t), intent(inout) :: matrix

    integer :: a, b

    if (matrix%split_of_cell(cell) == 0) return
    associate (block => matrix%split_block(:, :, :, matrix%split_of_cell(cell)), &
               node => unknowns%cell_node(:, cell), pressure => unknowns%cell_pressure(:, cell))
      do b = 1, size(node)
        do a = 1, size(node)
          if (node(a) == row) block(1, a, b) = int(place(pressure(b)))
          if (pressure(a) == row) then
            block(2, a, b) = int(place(node(b)))
            block(3, a, b) = int(place(pressure(b)))
          end if
        end do
      end do
    end associate

  end subroutine place_split

  pure function block_matrix_version(self) result(version)
    class(block_matrix_t), intent(in) :: self
    integer :: version

    version = 0
    if (allocated(self%coupling)) version = self%coupling%version

  end function block_matrix_version

  pure subroutine block_matrix_clear(self)
    class(block_matrix_t), intent(inout) :: self

    self%values = 0.0_wp
    self%renewing = .false.
    call forget_extra(self)
    if (allocated(self%coupling)) call self%coupling%clear()

  end subroutine block_matrix_clear

  !> Empty the list of unsymmetric parts.
  pure subroutine forget_extra(matrix)
    class(block_matrix_t), intent(inout) :: matrix

    matrix%extra_of_block(matrix%extra_block(:matrix%n_extra)) = 0
    matrix%n_extra = 0

  end subroutine forget_extra

  pure subroutine block_matrix_expect(self, cells)
    class(block_matrix_t), intent(inout) :: self
    !> All of them, each once.
    integer, intent(in) :: cells(:)

    integer, allocatable :: first_cell(:)
    integer :: a, i, row, split

    allocate (first_cell(self%n_node), source=size(cells) + 1)
    ! Backwards: the first remains
    do i = size(cells), 1, -1
      do a = 1, size(self%cell_block, 1)
        first_cell(self%column(self%cell_block(a, a, cells(i)))) = cells(i)
      end do
      if (.not. allocated(self%split_of_cell)) cycle
      split = self%split_of_cell(cells(i))
      if (split == 0) cycle
      do a = 1, size(self%cell_block, 1)
        first_cell(self%column(self%split_block(3, a, a, split))) = cells(i)
      end do
    end do
    call relation_from_pairs(size(cells) + 1, self%n_node, first_cell, &
                             [(row, row=1, self%n_node)], self%new_rows)

  end subroutine block_matrix_expect

  pure subroutine block_matrix_renew(self)
    class(block_matrix_t), intent(inout) :: self

    self%renewing = .true.
    call clear_new_rows(self, size(self%cell_block, 3) + 1)
    call forget_extra(self)
    if (allocated(self%coupling)) call self%coupling%clear()

  end subroutine block_matrix_renew

  !> Set the rows to zero that are new with a cell.
  pure subroutine clear_new_rows(matrix, cell)
    type(block_matrix_t), intent(inout) :: matrix
    integer, intent(in) :: cell

    integer :: i, row
    integer(gp) :: first

    do i = matrix%new_rows%first(cell), matrix%new_rows%first(cell + 1) - 1
      row = matrix%new_rows%item(i)
      first = matrix%row_start(row)
      call clear_values(int(matrix%row_start(row + 1) - first) * matrix%n_slot**2, &
                        matrix%values(:, :, first:matrix%row_start(row + 1) - 1_gp))
    end do

  end subroutine clear_new_rows

  !> All at once, whatever their shape.
  pure subroutine clear_values(n, values)
    integer, intent(in) :: n
    real(wp), intent(out) :: values(n)

    values = 0.0_wp

  end subroutine clear_values

  pure subroutine block_matrix_add_cells(self, cells, cell_matrices)
    class(block_matrix_t), intent(inout) :: self
    !> Up to `LANES`.
    integer, contiguous, intent(in) :: cells(:)
    !> By row of the block, cell, column of the block, vertex of the row and vertex of the column;
    !> the leading n_slot rows and columns, and n_vertex vertices, count.
    real(wp), intent(in) :: cell_matrices(4, LANES, 4, 4, 4)

    integer :: first, i

    if (self%renewing) then
      do i = 1, size(cells)
        call clear_new_rows(self, cells(i))
      end do
    end if
    first = 1
    if (allocated(self%split_of_cell)) then
      do i = 1, size(cells)
        if (self%split_of_cell(cells(i)) == 0) cycle
        call add_run(self, first, i - 1, cells, cell_matrices)
        call add_split_cell(self, cells(i), i, cell_matrices)
        first = i + 1
      end do
    end if
    call add_run(self, first, size(cells), cells, cell_matrices)

  end subroutine block_matrix_add_cells

  !> Cells of a batch from one place to another, none of them split.
  pure subroutine add_run(matrix, first, last, cells, cell_matrices)
    type(block_matrix_t), intent(inout) :: matrix
    integer, intent(in) :: first
    integer, intent(in) :: last
    integer, contiguous, intent(in) :: cells(:)
    real(wp), intent(in) :: cell_matrices(4, LANES, 4, 4, 4)

    if (matrix%n_slot == 4) then
      call add_blocks_of_4(size(matrix%cell_block, 3), matrix%n_block, first, last, &
                           matrix%cell_block, cells, cell_matrices, matrix%values)
    else
      call add_blocks_of_3(size(matrix%cell_block, 3), matrix%n_block, first, last, &
                           matrix%cell_block, cells, cell_matrices, matrix%values)
    end if

  end subroutine add_run

  !> One cell whose pressures have unknown nodes of their own.
  pure subroutine add_split_cell(matrix, cell, lane, cell_matrices)
    type(block_matrix_t), intent(inout) :: matrix
    integer, intent(in) :: cell
    !> Place of the cell in its batch.
    integer, intent(in) :: lane
    real(wp), intent(in) :: cell_matrices(4, LANES, 4, 4, 4)

    integer :: a, b, n

    n = matrix%n_slot
    associate (place => matrix%split_block(:, :, :, matrix%split_of_cell(cell)), &
               values => matrix%values)
      do b = 1, size(place, 3)
        do a = 1, size(place, 2)
          associate (part => cell_matrices(:n, lane, :n, a, b))
            associate (block => values(:n - 1, :n - 1, matrix%cell_block(a, b, cell)))
              block = block + part(:n - 1, :n - 1)
            end associate
            associate (column => values(:n - 1, n, place(1, a, b)))
              column = column + part(:n - 1, n)
            end associate
            associate (row => values(n, :n - 1, place(2, a, b)))
              row = row + part(n, :n - 1)
            end associate
            associate (corner => values(n, n, place(3, a, b)))
              corner = corner + part(n, n)
            end associate
          end associate
        end do
      end do
    end associate

  end subroutine add_split_cell

  !> Cells of four nodes; sizes are fixed, so that columns of blocks are added as vectors.
  pure subroutine add_blocks_of_4(n_cell, n_block, first, last, cell_block, cells, cell_matrices, &
                                  values)
    integer, intent(in) :: n_cell
    integer(gp), intent(in) :: n_block
    !> Of the cells.
    integer, intent(in) :: first, last
    integer, intent(in) :: cell_block(4, 4, n_cell)
    integer, intent(in) :: cells(last)
    real(wp), intent(in) :: cell_matrices(4, LANES, 4, 4, 4)
    real(wp), intent(inout) :: values(4, 4, n_block)

    integer :: a, b, c, d, i, k

    ! The directive keeps gfortran from unrolling the loop before it finds that it is a vector
    do i = first, last
      do b = 1, 4
        do a = 1, 4
          k = cell_block(a, b, cells(i))
          do d = 1, 4
            !GCC$ unroll 1
            do c = 1, 4
              values(c, d, k) = values(c, d, k) + cell_matrices(c, i, d, a, b)
            end do
          end do
        end do
      end do
    end do

  end subroutine add_blocks_of_4

  !> The same for cells of three nodes.
  pure subroutine add_blocks_of_3(n_cell, n_block, first, last, cell_block, cells, cell_matrices, &
                                  values)
    integer, intent(in) :: n_cell
    integer(gp), intent(in) :: n_block
    integer, intent(in) :: first, last
    integer, intent(in) :: cell_block(3, 3, n_cell)
    integer, intent(in) :: cells(last)
    real(wp), intent(in) :: cell_matrices(4, LANES, 4, 4, 4)
    real(wp), intent(inout) :: values(3, 3, n_block)

    integer :: a, b, c, d, i, k

    do i = first, last
      do b = 1, 3
        do a = 1, 3
          k = cell_block(a, b, cells(i))
          do d = 1, 3
            do c = 1, 3
              values(c, d, k) = values(c, d, k) + cell_matrices(c, i, d, a, b)
            end do
          end do
        end do
      end do
    end do

  end subroutine add_blocks_of_3

  pure subroutine block_matrix_add_unsymmetric(self, block, part)
    class(block_matrix_t), intent(inout) :: self
    !> Place among the blocks.
    integer(gp), intent(in) :: block
    !> Square, at most (n_slot, n_slot): displacements alone when smaller.
    real(wp), intent(in) :: part(:, :)

    integer :: m, place

    m = size(part, 1)
    place = self%extra_of_block(block)
    if (place == 0) then
      if (self%n_extra == size(self%extra_block)) call lengthen(self)
      place = self%n_extra + 1
      self%n_extra = place
      self%extra_of_block(block) = place
      self%extra_block(place) = block
      self%extra_row(place) = row_of(self, block)
      self%extra(:, :, place) = 0.0_wp
    end if
    self%extra(:m, :m, place) = self%extra(:m, :m, place) + part
    self%values(:m, :m, block) = self%values(:m, :m, block) + part

  end subroutine block_matrix_add_unsymmetric

  !> Room for twice as many extra parts.
  pure subroutine lengthen(matrix)
    type(block_matrix_t), intent(inout) :: matrix

    integer, allocatable :: row(:)
    integer(gp), allocatable :: block(:)
    real(wp), allocatable :: extra(:, :, :)
    integer :: n

    n = matrix%n_extra
    allocate (row(2 * n + 8), block(2 * n + 8))
    allocate (extra(matrix%n_slot, matrix%n_slot, 2 * n + 8))
    row(:n) = matrix%extra_row(:n)
    block(:n) = matrix%extra_block(:n)
    extra(:, :, :n) = matrix%extra(:, :, :n)
    call move_alloc(row, matrix%extra_row)
    call move_alloc(block, matrix%extra_block)
    call move_alloc(extra, matrix%extra)

  end subroutine lengthen

  !> Row of a block, by bisection.
  pure function row_of(matrix, block) result(row)
    type(block_matrix_t), intent(in) :: matrix
    integer(gp), intent(in) :: block
    integer :: row

    integer :: last, middle

    row = 1
    last = matrix%n_node
    do while (row < last)
      middle = (row + last + 1) / 2
      if (matrix%row_start(middle) <= block) then
        row = middle
      else
        last = middle - 1
      end if
    end do

  end function row_of

  !> Half of a block and of the transpose of its mirror, as far as this rank knows them.
  pure subroutine block_matrix_symmetric_block(self, row, block, part)
    class(block_matrix_t), intent(in) :: self
    !> Row of the block, and the block.
    integer, intent(in) :: row
    integer(gp), intent(in) :: block
    !> Shape (n_slot, n_slot).
    real(wp), intent(out) :: part(:, :)

    integer(gp) :: mirror

    mirror = block_at(self, self%column(block), row)
    part = 0.5_wp * (self%values(:, :, block) + transpose(self%values(:, :, mirror)))
    associate (place => self%extra_of_block(block), mirrored => self%extra_of_block(mirror))
      if (place > 0) part = part - 0.5_wp * self%extra(:, :, place)
      if (mirrored > 0) part = part - 0.5_wp * transpose(self%extra(:, :, mirrored))
    end associate

  end subroutine block_matrix_symmetric_block

  !> Place of a block that exists, by bisection.
  pure function block_at(matrix, row, column) result(place)
    type(block_matrix_t), intent(in) :: matrix
    integer, intent(in) :: row
    integer, intent(in) :: column
    integer(gp) :: place

    integer(gp) :: high, low

    low = matrix%row_start(row)
    high = matrix%row_start(row + 1) - 1_gp
    do while (low < high)
      place = (low + high) / 2_gp
      if (matrix%column(place) < column) then
        low = place + 1_gp
      else
        high = place
      end if
    end do
    place = low

  end function block_at

  pure subroutine block_matrix_complete(self)
    class(block_matrix_t), intent(inout) :: self

    integer :: c, i

    do i = 1, size(self%idle_row)
      do c = 1, self%n_slot - 1
        self%values(c, c, self%diagonal(self%idle_row(i))) = 1.0_wp
      end do
    end do

  end subroutine block_matrix_complete

  subroutine block_matrix_multiply(self, halo, x, y)
    class(block_matrix_t), intent(in) :: self
    type(halo_t), intent(in) :: halo
    !> Shape (n_slot, n_node).
    real(wp), contiguous, intent(in) :: x(:, :)
    !> Shape (n_slot, n_node); complete on every copy.
    real(wp), contiguous, intent(out) :: y(:, :)

    if (self%n_slot == 4) then
      call multiply_blocks_of_4(self%n_node, self%n_block, self%row_start, self%column, &
                                self%values, x, y)
    else
      call multiply_blocks_of_3(self%n_node, self%n_block, self%row_start, self%column, &
                                self%values, x, y)
    end if
    call halo%accumulate(y)
    if (allocated(self%coupling)) call self%coupling%multiply_add(x, y)

  end subroutine block_matrix_multiply

  !> Product of this rank's matrix; the size of the blocks is fixed, so that they stay in registers.
  pure subroutine multiply_blocks_of_4(n_node, n_block, row_start, column, values, x, y)
    integer, intent(in) :: n_node
    integer(gp), intent(in) :: n_block
    integer(gp), intent(in) :: row_start(n_node + 1)
    integer, intent(in) :: column(n_block)
    real(wp), intent(in) :: values(4, 4, n_block)
    real(wp), intent(in) :: x(4, n_node)
    real(wp), intent(out) :: y(4, n_node)

    real(wp) :: total(4)
    integer :: i, j
    integer(gp) :: k

    do i = 1, n_node
      total = 0.0_wp
      do k = row_start(i), row_start(i + 1) - 1_gp
        j = column(k)
        total = total + values(:, 1, k) * x(1, j) + values(:, 2, k) * x(2, j) &
          + values(:, 3, k) * x(3, j) + values(:, 4, k) * x(4, j)
      end do
      y(:, i) = total
    end do

  end subroutine multiply_blocks_of_4

  !> The same for plane problems.
  pure subroutine multiply_blocks_of_3(n_node, n_block, row_start, column, values, x, y)
    integer, intent(in) :: n_node
    integer(gp), intent(in) :: n_block
    integer(gp), intent(in) :: row_start(n_node + 1)
    integer, intent(in) :: column(n_block)
    real(wp), intent(in) :: values(3, 3, n_block)
    real(wp), intent(in) :: x(3, n_node)
    real(wp), intent(out) :: y(3, n_node)

    real(wp) :: total(3)
    integer :: i, j
    integer(gp) :: k

    do i = 1, n_node
      total = 0.0_wp
      do k = row_start(i), row_start(i + 1) - 1_gp
        j = column(k)
        total = total + values(:, 1, k) * x(1, j) + values(:, 2, k) * x(2, j) &
          + values(:, 3, k) * x(3, j)
      end do
      y(:, i) = total
    end do

  end subroutine multiply_blocks_of_3

  !> 1 where the diagonal is zero.
  subroutine block_matrix_inverse_root_diagonal(self, halo, scale)
    class(block_matrix_t), intent(in) :: self
    type(halo_t), intent(in) :: halo
    !> On every copy; shape (n_slot, n_node).
    real(wp), contiguous, intent(out) :: scale(:, :)

    integer :: c, i

    do i = 1, self%n_node
      do c = 1, self%n_slot
        scale(c, i) = self%values(c, c, self%diagonal(i))
      end do
    end do
    call halo%accumulate(scale)
    if (allocated(self%coupling)) call self%coupling%add_diagonal(scale)
    where (abs(scale) > 0.0_wp)
      scale = 1.0_wp / sqrt(abs(scale))
    else where
      scale = 1.0_wp
    end where

  end subroutine block_matrix_inverse_root_diagonal

  !> Cells of each node, as compressed rows.
  pure subroutine list_cells(cell_node, n_node, first, cell_of_node)
    integer, intent(in) :: cell_node(:, :)
    integer, intent(in) :: n_node
    integer, allocatable, intent(out) :: first(:)
    integer, allocatable, intent(out) :: cell_of_node(:)

    integer, allocatable :: next(:)
    integer :: a, cell, i

    allocate (first(n_node + 1), source=0)
    do cell = 1, size(cell_node, 2)
      do a = 1, size(cell_node, 1)
        first(cell_node(a, cell) + 1) = first(cell_node(a, cell) + 1) + 1
      end do
    end do
    first(1) = 1
    do i = 2, n_node + 1
      first(i) = first(i) + first(i - 1)
    end do
    allocate (next, source=first)
    allocate (cell_of_node(size(cell_node)))
    do cell = 1, size(cell_node, 2)
      do a = 1, size(cell_node, 1)
        i = cell_node(a, cell)
        cell_of_node(next(i)) = cell
        next(i) = next(i) + 1
      end do
    end do

  end subroutine list_cells

  !> Ascending, by insertion: rows are short.
  pure subroutine sort(list)
    integer, intent(inout) :: list(:)

    integer :: i, j, value

    do i = 2, size(list)
      value = list(i)
      j = i - 1
      do while (j >= 1)
        if (list(j) <= value) exit
        list(j + 1) = list(j)
        j = j - 1
      end do
      list(j + 1) = value
    end do

  end subroutine sort

end module swage_block_matrix
