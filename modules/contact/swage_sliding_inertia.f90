!> Numerical inertia of nodes that rub on a tool: what keeps them from snapping.
!>
!> A node that sticks at an edge under a pressure that grows slips at last: it moves on, the
!> pressure falls, friction with it, and it moves on further. No increment is short enough for such
!> a step, for nothing in it depends on time. A resistance to the change of the sliding rate does:
!> the node accelerates over several increments. Between increments of equal length it is that of an
!> implicit integration of the equation of motion, with a mass that grows with the square of the
!> increment (compare the mass scaling of explicit codes). It is measured against the slip that rate
!> and trend of the last increments let expect, and what is within a small share of a cell of that
!> is free: only a snap feels it.
module swage_sliding_inertia
  use swage_kinds, only: wp
  use swage_rotation, only: dyadic
  use swage_snapshot, only: OF_SOME_NODES, snapshot_t
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: sliding_inertia_t, sliding_inertia_create

  !> Deviation from the expected slip that is free, by the cell size [1].
  real(wp), parameter :: FREE = 0.05_wp
  !> Increments in sequence from which the trend of the rate is known.
  integer, parameter :: TREND_KNOWN = 2

  !> Rates of the nodes of one contact; arrays have one entry a node.
  type :: sliding_inertia_t
    !> Resistance to a change of slip, by the flow stress on the cell size [1].
    real(wp) :: factor = 0.0_wp
    !> True when this increment goes on as the last ones did.
    logical :: is_steady = .false.
    !> Length of the increment and of the last one [time].
    real(wp) :: dt = 0.0_wp
    real(wp) :: dt_last = 0.0_wp
    !> How the tool turns in the increment.
    real(wp) :: turn(3, 3) = 0.0_wp
    !> Increments that the node has rubbed on the tool in a steady course.
    integer, allocatable :: age(:)
    !> Slip rate of the last increment [length/time], and its change [length/time^2]; shape (3, :).
    real(wp), allocatable :: rate(:, :), trend(:, :)
    !> Traction of the increment on the body [stress]; shape (3, :).
    real(wp), allocatable :: traction(:, :)
    !> Force of the last increment on the body [force]; shape (3, :).
    real(wp), allocatable :: force_old(:, :)
  contains
    !> Take the time and the turn of an increment.
    procedure :: begin_step => sliding_inertia_begin_step
    !> Traction of one node and its derivative.
    procedure :: resist => sliding_inertia_resist
    !> Work against it in the increment.
    procedure :: work => sliding_inertia_work
    !> Learn from an accepted increment.
    procedure :: accept => sliding_inertia_accept
    procedure :: save => sliding_inertia_save
    procedure :: load => sliding_inertia_load
  end type sliding_inertia_t

