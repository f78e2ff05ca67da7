!> Multipliers of the contacts of [[swage_mechanics]] as unknowns of the Newton iterations.
!>
!> With K the tangent of cells and pressures held, F the forces by a unit pressure of each active
!> condition and G the derivative of its penetration g, a correction is to satisfy
!> \[ K \Delta u - F \Delta \lambda = -R(\lambda), \qquad G \Delta u = -g. \]
!> The matrix at hand is \(K - F \rho G\), and R is taken at the pressure \(m + \rho g\): with the
!> multipliers m unchanged its solution is the correction of the penalty. For the change δ of m that
!> closes the conditions, the penetrations left, \(r = g + G \Delta u\), must vanish:
!> \(G (K - F \rho G)^{-1} F \, \delta = -r\), an operator that tends to \(-1/\rho\) with a growing
!> penalty, so that \(\delta = \rho r\) is nearly the solution (augmented Lagrangian
!> preconditioning: Benzi, Golub and Liesen, Acta Numerica 14, 2005, section 8). Generalised
!> conjugate residuals make up for the rest (Eisenstat, Elman and Schultz, SIAM Journal on Numerical
!> Analysis 20, 1983): each one costs a solution with the factors at hand. The matrix keeps pattern
!> and definiteness of the penalty's, and the result does not depend on the penalty.
submodule(swage_mechanics) swage_mechanics_multipliers
  use swage_contact_state, only: contact_state_t
  implicit none(type, external)

  !> Solutions for one correction.
  integer, parameter :: MOST_DIRECTIONS = 24
  !> A direction that changes no more of its penetration than this share is of no use [1].
  real(wp), parameter :: USELESS = 1.0e-10_wp
  !> Accuracy of a direction, by that of the correction [1].
  real(wp), parameter :: MARGIN = 0.3_wp
  !> Of the largest penetration that is accepted, what a correction for its sake leaves [1].
  real(wp), parameter :: CLOSED_SHARE = 0.1_wp

  !> The conditions of all contacts, one behind the other: those with tools first.
  type :: all_conditions_t
    integer :: n = 0
    !> Before the first of each contact and pair.
    integer, allocatable :: of_contact(:), of_pair(:)
    !> Penetration and the opposite of the slip [length], pressure and traction by them
    !> [stress/length], and force by them [force/length], 0 where nothing is to be closed or held;
    !> shape (4, n).
    real(wp), allocatable :: penetration(:, :), penalty(:, :), stiffness(:, :)
    !> Penetration that counts as closed [length]; shape (n).
    real(wp), allocatable :: limit(:)
  contains
    procedure :: add => all_conditions_add
  end type all_conditions_t

  !> A change of pressures and bonds, and what follows from it.
  type :: direction_t
    !> [stress]; shape (4, n of the conditions).
    real(wp), allocatable :: traction(:, :)
    !> Change of penetrations and opposite slips [length]; shape of `traction`.
    real(wp), allocatable :: rate(:, :)
    !> Of the nodes, along the local axes; shape (n_dim + 1, n_node).
    real(wp), allocatable :: motion(:, :)
    !> Of the controlled coordinates; shape (n of the controls).
    real(wp), allocatable :: step(:)
  end type direction_t

