!> Conditions of contact between two deformable surfaces, and blocks of their stiffness.
module swage_contact_rows
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: contact_blocks_t, contact_rows_t

  !> Conditions of contact, one for each slave node or quadrature point, made anew at each
  !> evaluation. Arrays only grow: their extents below are least ones.
  !>
  !> A condition with the pressure \(\lambda\) puts \(\lambda\) `force` on the nodes of its entries.
  !> With \(\lambda = \rho\) `gap`, the derivative of these forces has the part
  !> \(\rho\) / `area` `force` ⊗ `slope`. In a variational formulation the forces are the gradient
  !> of an energy, and `slope` is the opposite of `force`. Vectors have three components, beyond
  !> those of the problem zeros.
  type :: contact_rows_t
    integer :: n_row = 0
    !> Penetration, positive inside [length], and area of each condition [length^2; in an
    !> axisymmetric problem that of the whole turn]; shape (n_row).
    real(wp), allocatable :: gap(:), area(:)
    !> Unit normal of the condition, out of the slave; shape (3, n_row).
    real(wp), allocatable :: normal(:, :)
    !> Slave node the condition belongs to; shape (n_row).
    integer, allocatable :: slave(:)
    !> Number of the condition, the same at every evaluation and no other condition's, from 1 to
    !> what the formulation counts: multipliers and friction history are kept under it; shape
    !> (n_row). With one condition a slave node it is that node.
    integer, allocatable :: key(:)
    !> First entry of each condition; shape (n_row + 1).
    integer, allocatable :: first(:)
    !> Surface node of each entry, once in a condition; shape (n_entry).
    integer, allocatable :: node(:)
    !> Force on that node by a unit pressure of the condition [length^2]; shape (3, n_entry). It
    !> pushes the slave against `normal`.
    real(wp), allocatable :: force(:, :)
    !> Derivative of area times gap by the position of the node [length^2]; shape (3, n_entry).
    real(wp), allocatable :: slope(:, :)
    !> Share of the node in the tangential motion of the condition, times area, positive for the
    !> slave and negative for the master [length^2]; sums to zero over a condition; shape (n_entry).
    real(wp), allocatable :: share(:)
    !> Entry of the condition being made that each node has, where `holder` tells so.
    integer, allocatable, private :: place(:), holder(:)
    !> Conditions begun since the arrays were made.
    integer, private :: stamp = 0
  contains
    !> Forget all conditions.
    procedure :: start => contact_rows_start
    !> Begin a condition, to which the following entries belong.
    procedure :: begin_row => contact_rows_begin_row
    !> Add to the entry of a node, which appears with its first mention.
    procedure :: add => contact_rows_add
    !> Take back the condition begun last.
    procedure :: drop_row => contact_rows_drop_row
    !> Give all conditions another weight: areas, forces, slopes and shares.
    procedure :: scale => contact_rows_scale
    !> Entries of all conditions.
    procedure :: count_entries => contact_rows_count_entries
  end type contact_rows_t

  !> Blocks of a matrix between surface nodes; places that occur again add up.
  type :: contact_blocks_t
    integer :: n = 0
    !> Node of the force, and node whose position it is derived by; least shape (n).
    integer, allocatable :: row(:), column(:)
    !> Derivative of the force by the position [stress*length]; least shape (3, 3, n).
    real(wp), allocatable :: block(:, :, :)
  contains
    !> Forget all blocks.
    procedure :: start => contact_blocks_start
    !> Add a block.
    procedure :: add => contact_blocks_add
  end type contact_blocks_t

  interface grow
    module procedure grow_integers, grow_reals, grow_vectors, grow_matrices
  end interface grow

