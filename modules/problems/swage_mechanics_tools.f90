!> Tools of [[swage_mechanics]] whose position follows from forces.
!>
!> Their coordinates q are unknowns beside those of the nodes. With R the residual of the nodes and
!> r that of the coordinates, Newton's equations K Δu + B Δq = -R, C^T Δu + D Δq = -r are solved
!> with the factors of K: one more right-hand side for each coordinate, and a small dense system.
!>
!> A rigid motion of body and tool together turns contact forces and does not change them: all
!> derivatives by q follow from the forces f of the nodes, their derivatives S by the nodes' places,
!> and the levers m = ∂x/∂q of the tool's points. With w the axis of a rotation, zero for a
!> translation, ∂f/∂q = w × f - S m.
submodule(swage_mechanics) swage_mechanics_tools
  use swage_rotation, only: cross_product
  implicit none(type, external)

  !> Stiffness of a coordinate that only the tangent has, by that of the tool's contact: a tool that
  !> nothing holds stays where it is.
  real(wp), parameter :: LOOSE = 1.0e-10_wp
  !> Accuracy of the nodes' response to a tool: the body gives way much less than the contact, and
  !> what is left of their difference counts.
  real(wp), parameter :: RESPONSE_TOLERANCE = 1.0e-10_wp
  !> Largest correction of a tool in cell sizes.
  real(wp), parameter :: LONGEST_MOVE = 1.0_wp
  !> Moves towards the bodies until they touch, and by the cell size: the longest way there, and the
  !> gap that counts as none.
  integer, parameter :: MAXIMUM_APPROACHES = 200
  real(wp), parameter :: LONGEST_WAY = 1.0e4_wp
  real(wp), parameter :: TOUCH = 1.0e-6_wp

