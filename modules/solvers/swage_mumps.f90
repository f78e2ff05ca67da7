!> Direct solution with MUMPS in double precision, the reference among the strategies.
!>
!> Matrix and right-hand side stay distributed. The ordering is METIS nested dissection of the
!> graph of unknown nodes, found once on rank 0 (Debian's MUMPS has no METIS inside and would
!> silently take another one, so the ordering really used is checked). Memory short by a
!> mis-estimate is met by doubling the margin and factorising again.
module swage_mumps
  use mpi_f08, only: MPI_Comm
  use swage_block_matrix, only: block_matrix_t
  use swage_comm, only: comm_t
  use swage_halo, only: halo_t
  use swage_kinds, only: gp, wp
  use swage_linear_solver, only: linear_solver_t
  use swage_memory, only: peak_memory
  use swage_partition, only: order_nodes
  use swage_phase_times, only: PHASE_FACTORISATION, PHASE_ORDERING, PHASE_SOLUTION
  use swage_status, only: EXIT_SOLVER, status_t, STATUS_ERROR, STATUS_RETRY
  use swage_text, only: text
  use swage_unknowns, only: unknowns_t
  implicit none(type, external)
  private

  public :: mumps_solver_t, mumps_solver_create

  include 'dmumps_struc.h'

  !> Margin of the memory estimate in per cent, at first and at most.
  integer, parameter :: FIRST_MARGIN = 30
  integer, parameter :: LARGEST_MARGIN = 4000

  type, extends(linear_solver_t) :: mumps_solver_t
    private
    type(comm_t) :: comm
    type(halo_t) :: halo
    type(dmumps_struc), allocatable :: id
    !> True when the symmetric part of the matrix is factorised in place of the matrix.
    logical :: symmetric = .false.
    integer :: n_slot = 0
    integer :: n_node = 0
    integer :: n_own_node = 0
    integer(gp), allocatable :: node_global(:)
    integer(gp), allocatable :: node_offset(:)
    character(len=:), allocatable :: decisions
  contains
    procedure, public :: factorise => mumps_factorise
    procedure, public :: solve => mumps_solve
    procedure, public :: report => mumps_report
    procedure, public :: free => mumps_free
  end type mumps_solver_t

  interface
    subroutine dmumps(id)
      import :: dmumps_struc
      implicit none(type, external)
      type(dmumps_struc), intent(inout) :: id
    end subroutine dmumps
  end interface