contains

  !> Nodes that have not touched yet.
  subroutine sliding_inertia_create(factor, n_node, inertia)
    !> At least 0 [1].
    real(wp), intent(in) :: factor
    integer, intent(in) :: n_node
    type(sliding_inertia_t), intent(out) :: inertia

    inertia%factor = factor
    allocate (inertia%age(n_node), source=0)
    allocate (inertia%rate(3, n_node), inertia%trend(3, n_node), inertia%traction(3, n_node), &
              inertia%force_old(3, n_node), source=0.0_wp)

  end subroutine sliding_inertia_create

  pure subroutine sliding_inertia_begin_step(self, dt, turn)
    class(sliding_inertia_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: dt
    !> How the tool turns in the increment.
    real(wp), intent(in) :: turn(3, 3)

    self%dt = dt
    self%turn = turn
    self%traction = 0.0_wp

  end subroutine sliding_inertia_begin_step

  !> A slip that deviates by more than is free is resisted in proportion to the rest; the expected
  !> one lies down in the tangent plane of the end of the increment.
  pure subroutine sliding_inertia_resist(self, i, stress, size, normal, d_normal, slip, d_slip, &
                                         d_traction)
    class(sliding_inertia_t), intent(inout) :: self
    !> Place of the node in the list.
    integer, intent(in) :: i
    !> Flow stress [stress] and size of a cell [length] at the node.
    real(wp), intent(in) :: stress, size
    !> Normal out of the tool, and its derivative by the position [1/length].
    real(wp), intent(in) :: normal(3), d_normal(3, 3)
    !> Slip of the body on the tool in the increment [length], and its derivative [1].
    real(wp), intent(in) :: slip(3), d_slip(3, 3)
    !> Derivative of `traction` [stress/length].
    real(wp), intent(out) :: d_traction(3, 3)

    real(wp) :: d_deviation(3, 3), deviation(3), expected(3), share, stiffness

    self%traction(:, i) = 0.0_wp
    d_traction = 0.0_wp
    if (.not. self%is_steady .or. self%age(i) < TREND_KNOWN) return
    expected = self%dt * matmul(self%turn, self%rate(:, i) &
                                + 0.5_wp * (self%dt + self%dt_last) * self%trend(:, i))
    deviation = slip - expected + normal * dot_product(normal, expected)
    if (norm2(deviation) <= FREE * size) return
    d_deviation = d_slip + dot_product(normal, expected) * d_normal &
      + dyadic(normal, matmul(transpose(d_normal), expected))
    stiffness = self%factor * stress / size
    share = FREE * size / norm2(deviation)
    self%traction(:, i) = -stiffness * (1.0_wp - share) * deviation
    d_traction = -stiffness * ((1.0_wp - share) * d_deviation + share / norm2(deviation)**2 &
                               * dyadic(deviation, matmul(transpose(d_deviation), deviation)))

  end subroutine sliding_inertia_resist

  !> By the trapezoidal rule, as all works are.
  pure function sliding_inertia_work(self, i, area, slip) result(work)
    class(sliding_inertia_t), intent(in) :: self
    integer, intent(in) :: i
    !> [length^2]
    real(wp), intent(in) :: area
    !> Motion of the body past the tool in the increment [length].
    real(wp), intent(in) :: slip(3)
    !> Taken from the body [energy].
    real(wp) :: work

    work = -0.5_wp * dot_product(matmul(self%turn, self%force_old(:, i)) &
                                 + area * self%traction(:, i), slip)

  end function sliding_inertia_work

  pure subroutine sliding_inertia_accept(self, area, rubs, slip)
    class(sliding_inertia_t), intent(inout) :: self
    !> [length^2]; one entry a node.
    real(wp), intent(in) :: area(:)
    !> True for the nodes that rub on the tool; one entry a node.
    logical, intent(in) :: rubs(:)
    !> Slip of the increment [length]; shape (3, n_node).
    real(wp), intent(in) :: slip(:, :)

    real(wp) :: rate(3)
    integer :: i

    do i = 1, size(area)
      self%force_old(:, i) = area(i) * self%traction(:, i)
      self%trend(:, i) = 0.0_wp
      if (.not. rubs(i)) then
        self%age(i) = 0
        self%rate(:, i) = 0.0_wp
        cycle
      end if
      rate = slip(:, i) / self%dt
      if (.not. self%is_steady) self%age(i) = 0
      if (self%age(i) > 0) then
        self%trend(:, i) = (rate - matmul(self%turn, self%rate(:, i))) &
          / (0.5_wp * (self%dt + self%dt_last))
      end if
      self%age(i) = min(self%age(i) + 1, TREND_KNOWN)
      self%rate(:, i) = rate
    end do
    self%dt_last = self%dt

  end subroutine sliding_inertia_accept

  subroutine sliding_inertia_save(self, title, first, node, snapshot)
    class(sliding_inertia_t), intent(in) :: self
    !> What the names of the arrays begin with.
    character(len=*), intent(in) :: title
    !> Place of the first node in the list; those of the others follow.
    integer, intent(in) :: first
    !> Of the mesh.
    integer, intent(in) :: node(:)
    type(snapshot_t), intent(inout) :: snapshot

    integer :: last

    last = first + size(node) - 1
    call snapshot%put(title//'rubs', self%age(first:last) > 0, OF_SOME_NODES, node)
    call snapshot%put(title//'has a trend', self%age(first:last) >= TREND_KNOWN, OF_SOME_NODES, &
                      node)
    call snapshot%put(title//'slip rate', self%rate(:, first:last), OF_SOME_NODES, node)
    call snapshot%put(title//'trend of the slip rate', self%trend(:, first:last), OF_SOME_NODES, &
                      node)
    call snapshot%put(title//'inertia', self%force_old(:, first:last), OF_SOME_NODES, node)
    call snapshot%put(title//'last dt', self%dt_last)

  end subroutine sliding_inertia_save

  subroutine sliding_inertia_load(self, title, first, node, snapshot, status)
    class(sliding_inertia_t), intent(inout) :: self
    character(len=*), intent(in) :: title
    integer, intent(in) :: first
    integer, intent(in) :: node(:)
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` on this rank when something is missing.
    type(status_t), intent(inout) :: status

    integer :: last
    logical, allocatable :: has_trend(:), rubs(:)

    last = first + size(node) - 1
    allocate (has_trend(size(node)), rubs(size(node)), source=.false.)
    call snapshot%get(title//'rubs', rubs, status, OF_SOME_NODES, node)
    call snapshot%get(title//'has a trend', has_trend, status, OF_SOME_NODES, node)
    self%age(first:last) = merge(TREND_KNOWN, merge(1, 0, rubs), has_trend)
    call snapshot%get(title//'slip rate', self%rate(:, first:last), status, OF_SOME_NODES, node)
    call snapshot%get(title//'trend of the slip rate', self%trend(:, first:last), status, &
                      OF_SOME_NODES, node)
    call snapshot%get(title//'inertia', self%force_old(:, first:last), status, OF_SOME_NODES, node)
    call snapshot%get(title//'last dt', self%dt_last, status)

  end subroutine sliding_inertia_load

end module swage_sliding_inertia