contains

  module procedure create_controls

    integer :: i, k, n

    n = 0
    do i = 1, size(self%tools)
      n = n + size(self%tools(i)%controls)
    end do
    associate (controls => self%controls)
      allocate (controls%tool(n), controls%place(n))
      allocate (controls%residual(n), controls%base(n), controls%correction(n), &
                controls%reach(n), controls%stiffness(n), controls%tangent(n, n), source=0.0_wp)
      allocate (controls%touches(size(self%tools)), source=.false.)
      n = 0
      do i = 1, size(self%tools)
        do k = 1, size(self%tools(i)%controls)
          n = n + 1
          controls%tool(n) = i
          controls%place(n) = k
        end do
      end do
      controls%n = n
    end associate

  end procedure create_controls

  module procedure begin_tools

    real(wp), allocatable :: moved(:, :)
    real(wp) :: x(3)
    integer :: i, j, k

    do i = 1, size(self%tools)
      associate (tool => self%tools(i))
        call tool%begin_step(self%time, self%time_new)
        if (size(tool%controls) == 0) cycle
        call tool%set_offset(tool%offset_old + share * tool%offset_change)
      end associate
    end do
    if (self%controls%n == 0) return

    allocate (moved, source=self%mesh%coordinates + self%increment)
    do i = 1, size(self%tools)
      if (size(self%tools(i)%controls) > 0) call approach(self, i, moved)
    end do

    ! Largest lever of the surface
    self%controls%reach = 0.0_wp
    x = 0.0_wp
    do k = 1, self%controls%n
      associate (tool => self%tools(self%controls%tool(k)), reach => self%controls%reach(k))
        do i = 1, size(self%contacts)
          if (self%contacts(i)%tool /= self%controls%tool(k)) cycle
          do j = 1, size(self%contacts(i)%node)
            x(:self%mesh%dimension) = moved(:, self%contacts(i)%node(j))
            reach = max(reach, norm2(tool%lever(self%controls%place(k), x)))
          end do
        end do
        call self%comm%max(reach)
        if (.not. reach > 0.0_wp) reach = 1.0_wp
      end associate
    end do

  end procedure begin_tools

  !> Collective. Move a tool along its forces until it touches, if it does not yet: what happens
  !> before takes no force, and no time. Steps are as long as the way is free whatever its
  !> direction.
  subroutine approach(self, i, moved)
    class(mechanics_t), intent(inout) :: self
    !> Place of the tool.
    integer, intent(in) :: i
    !> Positions of the nodes [length].
    real(wp), intent(in) :: moved(:, :)

    real(wp), allocatable :: direction(:), start(:)
    real(wp) :: gap, way
    integer :: step

    call free_forces(self, i, direction)
    if (.not. norm2(direction) > 0.0_wp) return
    direction = direction / norm2(direction)
    allocate (start, source=self%tools(i)%offset)
    way = 0.0_wp
    do step = 1, MAXIMUM_APPROACHES
      gap = gap_of_tool(self, i, moved)
      if (gap < TOUCH * self%cell_size) return
      way = way + gap + TOUCH * self%cell_size
      if (way > LONGEST_WAY * self%cell_size) exit
      call self%tools(i)%set_offset(start + way * direction)
    end do
    ! There is nothing in the way: the iterations will fail, and say so
    call self%tools(i)%set_offset(start)

  end subroutine approach

  !> Forces that drive the translations of a tool that touches nothing; 0 where a spring holds it.
  subroutine free_forces(self, i, force)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: i
    !> Shape (n_control).
    real(wp), allocatable, intent(out) :: force(:)

    integer :: k

    associate (tool => self%tools(i))
      allocate (force(size(tool%controls)), source=0.0_wp)
      do k = 1, size(tool%controls)
        associate (control => tool%controls(k))
          if (control%rotates .or. control%stiffness > 0.0_wp) cycle
          force(k) = control%load_at(self%time_new)
        end associate
      end do
    end associate

  end subroutine free_forces

  !> Collective. Smallest distance between a tool and the surfaces that may touch it [length];
  !> negative when it is inside, `huge` when there is none.
  function gap_of_tool(self, i, moved) result(gap)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: i
    real(wp), intent(in) :: moved(:, :)
    real(wp) :: gap

    real(wp) :: hessian(3, 3), normal(3), penetration, x(3)
    integer :: j, k

    gap = huge(1.0_wp)
    x = 0.0_wp
    do j = 1, size(self%contacts)
      if (self%contacts(j)%tool /= i) cycle
      do k = 1, size(self%contacts(j)%node)
        x(:self%mesh%dimension) = moved(:, self%contacts(j)%node(k))
        call self%tools(i)%project(x, penetration, normal, hessian)
        gap = min(gap, -penetration)
      end do
    end do
    call self%comm%min(gap)

  end function gap_of_tool

  module procedure balance_tools

    real(wp) :: lever(3), lever_l(3), sums(self%controls%n, self%controls%n + 2), x(3), &
      touching(size(self%tools))
    integer :: i, j, k, l, n

    if (self%controls%n == 0) return
    n = self%controls%n
    sums = 0.0_wp
    touching = 0.0_wp
    x = 0.0_wp
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i), tool => self%tools(self%contacts(i)%tool))
        if (size(tool%controls) == 0) cycle
        do j = 1, size(contact%node)
          if (.not. contact%active(j)) cycle
          touching(contact%tool) = 1.0_wp
          x(:self%mesh%dimension) = moved(:, contact%node(j))
          do k = 1, n
            if (self%controls%tool(k) /= contact%tool) cycle
            lever = tool%lever(self%controls%place(k), x)
            sums(k, n + 1) = sums(k, n + 1) + dot_product(contact%node_force(:, j), lever)
            sums(k, n + 2) = sums(k, n + 2) + contact%growth * contact%penalty(j) &
              * contact%area(j) * dot_product(lever, lever)
            do l = 1, n
              if (self%controls%tool(l) /= contact%tool) cycle
              lever_l = tool%lever(self%controls%place(l), x)
              sums(k, l) = sums(k, l) &
                + dot_product(force_rate(self, l, contact%node_force(:, j), &
                                         contact%node_stiffness(:, :, j), lever_l), lever) &
                + dot_product(contact%node_force(:, j), lever_rate(self, k, l))
            end do
          end do
        end do
      end associate
    end do
    do k = 1, n + 2
      call self%comm%sum(sums(:, k))
    end do
    call self%comm%sum(touching)

    self%controls%touches = touching > 0.0_wp
    self%controls%falls = .false.
    self%controls%tangent = sums(:, :n)
    self%controls%stiffness = sums(:, n + 2)
    do k = 1, n
      associate (tool => self%tools(self%controls%tool(k)), place => self%controls%place(k))
        associate (control => tool%controls(place))
          self%controls%residual(k) = sums(k, n + 1) - control%load_at(self%time_new) &
            + control%stiffness * tool%offset(place)
          self%controls%tangent(k, k) = self%controls%tangent(k, k) + control%stiffness
          if (.not. self%controls%touches(self%controls%tool(k)) .and. &
              .not. control%stiffness > 0.0_wp .and. &
              abs(self%controls%residual(k)) > 0.0_wp) self%controls%falls = .true.
        end associate
      end associate
    end do

  end procedure balance_tools

  !> ∂f/∂q of a node's force.
  pure function force_rate(self, k, force, stiffness, lever) result(rate)
    class(mechanics_t), intent(in) :: self
    !> Place among all controls.
    integer, intent(in) :: k
    real(wp), intent(in) :: force(3)
    real(wp), intent(in) :: stiffness(3, 3)
    real(wp), intent(in) :: lever(3)
    real(wp) :: rate(3)

    rate = -matmul(stiffness, lever)
    associate (control => self%tools(self%controls%tool(k))%controls(self%controls%place(k)))
      if (control%rotates) rate = rate + cross_product(control%axis, force)
    end associate

  end function force_rate

  !> Derivative of the lever of control `k` by the coordinate `l` of the same tool: the axis of a
  !> rotation moves with the tool's translations.
  pure function lever_rate(self, k, l) result(rate)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: k
    integer, intent(in) :: l
    real(wp) :: rate(3)

    rate = 0.0_wp
    associate (tool => self%tools(self%controls%tool(k)))
      associate (by => tool%controls(self%controls%place(l)), &
                 control => tool%controls(self%controls%place(k)))
        if (control%rotates .and. .not. by%rotates) rate = -cross_product(control%axis, by%axis)
      end associate
    end associate

  end function lever_rate

  module procedure correct_tools

    real(wp), allocatable :: column(:, :)
    real(wp) :: right(self%controls%n), scale, system(self%controls%n, self%controls%n)
    integer :: k, l, n

    n = self%controls%n
    if (n == 0) return
    associate (unknowns => self%unknowns)
      allocate (column(unknowns%n_slot, unknowns%n_node))
      if (.not. allocated(self%controls%row)) then
        allocate (self%controls%row(unknowns%n_slot, unknowns%n_node, n), &
                  self%controls%response(unknowns%n_slot, unknowns%n_node, n))
      end if
    end associate
    self%controls%row = 0.0_wp
    self%controls%response = 0.0_wp
    self%controls%base = offsets(self)

    do k = 1, n
      if (.not. self%controls%touches(self%controls%tool(k))) cycle
      call border(self, k, column, self%controls%row(:, :, k))
      call self%constraints%to_local(self%controls%row(:, :, k))
      call self%constraints%remove_from(column)
      call self%constraints%to_local(column)
      call self%solver%solve(self%matrix, column, weight, RESPONSE_TOLERANCE, &
                             self%controls%response(:, :, k), status)
      call self%comm%agree(status)
      if (status%failed()) return
    end do

    ! What is left for the tools once the nodes have given way
    do k = 1, n
      associate (row => self%controls%row(:, :, k))
        right(k) = -self%controls%residual(k) - product_of(self, row, self%correction)
        do l = 1, n
          system(k, l) = self%controls%tangent(k, l) &
            - product_of(self, row, self%controls%response(:, :, l))
        end do
      end associate
      system(k, k) = system(k, k) + LOOSE * self%controls%stiffness(k)
    end do
    call free_tools(self, system, right)
    self%controls%system = system
    call solve_dense(system, right)

    ! Far from the solution a tool that is hardly held may not run away
    scale = 1.0_wp
    do k = 1, n
      if (.not. self%controls%touches(self%controls%tool(k))) cycle
      scale = max(scale, abs(right(k)) * self%controls%reach(k) &
                  / (LONGEST_MOVE * self%cell_size))
    end do
    self%controls%correction = right / scale
    do k = 1, n
      self%correction = self%correction &
        - self%controls%correction(k) * self%controls%response(:, :, k)
    end do

  end procedure correct_tools

  !> Collective. Sum over all nodes, each counted by its owner.
  function product_of(self, a, b) result(total)
    class(mechanics_t), intent(in) :: self
    real(wp), intent(in) :: a(:, :)
    real(wp), intent(in) :: b(:, :)
    real(wp) :: total

    total = sum(a(:, :self%unknowns%n_own_node) * b(:, :self%unknowns%n_own_node))
    call self%comm%sum(total)

  end function product_of

  module procedure follow_with_tools

    real(wp) :: system(self%controls%n, self%controls%n)
    integer :: k

    if (self%controls%n == 0) return
    do k = 1, self%controls%n
      step(k) = force(k) - product_of(self, self%controls%row(:, :, k), motion)
    end do
    system = self%controls%system
    call solve_dense(system, step)
    do k = 1, self%controls%n
      motion = motion - step(k) * self%controls%response(:, :, k)
    end do

  end procedure follow_with_tools

  !> Column ∂R/∂q and row ∂r/∂u of a control, along the global axes, of this rank's own nodes,
  !> whose numbers are those of the unknowns.
  subroutine border(self, k, column, row)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: k
    !> Shape (n_dim + 1, n_node).
    real(wp), intent(out) :: column(:, :)
    real(wp), intent(out) :: row(:, :)

    real(wp) :: lever(3), rate(3), x(3)
    integer :: i, j, n

    n = self%mesh%dimension
    column = 0.0_wp
    row = 0.0_wp
    x = 0.0_wp
    associate (tool => self%tools(self%controls%tool(k)), place => self%controls%place(k))
      do i = 1, size(self%contacts)
        associate (contact => self%contacts(i))
          if (contact%tool /= self%controls%tool(k)) cycle
          do j = 1, size(contact%node)
            if (.not. contact%active(j)) cycle
            associate (node => contact%node(j))
              x(:n) = self%mesh%coordinates(:, node) + self%increment(:, node)
              lever = tool%lever(place, x)
              rate = force_rate(self, k, contact%node_force(:, j), &
                                contact%node_stiffness(:, :, j), lever)
              column(:n, node) = column(:n, node) - rate(:n)
              rate = matmul(lever, contact%node_stiffness(:, :, j))
              if (tool%controls(place)%rotates) then
                rate = rate - cross_product(tool%controls(place)%axis, contact%node_force(:, j))
              end if
              row(:n, node) = row(:n, node) + rate(:n)
            end associate
          end do
        end associate
      end do
    end associate

  end subroutine border

  !> Tools that touch nothing: a spring brings them back, a force takes them to the bodies, and else
  !> they stay.
  subroutine free_tools(self, system, right)
    class(mechanics_t), intent(inout) :: self
    real(wp), intent(inout) :: system(:, :)
    real(wp), intent(inout) :: right(:)

    real(wp), allocatable :: moved(:, :)
    integer :: i, k

    if (all(self%controls%touches(self%controls%tool))) return
    allocate (moved, source=self%mesh%coordinates + self%increment)
    do i = 1, size(self%tools)
      if (self%controls%touches(i) .or. size(self%tools(i)%controls) == 0) cycle
      call approach(self, i, moved)
      do k = 1, self%controls%n
        associate (place => self%controls%place(k))
          if (self%controls%tool(k) /= i) cycle
          if (self%tools(i)%controls(place)%stiffness > 0.0_wp) cycle
          system(:, k) = 0.0_wp
          system(k, :) = 0.0_wp
          system(k, k) = 1.0_wp
          right(k) = self%tools(i)%offset(place) - self%controls%base(k)
        end associate
      end do
    end do

  end subroutine free_tools

  !> Solve a small system by elimination with the largest pivot of each column; both are
  !> overwritten. A zero pivot leaves its unknown at zero.
  pure subroutine solve_dense(system, right)
    real(wp), intent(inout) :: system(:, :)
    !> Right-hand side on entry, solution on return.
    real(wp), intent(inout) :: right(:)

    real(wp) :: factor, swapped(size(right))
    integer :: i, k, n, pivot

    n = size(right)
    do k = 1, n
      pivot = k - 1 + maxloc(abs(system(k:, k)), dim=1)
      if (.not. abs(system(pivot, k)) > 0.0_wp) cycle
      swapped = system(k, :)
      system(k, :) = system(pivot, :)
      system(pivot, :) = swapped
      right([k, pivot]) = right([pivot, k])
      do i = k + 1, n
        factor = system(i, k) / system(k, k)
        system(i, k:) = system(i, k:) - factor * system(k, k:)
        right(i) = right(i) - factor * right(k)
      end do
    end do
    do k = n, 1, -1
      if (abs(system(k, k)) > 0.0_wp) then
        right(k) = (right(k) - dot_product(system(k, k + 1:), right(k + 1:))) / system(k, k)
      else
        right(k) = 0.0_wp
      end if
    end do

  end subroutine solve_dense

  !> All controlled coordinates, at the end of the step.
  pure function offsets(self) result(values)
    class(mechanics_t), intent(in) :: self
    real(wp) :: values(self%controls%n)

    integer :: k

    do k = 1, self%controls%n
      values(k) = self%tools(self%controls%tool(k))%offset(self%controls%place(k))
    end do

  end function offsets

  module procedure move_tools

    real(wp) :: values(self%controls%n)
    integer :: i

    values = self%controls%base + step_length * self%controls%correction
    do i = 1, size(self%tools)
      if (size(self%tools(i)%controls) == 0) cycle
      call self%tools(i)%set_offset(pack(values, self%controls%tool == i))
    end do

  end procedure move_tools

  module procedure out_of_balance

    integer :: k

    words = ''
    if (self%controls%n == 0) return
    k = maxloc(abs(self%controls%residual) / self%controls%reach, dim=1)
    associate (tool => self%tools(self%controls%tool(k)))
      associate (control => tool%controls(self%controls%place(k)))
        if (abs(self%controls%residual(k)) / self%controls%reach(k) &
            < 0.5_wp * self%errors(1) * self%scales(1)) return
        words = ', tool '//tool%name//' is out of balance by '// &
          text(abs(self%controls%residual(k)))//' along control '//control%name
        if (.not. self%controls%touches(self%controls%tool(k))) words = words// &
          ' and touches nothing'
      end associate
    end associate

  end procedure out_of_balance

end submodule swage_mechanics_tools