contains

  pure subroutine contact_rows_start(self, n_node)
    class(contact_rows_t), intent(inout) :: self
    !> Surface nodes.
    integer, intent(in) :: n_node

    integer, parameter :: ROOM = 64
    !> Stamps left for the conditions of one evaluation.
    integer, parameter :: MOST = huge(1) - 100000000

    if (.not. allocated(self%gap)) then
      allocate (self%gap(ROOM), self%area(ROOM), self%normal(3, ROOM), self%slave(ROOM), &
                self%key(ROOM), self%first(ROOM + 1))
      allocate (self%node(4 * ROOM), self%force(3, 4 * ROOM), self%slope(3, 4 * ROOM), &
                self%share(4 * ROOM))
      allocate (self%place(0), self%holder(0))
    end if
    if (size(self%place) /= n_node .or. self%stamp > MOST) then
      deallocate (self%place, self%holder)
      allocate (self%place(n_node), self%holder(n_node), source=0)
      self%stamp = 0
    end if
    self%n_row = 0
    self%first(1) = 1

  end subroutine contact_rows_start

  pure subroutine contact_rows_begin_row(self, slave, key, normal, gap, area)
    class(contact_rows_t), intent(inout) :: self
    integer, intent(in) :: slave
    integer, intent(in) :: key
    real(wp), intent(in) :: normal(3)
    !> [length]
    real(wp), intent(in) :: gap
    !> [length^2]
    real(wp), intent(in) :: area

    integer :: n

    n = self%n_row + 1
    if (n > size(self%gap)) then
      call grow(self%gap)
      call grow(self%area)
      call grow(self%normal)
      call grow(self%slave)
      call grow(self%key)
      call grow(self%first)
    end if
    if (n + 1 > size(self%first)) call grow(self%first)
    self%n_row = n
    self%slave(n) = slave
    self%key(n) = key
    self%normal(:, n) = normal
    self%gap(n) = gap
    self%area(n) = area
    self%first(n + 1) = self%first(n)
    self%stamp = self%stamp + 1

  end subroutine contact_rows_begin_row

  pure subroutine contact_rows_add(self, node, force, slope, share)
    class(contact_rows_t), intent(inout) :: self
    integer, intent(in) :: node
    real(wp), intent(in) :: force(3)
    real(wp), intent(in) :: slope(3)
    real(wp), intent(in) :: share

    integer :: entry

    if (self%holder(node) == self%stamp) then
      entry = self%place(node)
      self%force(:, entry) = self%force(:, entry) + force
      self%slope(:, entry) = self%slope(:, entry) + slope
      self%share(entry) = self%share(entry) + share
      return
    end if
    entry = self%first(self%n_row + 1)
    if (entry > size(self%node)) then
      call grow(self%node)
      call grow(self%force)
      call grow(self%slope)
      call grow(self%share)
    end if
    self%node(entry) = node
    self%force(:, entry) = force
    self%slope(:, entry) = slope
    self%share(entry) = share
    self%place(node) = entry
    self%holder(node) = self%stamp
    self%first(self%n_row + 1) = entry + 1

  end subroutine contact_rows_add

  pure subroutine contact_rows_drop_row(self)
    class(contact_rows_t), intent(inout) :: self

    self%n_row = self%n_row - 1

  end subroutine contact_rows_drop_row

  pure subroutine contact_rows_scale(self, factor)
    class(contact_rows_t), intent(inout) :: self
    real(wp), intent(in) :: factor

    integer :: n

    n = self%count_entries()
    self%area(:self%n_row) = factor * self%area(:self%n_row)
    self%force(:, :n) = factor * self%force(:, :n)
    self%slope(:, :n) = factor * self%slope(:, :n)
    self%share(:n) = factor * self%share(:n)

  end subroutine contact_rows_scale

  pure function contact_rows_count_entries(self) result(n_entry)
    class(contact_rows_t), intent(in) :: self
    integer :: n_entry

    n_entry = self%first(self%n_row + 1) - 1

  end function contact_rows_count_entries

  pure subroutine contact_blocks_start(self)
    class(contact_blocks_t), intent(inout) :: self

    integer, parameter :: ROOM = 256

    if (.not. allocated(self%row)) then
      allocate (self%row(ROOM), self%column(ROOM), self%block(3, 3, ROOM))
    end if
    self%n = 0

  end subroutine contact_blocks_start

  pure subroutine contact_blocks_add(self, row, column, block)
    class(contact_blocks_t), intent(inout) :: self
    integer, intent(in) :: row
    integer, intent(in) :: column
    real(wp), intent(in) :: block(3, 3)

    if (self%n == size(self%row)) then
      call grow(self%row)
      call grow(self%column)
      call grow(self%block)
    end if
    self%n = self%n + 1
    self%row(self%n) = row
    self%column(self%n) = column
    self%block(:, :, self%n) = block

  end subroutine contact_blocks_add

  !> Double the room.
  pure subroutine grow_integers(list)
    integer, allocatable, intent(inout) :: list(:)

    integer, allocatable :: longer(:)

    allocate (longer(2 * size(list)))
    longer(:size(list)) = list
    call move_alloc(longer, list)

  end subroutine grow_integers

  pure subroutine grow_reals(list)
    real(wp), allocatable, intent(inout) :: list(:)

    real(wp), allocatable :: longer(:)

    allocate (longer(2 * size(list)))
    longer(:size(list)) = list
    call move_alloc(longer, list)

  end subroutine grow_reals

  pure subroutine grow_vectors(list)
    real(wp), allocatable, intent(inout) :: list(:, :)

    real(wp), allocatable :: longer(:, :)

    allocate (longer(size(list, 1), 2 * size(list, 2)))
    longer(:, :size(list, 2)) = list
    call move_alloc(longer, list)

  end subroutine grow_vectors

  pure subroutine grow_matrices(list)
    real(wp), allocatable, intent(inout) :: list(:, :, :)

    real(wp), allocatable :: longer(:, :, :)

    allocate (longer(size(list, 1), size(list, 2), 2 * size(list, 3)))
    longer(:, :, :size(list, 3)) = list
    call move_alloc(longer, list)

  end subroutine grow_matrices

end module swage_contact_rows