contains

  module procedure share_freedom

    real(wp), allocatable :: free(:, :), gathered(:, :)
    integer :: i, j, k, n

    if (.not. corrects(self)) return
    n = self%mesh%dimension
    allocate (free(self%unknowns%n_slot, self%unknowns%n_node))
    allocate (gathered(3, self%surface%n_node))
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        if (.not. allocated(contact%freedom)) then
          allocate (contact%freedom(3, 3, size(contact%node)), source=0.0_wp)
        end if
      end associate
    end do
    do i = 1, size(self%pairs)
      associate (contact => self%pairs(i)%contact)
        if (.not. allocated(contact%freedom)) then
          allocate (contact%freedom(3, 3, self%surface%n_node), source=0.0_wp)
        end if
      end associate
    end do
    do k = 1, n
      free = 0.0_wp
      free(k, :) = 1.0_wp
      call self%constraints%remove_from(free)
      do i = 1, size(self%contacts)
        associate (contact => self%contacts(i))
          do j = 1, size(contact%node)
            contact%freedom(:n, k, j) = free(:n, self%unknowns%of_node(contact%node(j)))
          end do
        end associate
      end do
      if (size(self%pairs) == 0) cycle
      call self%surface%gather(free(:n, self%unknowns%of_node), gathered)
      do i = 1, size(self%pairs)
        self%pairs(i)%contact%freedom(:, k, :) = gathered
      end do
    end do

  end procedure share_freedom

  !> True when any contact corrects its multipliers.
  pure function corrects(self)
    class(mechanics_t), intent(in) :: self
    logical :: corrects

    integer :: i

    corrects = .false.
    do i = 1, size(self%contacts)
      corrects = corrects .or. self%contacts(i)%enforcement%within_newton
    end do
    do i = 1, size(self%pairs)
      corrects = corrects .or. self%pairs(i)%contact%enforcement%within_newton
    end do

  end function corrects

  module procedure correct_multipliers

    real(wp), allocatable :: change(:, :), left(:, :)
    type(all_conditions_t) :: conditions
    type(direction_t) :: directions(MOST_DIRECTIONS)
    real(wp) :: amount, share, target
    integer :: k
    logical :: is_useless

    if (.not. corrects(self)) return
    call list_conditions(self, conditions)
    amount = sum(conditions%stiffness)
    call self%comm%sum(amount)
    if (.not. amount > 0.0_wp) return

    allocate (left(4, conditions%n), change(4, conditions%n), source=0.0_wp)
    call penetrate(self, conditions, self%correction, self%controls%correction, left)
    left = merge(conditions%penetration + left, 0.0_wp, conditions%stiffness > 0.0_wp)
    target = self%linear_tolerance * force_of(self, conditions, left)
    if (.not. self%has_pending_values) then
      target = max(target, self%linear_tolerance * self%errors(1) * self%scales(1))
    end if
    do k = 1, MOST_DIRECTIONS
      amount = force_of(self, conditions, left)
      share = 0.0_wp
      if (self%asks_for_correction) share = open_share(self, conditions, left)
      if (amount <= target .and. share <= 1.0_wp) exit
      call find_direction(self, conditions, left, weight, directions(:k - 1), directions(k), &
                          is_useless, status)
      if (is_useless .or. status%failed()) exit
      associate (direction => directions(k))
        amount = -product_of(self, conditions, direction%rate, left)
        left = left + amount * direction%rate
        change = change + amount * direction%traction
        self%correction = self%correction + amount * direction%motion
        self%controls%correction = self%controls%correction + amount * direction%step
      end associate
    end do
    if (.not. status%failed()) call set_corrections(self, conditions, change)

  end procedure correct_multipliers

  !> Collective. The next direction: what the nodes do where what is left open presses on them, its
  !> change of the open made perpendicular to those of the directions before, and of unit length.
  subroutine find_direction(self, conditions, left, weight, before, direction, is_useless, status)
    class(mechanics_t), intent(inout) :: self
    type(all_conditions_t), intent(in) :: conditions
    !> [length]; shape (4, conditions%n).
    real(wp), intent(in) :: left(:, :)
    real(wp), contiguous, intent(in) :: weight(:)
    type(direction_t), intent(in) :: before(:)
    type(direction_t), intent(out) :: direction
    !> True when it would change nothing.
    logical, intent(out) :: is_useless
    type(status_t), intent(inout) :: status

    real(wp) :: amount, length
    integer :: i

    is_useless = .true.
    allocate (direction%traction, source=conditions%penalty * left)
    allocate (direction%rate(4, conditions%n), direction%step(self%controls%n))
    allocate (direction%motion(self%unknowns%n_slot, self%unknowns%n_node))
    call respond(self, conditions, direction%traction, weight, MARGIN * self%linear_tolerance, &
                 direction%motion, direction%step, status)
    if (status%failed()) return
    call penetrate(self, conditions, direction%motion, direction%step, direction%rate)
    where (.not. conditions%stiffness > 0.0_wp) direction%rate = 0.0_wp
    do i = 1, size(before)
      amount = product_of(self, conditions, before(i)%rate, direction%rate)
      direction%rate = direction%rate - amount * before(i)%rate
      direction%traction = direction%traction - amount * before(i)%traction
      direction%motion = direction%motion - amount * before(i)%motion
      direction%step = direction%step - amount * before(i)%step
    end do
    length = sqrt(product_of(self, conditions, direction%rate, direction%rate))
    is_useless = length <= USELESS * sqrt(product_of(self, conditions, left, left))
    if (is_useless) return
    direction%rate = direction%rate / length
    direction%traction = direction%traction / length
    direction%motion = direction%motion / length
    direction%step = direction%step / length

  end subroutine find_direction

  !> Give the contacts their corrections; those of bonds are turned back to the start of the step.
  subroutine set_corrections(self, conditions, change)
    class(mechanics_t), intent(inout) :: self
    type(all_conditions_t), intent(in) :: conditions
    !> Of pressures and bonds [stress]; shape (4, conditions%n).
    real(wp), intent(in) :: change(:, :)

    integer :: i, j

    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i), first => conditions%of_contact(i))
        contact%multiplier_correction = change(1, first + 1:first + size(contact%tag))
        do j = 1, size(contact%tag)
          contact%bond_correction(:, j) = matmul(change(2:, first + j), &
                                                 self%tools(contact%tool)%rotation_increment)
        end do
      end associate
    end do
    do i = 1, size(self%pairs)
      associate (contact => self%pairs(i)%contact, first => conditions%of_pair(i))
        contact%multiplier_correction = change(1, first + 1:first + size(contact%tag))
        do j = 1, size(contact%tag)
          contact%bond_correction(:, j) = matmul(change(2:, first + j), contact%turn(:, :, j))
        end do
      end associate
    end do

  end subroutine set_corrections

  !> Collective. Scalar product of penetrations, as twice an energy.
  function product_of(self, conditions, a, b) result(total)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    real(wp), intent(in) :: a(:, :)
    real(wp), intent(in) :: b(:, :)
    real(wp) :: total

    total = sum(conditions%stiffness * a * b)
    call self%comm%sum(total)

  end function product_of

  !> Collective. Norm of the forces that the penalty makes of penetrations.
  function force_of(self, conditions, penetration) result(force)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    real(wp), intent(in) :: penetration(:, :)
    real(wp) :: force

    force = sum((conditions%stiffness * penetration)**2)
    call self%comm%sum(force)
    force = sqrt(force)

  end function force_of

  !> Collective. Largest penetration by what counts as closed.
  function open_share(self, conditions, penetration) result(share)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    real(wp), intent(in) :: penetration(:, :)
    real(wp) :: share

    share = 0.0_wp
    if (conditions%n > 0) share = maxval(abs(penetration(1, :)) / conditions%limit)
    call self%comm%max(share)

  end function open_share

  !> All conditions of this rank.
  subroutine list_conditions(self, conditions)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(out) :: conditions

    integer :: i, n

    allocate (conditions%of_contact(size(self%contacts)), conditions%of_pair(size(self%pairs)))
    n = 0
    do i = 1, size(self%contacts)
      n = n + size(self%contacts(i)%tag)
    end do
    do i = 1, size(self%pairs)
      n = n + size(self%pairs(i)%contact%tag)
    end do
    allocate (conditions%penetration(4, n), conditions%penalty(4, n), conditions%stiffness(4, n), &
              conditions%limit(n))
    do i = 1, size(self%contacts)
      conditions%of_contact(i) = conditions%n
      call conditions%add(self%contacts(i)%contact_state_t)
    end do
    do i = 1, size(self%pairs)
      conditions%of_pair(i) = conditions%n
      call conditions%add(self%pairs(i)%contact%contact_state_t)
    end do

  end subroutine list_conditions

  !> Those of one contact.
  pure subroutine all_conditions_add(self, contact)
    class(all_conditions_t), intent(inout) :: self
    type(contact_state_t), intent(in) :: contact

    integer :: i

    do i = 1, size(contact%tag)
      self%n = self%n + 1
      self%penetration(:, self%n) = [contact%penetration(i), -contact%slip(:, i)]
      self%penalty(1, self%n) = contact%growth * contact%penalty(i)
      self%penalty(2:, self%n) = contact%growth * contact%tangential_stiffness(i)
      self%stiffness(1, self%n) = contact%stiffness_of(i)
      self%stiffness(2:, self%n) = contact%shear_stiffness_of(i)
      self%limit(self%n) = CLOSED_SHARE * contact%enforcement%penetration_tolerance &
        * contact%size(i)
    end do

  end subroutine all_conditions_add

  !> Collective. How the nodes, and tools that follow forces, give way to pressures and bonds.
  subroutine respond(self, conditions, traction, weight, tolerance, motion, step, status)
    class(mechanics_t), intent(inout) :: self
    type(all_conditions_t), intent(in) :: conditions
    !> Of pressures and bonds [stress]; shape (4, conditions%n).
    real(wp), intent(in) :: traction(:, :)
    !> Of the slots of a residual, for the linear solver; shape (n_dim + 1).
    real(wp), contiguous, intent(in) :: weight(:)
    real(wp), intent(in) :: tolerance
    !> Along the local axes; shape (n_dim + 1, n_node).
    real(wp), contiguous, intent(out) :: motion(:, :)
    !> Of the controlled coordinates; shape (n of the controls).
    real(wp), intent(out) :: step(:)
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: column(:, :)
    real(wp), allocatable, target :: force(:, :)
    real(wp), pointer :: list(:)
    real(wp) :: pushed(3), tool_force(self%controls%n), x(3)
    integer :: i, j, k, n

    n = self%mesh%dimension
    allocate (column(self%unknowns%n_slot, self%unknowns%n_node), source=0.0_wp)
    tool_force = 0.0_wp
    x = 0.0_wp
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        do j = 1, size(contact%node)
          if (.not. contact%active(j)) cycle
          associate (change => traction(:, conditions%of_contact(i) + j))
            pushed = change(1) * contact%node_push(:, j) + contact%area(j) * change(2:)
          end associate
          associate (f => column(:n, self%unknowns%of_node(contact%node(j))))
            f = f + pushed(:n)
          end associate
          do k = 1, self%controls%n
            if (self%controls%tool(k) /= contact%tool) cycle
            x(:n) = self%mesh%coordinates(:, contact%node(j)) + self%increment(:, contact%node(j))
            tool_force(k) = tool_force(k) &
              - dot_product(pushed, self%tools(contact%tool)%lever(self%controls%place(k), x))
          end do
        end do
      end associate
    end do
    call self%comm%sum(tool_force)
    if (size(self%pairs) > 0) then
      allocate (force(3, self%surface%n_node), source=0.0_wp)
      do i = 1, size(self%pairs)
        associate (contact => self%pairs(i)%contact, first => conditions%of_pair(i))
          call contact%push(self%pairs(i)%rows, &
                            traction(:, first + 1:first + size(contact%tag)), force)
        end associate
      end do
      list(1:size(force)) => force
      call self%comm%sum(list)
      do i = 1, self%surface%n_node
        if (.not. self%surface%is_own(i)) cycle
        associate (f => column(:n, self%unknowns%of_node(self%surface%mesh_node(i))))
          f = f + force(:n, i)
        end associate
      end do
    end if
    call self%constraints%remove_from(column)
    call self%constraints%to_local(column)
    call self%solver%solve(self%matrix, column, weight, tolerance, motion, status)
    call self%comm%agree(status)
    if (status%failed()) return
    do i = 1, self%constraints%n_constrained
      do k = 1, self%constraints%n_direction(i)
        motion(k, self%constraints%node(i)) = 0.0_wp
      end do
    end do
    call follow_with_tools(self, tool_force, motion, step)

  end subroutine respond

  !> Collective. Change of penetrations and opposite slips of active conditions by a motion; 0 of
  !> others.
  subroutine penetrate(self, conditions, motion, step, change)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    !> Along the local axes; shape (n_dim + 1, n_node).
    real(wp), intent(in) :: motion(:, :)
    !> Of the controlled coordinates; shape (n of the controls).
    real(wp), intent(in) :: step(:)
    !> [length]; shape (4, conditions%n).
    real(wp), intent(out) :: change(:, :)

    real(wp), allocatable :: gathered(:, :), global(:, :)
    real(wp) :: relative(3), x(3)
    integer :: i, j, k, n

    n = self%mesh%dimension
    change = 0.0_wp
    x = 0.0_wp
    allocate (global, source=motion)
    call self%constraints%to_global(global)
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        do j = 1, size(contact%node)
          if (.not. contact%active(j)) cycle
          relative = 0.0_wp
          relative(:n) = global(:n, self%unknowns%of_node(contact%node(j)))
          do k = 1, self%controls%n
            if (self%controls%tool(k) /= contact%tool) cycle
            x(:n) = self%mesh%coordinates(:, contact%node(j)) + self%increment(:, contact%node(j))
            relative = relative &
              - step(k) * self%tools(contact%tool)%lever(self%controls%place(k), x)
          end do
          associate (here => change(:, conditions%of_contact(i) + j))
            here(1) = -dot_product(contact%node_normal(:, j), relative)
            here(2:) = -matmul(contact%node_slip(:, :, j), relative)
          end associate
        end do
      end associate
    end do
    if (size(self%pairs) == 0) return
    allocate (gathered(3, self%surface%n_node))
    call self%surface%gather(global(:n, self%unknowns%of_node), gathered)
    do i = 1, size(self%pairs)
      associate (pair => self%pairs(i), contact => self%pairs(i)%contact, &
                 first => conditions%of_pair(i))
        call contact%penetrate(pair%rows, gathered, &
                               change(:, first + 1:first + size(contact%tag)))
      end associate
    end do

  end subroutine penetrate

end submodule swage_mechanics_multipliers
