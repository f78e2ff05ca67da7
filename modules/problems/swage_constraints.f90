!> Prescribed displacements: which combinations of a node's components follow a given motion.
!>
!> Nodes are unknown nodes here, those of the matrix.
!>
!> A node may get directions from several boundaries. They are made orthonormal one after the
!> other; where they are not coordinate axes the node's equations are turned to them.
module swage_constraints
  use swage_block_matrix, only: block_matrix_t
  use swage_kinds, only: gp, wp
  use swage_rotation, only: cross_product, perpendicular
  implicit none(type, external)
  private

  public :: constraints_t

  !> Below this a direction, or a difference by the size of motion, counts as zero.
  real(wp), parameter :: NEGLIGIBLE = 1.0e-10_wp

  type :: constraints_t
    integer :: n_dim = 0
    !> Constrained nodes, owned and not.
    integer :: n_constrained = 0
    !> Place among the constrained nodes, 0 for a free one; shape (n_node).
    integer, allocatable :: of_node(:)
    !> Node of each place; shape (n_constrained).
    integer, allocatable :: node(:)
    !> Directions in use; shape (n_constrained).
    integer, allocatable :: n_direction(:)
    !> Local axes as columns, the constrained ones first; shape (n_dim, n_dim, n_constrained).
    real(wp), allocatable :: axes(:, :, :)
    !> Displacement increment along the constrained axes [length]; (n_dim, n_constrained).
    real(wp), allocatable :: value(:, :)
    !> First node whose boundaries contradict each other, 0 if none.
    integer :: contradiction = 0
  contains
    !> Start again, without constraints.
    procedure :: reset => constraints_reset
    !> Prescribe one direction of a node.
    procedure :: add => constraints_add
    !> Complete the axes, after the last `add`.
    procedure :: complete => constraints_complete
    !> What is still to be imposed, along the global axes.
    procedure :: pending => constraints_pending
    !> Set a nodal vector's constrained components to zero.
    procedure :: remove_from => constraints_remove_from
    !> Turn the matrix to the local axes and replace constrained rows and columns by the identity.
    procedure :: impose => constraints_impose
    !> Turn a nodal vector to the local axes, or back.
    procedure :: to_local => constraints_to_local
    procedure :: to_global => constraints_to_global
  end type constraints_t

