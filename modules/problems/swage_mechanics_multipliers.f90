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
    !> Penetration [length], pressure by it [stress/length], and force by it [force/length], 0 where
    !> nothing is to be closed; shape (n).
    real(wp), allocatable :: penetration(:), penalty(:), stiffness(:)
    !> Penetration that counts as closed [length]; shape (n).
    real(wp), allocatable :: limit(:)
  contains
    procedure :: add => all_conditions_add
  end type all_conditions_t

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

    real(wp), allocatable :: change(:), direction(:, :, :), left(:), pressure(:, :), rate(:, :), &
      step(:, :)
    real(wp) :: amount, length, target
    type(all_conditions_t) :: conditions
    integer :: i, k

    if (.not. corrects(self)) return
    call list_conditions(self, conditions)
    length = sum(conditions%stiffness)
    call self%comm%sum(length)
    if (.not. length > 0.0_wp) return

    allocate (left(conditions%n), change(conditions%n), source=0.0_wp)
    allocate (pressure(conditions%n, MOST_DIRECTIONS), rate(conditions%n, MOST_DIRECTIONS))
    allocate (direction(self%unknowns%n_slot, self%unknowns%n_node, MOST_DIRECTIONS))
    allocate (step(self%controls%n, MOST_DIRECTIONS))
    call penetrate(self, conditions, self%correction, self%controls%correction, left)
    left = merge(conditions%penetration + left, 0.0_wp, conditions%stiffness > 0.0_wp)
    target = self%linear_tolerance * force_of(self, conditions, left)
    if (.not. self%has_pending_values) then
      target = max(target, self%linear_tolerance * self%errors(1) * self%scales(1))
    end if

    do k = 1, MOST_DIRECTIONS
      amount = force_of(self, conditions, left)
      length = 0.0_wp
      if (self%asks_for_correction) length = open_share(self, conditions, left)
      if (amount <= target .and. length <= 1.0_wp) exit
      pressure(:, k) = conditions%penalty * left
      call respond(self, conditions, pressure(:, k), weight, MARGIN * self%linear_tolerance, &
                   direction(:, :, k), step(:, k), status)
      if (status%failed()) return
      call penetrate(self, conditions, direction(:, :, k), step(:, k), rate(:, k))
      where (.not. conditions%stiffness > 0.0_wp) rate(:, k) = 0.0_wp
      do i = 1, k
        amount = product_of(self, conditions, rate(:, i), rate(:, k))
        if (i == k) exit
        rate(:, k) = rate(:, k) - amount * rate(:, i)
        pressure(:, k) = pressure(:, k) - amount * pressure(:, i)
        direction(:, :, k) = direction(:, :, k) - amount * direction(:, :, i)
        step(:, k) = step(:, k) - amount * step(:, i)
      end do
      length = sqrt(amount)
      if (length <= USELESS * sqrt(product_of(self, conditions, left, left))) exit
      rate(:, k) = rate(:, k) / length
      pressure(:, k) = pressure(:, k) / length
      direction(:, :, k) = direction(:, :, k) / length
      step(:, k) = step(:, k) / length
      amount = -product_of(self, conditions, rate(:, k), left)
      left = left + amount * rate(:, k)
      change = change + amount * pressure(:, k)
      self%correction = self%correction + amount * direction(:, :, k)
      self%controls%correction = self%controls%correction + amount * step(:, k)
    end do

    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i), first => conditions%of_contact(i))
        contact%multiplier_correction = change(first + 1:first + size(contact%tag))
      end associate
    end do
    do i = 1, size(self%pairs)
      associate (contact => self%pairs(i)%contact, first => conditions%of_pair(i))
        contact%multiplier_correction = change(first + 1:first + size(contact%tag))
      end associate
    end do

  end procedure correct_multipliers

  !> Collective. Scalar product of penetrations, as twice an energy.
  function product_of(self, conditions, a, b) result(total)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    real(wp), intent(in) :: a(:)
    real(wp), intent(in) :: b(:)
    real(wp) :: total

    total = sum(conditions%stiffness * a * b)
    call self%comm%sum(total)

  end function product_of

  !> Collective. Norm of the forces that the penalty makes of penetrations.
  function force_of(self, conditions, penetration) result(force)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    real(wp), intent(in) :: penetration(:)
    real(wp) :: force

    force = sum((conditions%stiffness * penetration)**2)
    call self%comm%sum(force)
    force = sqrt(force)

  end function force_of

  !> Collective. Largest penetration by what counts as closed.
  function open_share(self, conditions, penetration) result(share)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    real(wp), intent(in) :: penetration(:)
    real(wp) :: share

    share = 0.0_wp
    if (conditions%n > 0) share = maxval(abs(penetration) / conditions%limit)
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
    allocate (conditions%penetration(n), conditions%penalty(n), conditions%stiffness(n), &
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
      self%penetration(self%n) = contact%penetration(i)
      self%penalty(self%n) = contact%growth * contact%penalty(i)
      self%stiffness(self%n) = contact%stiffness_of(i)
      self%limit(self%n) = CLOSED_SHARE * contact%enforcement%penetration_tolerance &
        * contact%size(i)
    end do

  end subroutine all_conditions_add

  !> Collective. How the nodes, and tools that follow forces, give way to pressures.
  subroutine respond(self, conditions, pressure, weight, tolerance, motion, step, status)
    class(mechanics_t), intent(inout) :: self
    type(all_conditions_t), intent(in) :: conditions
    !> [stress]; shape (conditions%n).
    real(wp), intent(in) :: pressure(:)
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
    real(wp) :: tool_force(self%controls%n), x(3)
    integer :: i, j, k, n

    n = self%mesh%dimension
    allocate (column(self%unknowns%n_slot, self%unknowns%n_node), source=0.0_wp)
    tool_force = 0.0_wp
    x = 0.0_wp
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        do j = 1, size(contact%node)
          if (.not. contact%active(j)) cycle
          associate (f => column(:n, self%unknowns%of_node(contact%node(j))))
            f = f + pressure(conditions%of_contact(i) + j) * contact%node_push(:n, j)
          end associate
          do k = 1, self%controls%n
            if (self%controls%tool(k) /= contact%tool) cycle
            x(:n) = self%mesh%coordinates(:, contact%node(j)) + self%increment(:, contact%node(j))
            tool_force(k) = tool_force(k) - pressure(conditions%of_contact(i) + j) &
              * dot_product(contact%node_push(:, j), &
                            self%tools(contact%tool)%lever(self%controls%place(k), x))
          end do
        end do
      end associate
    end do
    call self%comm%sum(tool_force)
    if (size(self%pairs) > 0) then
      allocate (force(3, self%surface%n_node), source=0.0_wp)
      do i = 1, size(self%pairs)
        associate (contact => self%pairs(i)%contact, first => conditions%of_pair(i))
          call contact%push(self%pairs(i)%rows, pressure(first + 1:first + size(contact%tag)), &
                            force)
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

  !> Collective. Change of the penetrations of active conditions by a motion; 0 of others.
  subroutine penetrate(self, conditions, motion, step, change)
    class(mechanics_t), intent(in) :: self
    type(all_conditions_t), intent(in) :: conditions
    !> Along the local axes; shape (n_dim + 1, n_node).
    real(wp), intent(in) :: motion(:, :)
    !> Of the controlled coordinates; shape (n of the controls).
    real(wp), intent(in) :: step(:)
    !> [length]; shape (conditions%n).
    real(wp), intent(out) :: change(:)

    real(wp), allocatable :: gathered(:, :), global(:, :), of_row(:)
    real(wp) :: relative(3), x(3)
    integer :: i, j, k, n

    n = self%mesh%dimension
    change = 0.0_wp
    relative = 0.0_wp
    x = 0.0_wp
    allocate (global, source=motion)
    call self%constraints%to_global(global)
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        do j = 1, size(contact%node)
          if (.not. contact%active(j)) cycle
          relative(:n) = global(:n, self%unknowns%of_node(contact%node(j)))
          do k = 1, self%controls%n
            if (self%controls%tool(k) /= contact%tool) cycle
            x(:n) = self%mesh%coordinates(:, contact%node(j)) + self%increment(:, contact%node(j))
            relative = relative &
              - step(k) * self%tools(contact%tool)%lever(self%controls%place(k), x)
          end do
          change(conditions%of_contact(i) + j) = &
            -dot_product(contact%node_normal(:n, j), relative(:n))
        end do
      end associate
    end do
    if (size(self%pairs) == 0) return
    allocate (gathered(3, self%surface%n_node))
    call self%surface%gather(global(:n, self%unknowns%of_node), gathered)
    do i = 1, size(self%pairs)
      associate (pair => self%pairs(i), contact => self%pairs(i)%contact, &
                 first => conditions%of_pair(i))
        allocate (of_row(pair%rows%n_row))
        call pair%rows%change_gaps(gathered, of_row)
        call contact%penetrate(pair%rows, of_row, change(first + 1:first + size(contact%tag)))
        deallocate (of_row)
      end associate
    end do

  end subroutine penetrate

end submodule swage_mechanics_multipliers