contains

  !> Collective. Order the unknowns and analyse the pattern of `matrix`.
  subroutine mumps_solver_create(comm, halo, unknowns, matrix, symmetric, solver, status)
    type(comm_t), intent(in) :: comm
    !> Exchange of the unknown nodes between ranks.
    type(halo_t), intent(in) :: halo
    type(unknowns_t), intent(in) :: unknowns
    !> Its pattern counts, not its values.
    type(block_matrix_t), intent(in) :: matrix
    !> Factorise the symmetric part: half the work, and a few Newton iterations more.
    logical, intent(in) :: symmetric
    type(mumps_solver_t), intent(inout) :: solver
    !> `STATUS_ERROR`, the same on all ranks, when the analysis fails.
    type(status_t), intent(inout) :: status

    integer, allocatable :: order(:)

    call solver%free()
    solver%comm = comm
    solver%halo = halo
    solver%symmetric = symmetric
    solver%n_slot = unknowns%n_slot
    solver%n_node = unknowns%n_node
    solver%n_own_node = unknowns%n_own_node
    solver%node_global = unknowns%node_global
    allocate (solver%node_offset(0:size(unknowns%node_offset) - 1))
    solver%node_offset(:) = unknowns%node_offset(:)
    solver%decisions = ''

    if (unknowns%n_node_global * unknowns%n_slot > int(huge(1), gp)) then
      call status%raise(STATUS_ERROR, 'mumps_solver_create', 'the mesh has more unknowns than '// &
                        'MUMPS can number with 32-bit integers: use a coarser mesh', EXIT_SOLVER)
    end if
    if (status%failed()) return

    call solver%times%begin(PHASE_ORDERING)
    call find_order(comm, unknowns, order, status)
    call comm%agree(status)
    if (status%failed()) return

    allocate (solver%id)
    associate (id => solver%id)
      id%comm = comm%handle%mpi_val
      id%sym = merge(2, 0, symmetric)
      id%par = 1
      id%job = -1
      call dmumps(id)
      id%icntl(1:3) = -1
      id%icntl(4) = 0
      ! The caller's ordering
      id%icntl(7) = 1
      id%icntl(14) = FIRST_MARGIN
      ! Distributed matrix, right-hand side and solution
      id%icntl(18) = 3
      id%icntl(20) = 10
      id%icntl(21) = 1
      ! No permutation to a heavy diagonal: it would undo the ordering of nodes
      id%icntl(6) = 0
      id%n = int(unknowns%n_node_global) * unknowns%n_slot
      call set_pattern(solver, matrix)
      if (comm%rank == 0) then
        allocate (id%perm_in(id%n))
        id%perm_in = slot_order(order, unknowns%n_slot)
      end if
      id%job = 1
      call dmumps(id)
      if (comm%rank == 0) deallocate (id%perm_in)
      nullify (id%perm_in)
      call solver%times%end(PHASE_ORDERING)
      if (id%infog(1) < 0) then
        call raise_mumps(solver, 'analysis', status)
        return
      end if
      if (id%infog(7) /= 1) then
        call status%raise(STATUS_ERROR, 'mumps_solver_create', 'MUMPS did not use the given '// &
                          'METIS ordering but its own number '//text(id%infog(7)), EXIT_SOLVER)
        return
      end if
      call note(solver, 'linear solver: MUMPS, '//text(id%n)//' unknowns, METIS ordering, '// &
                text(id%infog(16))//' MB estimated on the largest rank; peak of rank 0 '// &
                text(peak_memory())//' MB')
    end associate

  end subroutine mumps_solver_create

  subroutine mumps_factorise(self, matrix, status)
    class(mumps_solver_t), intent(inout) :: self
    type(block_matrix_t), intent(in) :: matrix
    type(status_t), intent(inout) :: status

    call self%times%begin(PHASE_FACTORISATION)
    associate (id => self%id)
      call set_values(self, matrix)
      do
        id%job = 2
        call dmumps(id)
        if (id%infog(1) /= -8 .and. id%infog(1) /= -9) exit
        if (id%icntl(14) >= LARGEST_MARGIN) exit
        id%icntl(14) = 2 * id%icntl(14)
        call note(self, 'linear solver: memory margin raised to '//text(id%icntl(14))//' %')
      end do
      call self%times%end(PHASE_FACTORISATION)
      if (id%infog(1) < 0) then
        call raise_mumps(self, 'factorisation', status)
        return
      end if
    end associate
    self%n_factorisation = self%n_factorisation + 1

  end subroutine mumps_factorise

  subroutine mumps_solve(self, matrix, right_hand_side, tolerance, solution, status)
    class(mumps_solver_t), intent(inout) :: self
    !> Only its factors count.
    type(block_matrix_t), intent(in) :: matrix
    real(wp), contiguous, intent(in) :: right_hand_side(:, :)
    !> The solution is exact whatever is asked for.
    real(wp), intent(in) :: tolerance
    real(wp), contiguous, intent(out) :: solution(:, :)
    type(status_t), intent(inout) :: status

    integer :: c, i, k, n

    call self%times%begin(PHASE_SOLUTION)
    associate (id => self%id, m => self%n_slot)
      n = m * self%n_own_node
      allocate (id%rhs_loc(max(n, 1)), id%irhs_loc(max(n, 1)))
      id%nloc_rhs = n
      id%lrhs_loc = max(n, 1)
      k = 0
      do i = 1, self%n_own_node
        do c = 1, m
          k = k + 1
          id%irhs_loc(k) = int(self%node_global(i) - 1_gp) * m + c
          id%rhs_loc(k) = right_hand_side(c, i)
        end do
      end do
      id%nrhs = 1
      id%lsol_loc = max(id%info(23), 1)
      allocate (id%sol_loc(id%lsol_loc), id%isol_loc(id%lsol_loc))
      id%job = 3
      call dmumps(id)
      if (id%infog(1) < 0) then
        call raise_mumps(self, 'solution', status)
      else
        call return_to_owners(self, id%isol_loc(:id%info(23)), id%sol_loc(:id%info(23)), solution)
        self%n_solution = self%n_solution + 1
      end if
      deallocate (id%rhs_loc, id%irhs_loc, id%sol_loc, id%isol_loc)
    end associate
    call self%times%end(PHASE_SOLUTION)

  end subroutine mumps_solve

  subroutine mumps_report(self, text)
    class(mumps_solver_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: text

    text = ''
    if (.not. allocated(self%decisions)) return
    text = self%decisions
    self%decisions = ''

  end subroutine mumps_report

  subroutine mumps_free(self)
    class(mumps_solver_t), intent(inout) :: self

    if (.not. allocated(self%id)) return
    associate (id => self%id)
      if (associated(id%irn_loc)) deallocate (id%irn_loc)
      if (associated(id%jcn_loc)) deallocate (id%jcn_loc)
      if (associated(id%a_loc)) deallocate (id%a_loc)
      id%job = -2
      call dmumps(id)
    end associate
    deallocate (self%id)
    if (allocated(self%node_offset)) deallocate (self%node_offset)

  end subroutine mumps_free

  !> Rows and columns of this rank's entries; the lower triangle only when symmetric.
  subroutine set_pattern(solver, matrix)
    type(mumps_solver_t), intent(inout) :: solver
    type(block_matrix_t), intent(in) :: matrix

    integer :: c, d, i, m, pass
    integer(gp) :: k, n
    integer :: column, row

    m = solver%n_slot
    associate (id => solver%id)
      do pass = 1, 2
        n = 0_gp
        do i = 1, matrix%n_node
          do k = matrix%row_start(i), matrix%row_start(i + 1) - 1_gp
            do d = 1, m
              column = int(solver%node_global(matrix%column(k)) - 1_gp) * m + d
              do c = 1, m
                row = int(solver%node_global(i) - 1_gp) * m + c
                if (solver%symmetric .and. row < column) cycle
                n = n + 1_gp
                if (pass == 1) cycle
                id%irn_loc(n) = row
                id%jcn_loc(n) = column
              end do
            end do
          end do
        end do
        if (pass == 1) allocate (id%irn_loc(n), id%jcn_loc(n), id%a_loc(n))
      end do
      id%nnz_loc = n
    end associate

  end subroutine set_pattern

  !> Values in the order of [[set_pattern]]. The symmetric part is that of the sum over the ranks,
  !> for the pattern is symmetric on each of them.
  subroutine set_values(solver, matrix)
    type(mumps_solver_t), intent(inout) :: solver
    type(block_matrix_t), intent(in) :: matrix

    integer :: c, d, i, m
    integer(gp) :: k, mirror, n

    m = solver%n_slot
    n = 0_gp
    associate (id => solver%id)
      do i = 1, matrix%n_node
        do k = matrix%row_start(i), matrix%row_start(i + 1) - 1_gp
          if (solver%symmetric) then
            if (solver%node_global(i) < solver%node_global(matrix%column(k))) cycle
            mirror = block_at(matrix, matrix%column(k), i)
          end if
          do d = 1, m
            do c = 1, m
              if (solver%symmetric) then
                if (matrix%column(k) == i .and. c < d) cycle
                n = n + 1_gp
                id%a_loc(n) = 0.5_wp * (matrix%values(c, d, k) + matrix%values(d, c, mirror) &
                                        - extra_value(matrix, c, d, k) &
                                        - extra_value(matrix, d, c, mirror))
              else
                n = n + 1_gp
                id%a_loc(n) = matrix%values(c, d, k)
              end if
            end do
          end do
        end do
      end do
    end associate

  end subroutine set_values

  !> What a symmetric factor leaves out of a value.
  pure function extra_value(matrix, row, column, block) result(value)
    type(block_matrix_t), intent(in) :: matrix
    integer, intent(in) :: row, column
    integer(gp), intent(in) :: block
    real(wp) :: value

    value = 0.0_wp
    if (matrix%extra_of_block(block) == 0) return
    value = matrix%extra(row, column, matrix%extra_of_block(block))

  end function extra_value

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

  !> Collective. Send the scattered solution to the owners, then to all copies.
  subroutine return_to_owners(solver, index, values, solution)
    type(mumps_solver_t), intent(in) :: solver
    !> Numbers of the unknowns that MUMPS left on this rank.
    integer, intent(in) :: index(:)
    real(wp), intent(in) :: values(:)
    real(wp), contiguous, intent(out) :: solution(:, :)

    integer, allocatable :: from(:), next(:), rank_of(:), to(:)
    integer, allocatable :: index_in(:), index_out(:)
    real(wp), allocatable :: in(:), out(:)
    integer :: i, last, m, node, rank

    m = solver%n_slot
    solution = 0.0_wp
    last = solver%comm%size - 1
    allocate (rank_of(size(index)), to(0:last), from(0:last), next(0:last))
    to = 0
    do i = 1, size(index)
      rank_of(i) = owner(solver%node_offset, int((index(i) - 1) / m + 1, gp))
      to(rank_of(i)) = to(rank_of(i)) + 1
    end do
    call solver%comm%exchange(to, from)
    next(0) = 0
    do rank = 1, last
      next(rank) = next(rank - 1) + to(rank - 1)
    end do
    allocate (index_out(size(index)), out(size(index)), index_in(sum(from)), in(sum(from)))
    do i = 1, size(index)
      associate (n => next(rank_of(i)))
        n = n + 1
        index_out(n) = index(i)
        out(n) = values(i)
      end associate
    end do
    call solver%comm%exchange(index_out, to, index_in, from)
    call solver%comm%exchange(out, to, in, from)
    do i = 1, size(index_in)
      node = (index_in(i) - 1) / m + 1 - int(solver%node_offset(solver%comm%rank))
      solution(mod(index_in(i) - 1, m) + 1, node) = in(i)
    end do
    call solver%halo%update(solution)

  end subroutine return_to_owners

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
  subroutine find_order(comm, unknowns, order, status)
    type(comm_t), intent(in) :: comm
    type(unknowns_t), intent(in) :: unknowns
    !> Place of each node in the elimination, on rank 0; empty elsewhere.
    integer, allocatable, intent(out) :: order(:)
    type(status_t), intent(inout) :: status

    integer, allocatable :: cells(:), from(:), neighbour(:), sent(:), start(:), to(:)
    integer :: a, cell, k, n, n_vertex

    n_vertex = size(unknowns%cell_node, 1)
    n = size(unknowns%cell_node)
    allocate (sent(n), to(0:comm%size - 1), from(0:comm%size - 1))
    k = 0
    do cell = 1, size(unknowns%cell_node, 2)
      do a = 1, n_vertex
        k = k + 1
        sent(k) = int(unknowns%node_global(unknowns%cell_node(a, cell)))
      end do
    end do
    to = 0
    to(0) = n
    call comm%exchange(to, from)
    allocate (cells(sum(from)))
    call comm%exchange(sent, to, cells, from)
    allocate (order(merge(int(unknowns%n_node_global), 0, comm%rank == 0)))
    if (comm%rank /= 0) return
    call build_graph(cells, n_vertex, int(unknowns%n_node_global), start, neighbour)
    call order_nodes(start, neighbour, order, status)

  end subroutine find_order

  !> Neighbours of each node, without itself, numbered from 1.
  pure subroutine build_graph(cells, n_vertex, n_node, start, neighbour)
    !> Nodes of all cells, cell by cell.
    integer, intent(in) :: cells(:)
    integer, intent(in) :: n_vertex
    integer, intent(in) :: n_node
    integer, allocatable, intent(out) :: start(:)
    integer, allocatable, intent(out) :: neighbour(:)

    integer, allocatable :: first(:), list(:), next(:), stamp(:)
    integer :: a, i, k, n, pass

    allocate (first(n_node + 1), source=0)
    do i = 1, size(cells)
      first(cells(i) + 1) = first(cells(i) + 1) + 1
    end do
    first(1) = 1
    do i = 2, n_node + 1
      first(i) = first(i) + first(i - 1)
    end do
    allocate (next, source=first)
    allocate (list(size(cells)))
    do i = 1, size(cells)
      list(next(cells(i))) = (i - 1) / n_vertex
      next(cells(i)) = next(cells(i)) + 1
    end do

    allocate (start(n_node + 1), stamp(n_node))
    do pass = 1, 2
      stamp = 0
      n = 0
      do i = 1, n_node
        start(i) = n + 1
        stamp(i) = i
        do k = first(i), first(i + 1) - 1
          do a = 1, n_vertex
            associate (node => cells(list(k) * n_vertex + a))
              if (stamp(node) == i) cycle
              stamp(node) = i
              n = n + 1
              if (pass == 2) neighbour(n) = node
            end associate
          end do
        end do
      end do
      start(n_node + 1) = n + 1
      if (pass == 1) allocate (neighbour(n))
    end do

  end subroutine build_graph

  !> The order of nodes as an order of their slots.
  pure function slot_order(order, n_slot) result(slots)
    integer, intent(in) :: order(:)
    integer, intent(in) :: n_slot
    integer :: slots(n_slot * size(order))

    integer :: c, i

    do i = 1, size(order)
      do c = 1, n_slot
        slots(n_slot * (i - 1) + c) = n_slot * (order(i) - 1) + c
      end do
    end do

  end function slot_order

  !> A line for the log.
  subroutine note(solver, line)
    type(mumps_solver_t), intent(inout) :: solver
    character(len=*), intent(in) :: line

    if (solver%decisions /= '') solver%decisions = solver%decisions//new_line('a')
    solver%decisions = solver%decisions//line

  end subroutine note

  !> What an error code of MUMPS means for the run.
  subroutine raise_mumps(solver, phase, status)
    type(mumps_solver_t), intent(in) :: solver
    character(len=*), intent(in) :: phase
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: what
    integer :: severity

    severity = STATUS_ERROR
    select case (solver%id%infog(1))
    case (-6)
      what = 'the matrix is structurally singular (rank '//text(solver%id%infog(2))// &
        '): a part of the mesh has no support'
      severity = STATUS_RETRY
    case (-10)
      what = 'the matrix is singular after '//text(solver%id%infog(2))// &
        ' pivots: a body is not held by boundaries, symmetry or contact'
      severity = STATUS_RETRY
    case (-5, -7, -13)
      what = 'memory is short ('//text(abs(solver%id%infog(2)))//' words asked for): use more '// &
        'ranks or a coarser mesh'
    case (-8, -9)
      what = 'its memory margin of '//text(LARGEST_MARGIN)//' % was not enough'
    case (-90)
      what = 'a file of factors cannot be written'
    case default
      what = 'error '//text(solver%id%infog(1))//', '//text(solver%id%infog(2))
    end select
    call status%raise(severity, 'mumps', 'MUMPS '//phase//': '//what, EXIT_SOLVER)

  end subroutine raise_mumps

end module swage_mumps