contains

  pure subroutine constraints_reset(self, n_dim, n_node)
    class(constraints_t), intent(inout) :: self
    integer, intent(in) :: n_dim
    integer, intent(in) :: n_node

    if (.not. allocated(self%of_node)) then
      allocate (self%of_node(n_node), self%node(n_node), self%n_direction(n_node))
      allocate (self%axes(n_dim, n_dim, n_node), self%value(n_dim, n_node))
    end if
    self%n_dim = n_dim
    self%n_constrained = 0
    self%of_node = 0
    self%contradiction = 0

  end subroutine constraints_reset

  pure subroutine constraints_add(self, node, direction, value)
    class(constraints_t), intent(inout) :: self
    integer, intent(in) :: node
    !> Unit vector; shape (n_dim).
    real(wp), intent(in) :: direction(:)
    !> Displacement increment along it [length].
    real(wp), intent(in) :: value

    real(wp) :: along, length, left(self%n_dim), rest
    integer :: i, n

    if (self%of_node(node) == 0) then
      self%n_constrained = self%n_constrained + 1
      self%of_node(node) = self%n_constrained
      self%node(self%n_constrained) = node
      self%n_direction(self%n_constrained) = 0
      self%axes(:, :, self%n_constrained) = 0.0_wp
      self%value(:, self%n_constrained) = 0.0_wp
    end if
    n = self%of_node(node)
    left = direction
    rest = value
    do i = 1, self%n_direction(n)
      along = dot_product(direction, self%axes(:, i, n))
      left = left - along * self%axes(:, i, n)
      rest = rest - along * self%value(i, n)
    end do
    length = norm2(left)
    if (length > 1.0e-6_wp .and. self%n_direction(n) < self%n_dim) then
      i = self%n_direction(n) + 1
      self%n_direction(n) = i
      self%axes(:, i, n) = left / length
      self%value(i, n) = rest / length
    else if (abs(rest) > NEGLIGIBLE * (abs(value) + maxval(abs(self%value(:, n))))) then
      if (self%contradiction == 0) self%contradiction = node
    end if

  end subroutine constraints_add

  pure subroutine constraints_complete(self)
    class(constraints_t), intent(inout) :: self

    real(wp) :: a(3), b(3)
    integer :: i

    do i = 1, self%n_constrained
      a = 0.0_wp
      a(:self%n_dim) = self%axes(:, 1, i)
      if (self%n_dim == 2) then
        if (self%n_direction(i) == 1) self%axes(:, 2, i) = [-a(2), a(1)]
      else if (self%n_direction(i) < 3) then
        b = perpendicular(a)
        if (self%n_direction(i) == 2) b(:self%n_dim) = self%axes(:, 2, i)
        self%axes(:, 2, i) = b
        self%axes(:, 3, i) = cross_product(a, b)
      end if
    end do

  end subroutine constraints_complete

  !> The rest of the prescribed increments beyond those of `u`, 0 at free components.
  pure subroutine constraints_pending(self, u, column, rest, largest)
    class(constraints_t), intent(in) :: self
    !> Displacement increment [length]; shape (n_dim, :).
    real(wp), intent(in) :: u(:, :)
    !> Where it holds that of each node; shape (n_node).
    integer, intent(in) :: column(:)
    !> Along the local axes, displacement slots only; shape (n_dim + 1, n_node).
    real(wp), intent(out) :: rest(:, :)
    !> Largest of them on this rank [length].
    real(wp), intent(out) :: largest

    integer :: i, k

    rest = 0.0_wp
    largest = 0.0_wp
    do i = 1, self%n_constrained
      do k = 1, self%n_direction(i)
        rest(k, self%node(i)) = self%value(k, i) &
          - dot_product(self%axes(:, k, i), u(:, column(self%node(i))))
        largest = max(largest, abs(rest(k, self%node(i))))
      end do
    end do

  end subroutine constraints_pending

  !> The vector is along the global axes, before and after.
  pure subroutine constraints_remove_from(self, vector)
    class(constraints_t), intent(in) :: self
    !> Its first n_dim rows count; shape (:, n_node).
    real(wp), intent(inout) :: vector(:, :)

    integer :: i, k, n

    n = self%n_dim
    do i = 1, self%n_constrained
      associate (v => vector(:n, self%node(i)))
        do k = 1, self%n_direction(i)
          v = v - dot_product(self%axes(:, k, i), v) * self%axes(:, k, i)
        end do
      end associate
    end do

  end subroutine constraints_remove_from

  pure subroutine constraints_to_local(self, vector)
    class(constraints_t), intent(in) :: self
    real(wp), intent(inout) :: vector(:, :)

    integer :: i

    do i = 1, self%n_constrained
      vector(:self%n_dim, self%node(i)) = matmul(vector(:self%n_dim, self%node(i)), &
                                                 self%axes(:, :, i))
    end do

  end subroutine constraints_to_local

  pure subroutine constraints_to_global(self, vector)
    class(constraints_t), intent(in) :: self
    real(wp), intent(inout) :: vector(:, :)

    integer :: i

    do i = 1, self%n_constrained
      vector(:self%n_dim, self%node(i)) = matmul(self%axes(:, :, i), &
                                                 vector(:self%n_dim, self%node(i)))
    end do

  end subroutine constraints_to_global

  !> Also takes the prescribed rest to the right-hand side: `load` is K times `rest`, this rank's
  !> share, still to be added over the ranks.
  pure subroutine constraints_impose(self, matrix, n_own_node, rest, load)
    class(constraints_t), intent(in) :: self
    type(block_matrix_t), intent(inout) :: matrix
    !> Rows whose diagonal this rank sets.
    integer, intent(in) :: n_own_node
    !> Of [[constraints_t:pending]]; shape (n_dim + 1, n_node).
    real(wp), intent(in) :: rest(:, :)
    !> Along the local axes; shape (n_dim + 1, n_node).
    real(wp), intent(out) :: load(:, :)

    integer :: c, e, i, j, n
    integer(gp) :: k

    n = self%n_dim
    load = 0.0_wp
    do i = 1, matrix%n_node
      do k = matrix%row_start(i), matrix%row_start(i + 1) - 1_gp
        j = matrix%column(k)
        if (self%of_node(i) == 0 .and. self%of_node(j) == 0) cycle
        call turn(self, i, j, matrix%values(:, :, k))
        if (self%of_node(j) > 0) then
          load(:, i) = load(:, i) + matmul(matrix%values(:, :n, k), rest(:n, j))
        end if
        call clear_constrained(self, i, j, matrix%values(:, :, k))
      end do
      if (self%of_node(i) > 0 .and. i <= n_own_node) then
        do c = 1, self%n_direction(self%of_node(i))
          matrix%values(c, c, matrix%diagonal(i)) = 1.0_wp
        end do
      end if
    end do
    do e = 1, matrix%n_extra
      i = matrix%extra_row(e)
      j = matrix%column(matrix%extra_block(e))
      call turn(self, i, j, matrix%extra(:, :, e))
      call clear_constrained(self, i, j, matrix%extra(:, :, e))
    end do

  end subroutine constraints_impose

  !> Turn a block to the local axes of its two nodes.
  pure subroutine turn(self, row, column, block)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: row, column
    real(wp), intent(inout) :: block(:, :)

    integer :: n

    n = self%n_dim
    associate (a => self%of_node(row), b => self%of_node(column))
      if (a > 0) block(:n, :) = matmul(transpose(self%axes(:, :, a)), block(:n, :))
      if (b > 0) block(:, :n) = matmul(block(:, :n), self%axes(:, :, b))
    end associate

  end subroutine turn

  !> Set the constrained rows and columns of a block to zero.
  pure subroutine clear_constrained(self, row, column, block)
    class(constraints_t), intent(in) :: self
    integer, intent(in) :: row, column
    real(wp), intent(inout) :: block(:, :)

    associate (a => self%of_node(row), b => self%of_node(column))
      if (a > 0) block(:self%n_direction(a), :) = 0.0_wp
      if (b > 0) block(:, :self%n_direction(b)) = 0.0_wp
    end associate

  end subroutine clear_constrained

end module swage_constraints
