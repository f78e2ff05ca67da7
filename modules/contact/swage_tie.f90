!> Surfaces tied to each other: conditions that stay as they were found at the start.
!>
!> A tie keeps the shares \(w_j\) of the nodes in each condition, and with them its distance
!> \[ g = \frac1A \sum_j w_j x_j - R\,g_0, \]
!> \(g_0\) what the sum was at the start: bodies drawn a little apart, or into each other, stay so
!> and carry no stress for it. R turns the distance with the slave, as three of its nodes turn (two
!> in the plane); it is that of the start of the step, so that forces are linear in the step.
module swage_tie
  use swage_contact_rows, only: contact_rows_t
  use swage_kinds, only: wp
  use swage_rotation, only: cross_product, IDENTITY, normalised, perpendicular
  implicit none(type, external)
  private

  public :: tie_t, tie_create

  !> Arrays have one entry a condition, in the order of the rows they were made from.
  type :: tie_t
    !> Nodes that turn with the condition: its own, one more, and a third in space, else 0; shape
    !> (3, n_row).
    integer, allocatable :: corner(:, :)
    !> Axes that they span [1], and normal and distance in these axes [1], [length]; shapes
    !> (3, n_row).
    real(wp), allocatable :: normal(:, :), distance(:, :)
    !> How far the slave is from where the master would have it, at the start of the step and now
    !> [length]; shape (3, n_row).
    real(wp), allocatable :: apart_old(:, :), apart(:, :)
  contains
    !> Make rows those of the start of a step.
    procedure :: begin_step => tie_begin_step
    !> Give rows and tie the distances of an iterate.
    procedure :: update => tie_update
  end type tie_t

contains

  !> Take conditions for those of all time.
  pure subroutine tie_create(n_dim, rows, x, tie)
    integer, intent(in) :: n_dim
    !> Where the bodies are drawn.
    type(contact_rows_t), intent(in) :: rows
    !> Of the surface nodes, there [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)
    type(tie_t), intent(out) :: tie

    real(wp) :: axes(3, 3), distance(3)
    integer :: row

    allocate (tie%corner(3, rows%n_row), source=0)
    allocate (tie%normal(3, rows%n_row), tie%distance(3, rows%n_row))
    allocate (tie%apart_old(3, rows%n_row), tie%apart(3, rows%n_row), source=0.0_wp)
    do row = 1, rows%n_row
      call find_corners(n_dim, rows, row, x, tie%corner(:, row))
      axes = axes_of(tie%corner(:, row), x)
      distance = mean_of(rows, row, x)
      tie%normal(:, row) = matmul(rows%normal(:, row), axes)
      tie%distance(:, row) = matmul(distance, axes)
    end do

  end subroutine tie_create

  !> The node of a condition, the one of the slave furthest from it, and the one that spans the
  !> largest triangle with them; of equals the first.
  pure subroutine find_corners(n_dim, rows, row, x, corner)
    integer, intent(in) :: n_dim
    type(contact_rows_t), intent(in) :: rows
    integer, intent(in) :: row
    real(wp), intent(in) :: x(:, :)
    integer, intent(inout) :: corner(3)

    !> What a size must have more to count as larger [1].
    real(wp), parameter :: LARGER = 1.0_wp + 1.0e-6_wp

    real(wp) :: arm(3), largest, now
    integer :: entry, turn

    corner(1) = rows%slave(row)
    do turn = 2, n_dim
      largest = 0.0_wp
      do entry = rows%first(row), rows%first(row + 1) - 1
        if (.not. rows%share(entry) > 0.0_wp) cycle
        arm = x(:, rows%node(entry)) - x(:, corner(1))
        if (turn == 3) arm = cross_product(x(:, corner(2)) - x(:, corner(1)), arm)
        now = norm2(arm)
        if (now <= LARGER * largest) cycle
        largest = now
        corner(turn) = rows%node(entry)
      end do
    end do

  end subroutine find_corners

  !> Right-angled unit vectors, the columns, that turn with the corners; those at hand where nodes
  !> that the slave shares with the master leave too few.
  pure function axes_of(corner, x) result(axes)
    integer, intent(in) :: corner(3)
    real(wp), intent(in) :: x(:, :)
    real(wp) :: axes(3, 3)

    real(wp) :: arm(3)

    axes = IDENTITY
    if (corner(2) == 0) return
    axes(:, 1) = normalised(x(:, corner(2)) - x(:, corner(1)))
    if (abs(axes(3, 1)) > 0.0_wp) axes(:, 3) = perpendicular(axes(:, 1))
    if (corner(3) > 0) then
      arm = x(:, corner(3)) - x(:, corner(1))
      axes(:, 3) = normalised(cross_product(axes(:, 1), arm))
    end if
    axes(:, 2) = cross_product(axes(:, 3), axes(:, 1))

  end function axes_of

  !> Mean of the slave less that of the master [length].
  pure function mean_of(rows, row, x) result(mean)
    type(contact_rows_t), intent(in) :: rows
    integer, intent(in) :: row
    real(wp), intent(in) :: x(:, :)
    real(wp) :: mean(3)

    integer :: entry

    mean = 0.0_wp
    do entry = rows%first(row), rows%first(row + 1) - 1
      mean = mean + rows%share(entry) * x(:, rows%node(entry))
    end do
    mean = mean / rows%area(row)

  end function mean_of

  !> Normals turn, and with them forces and what they are derived by.
  pure subroutine tie_begin_step(self, x, rows)
    class(tie_t), intent(inout) :: self
    !> At the start of the step [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)
    !> Those that the tie was made from.
    type(contact_rows_t), intent(inout) :: rows

    real(wp) :: axes(3, 3)
    integer :: entry, row

    do row = 1, rows%n_row
      axes = axes_of(self%corner(:, row), x)
      self%apart_old(:, row) = mean_of(rows, row, x) - matmul(axes, self%distance(:, row))
      self%apart(:, row) = self%apart_old(:, row)
      rows%normal(:, row) = matmul(axes, self%normal(:, row))
      rows%gap(row) = dot_product(rows%normal(:, row), self%apart(:, row))
      do entry = rows%first(row), rows%first(row + 1) - 1
        rows%slope(:, entry) = rows%share(entry) * rows%normal(:, row)
        rows%force(:, entry) = -rows%slope(:, entry)
      end do
    end do

  end subroutine tie_begin_step

  !> By the motion of the step alone: positions are rounded by more than a stiff tie forgives.
  pure subroutine tie_update(self, increment, rows)
    class(tie_t), intent(inout) :: self
    !> Of the positions since the start of the step [length]; shape (3, n_node).
    real(wp), intent(in) :: increment(:, :)
    type(contact_rows_t), intent(inout) :: rows

    integer :: row

    do row = 1, rows%n_row
      self%apart(:, row) = self%apart_old(:, row) + mean_of(rows, row, increment)
      rows%gap(row) = dot_product(rows%normal(:, row), self%apart(:, row))
    end do

  end subroutine tie_update

end module swage_tie
