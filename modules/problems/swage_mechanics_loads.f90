!> Boundary conditions of [[swage_mechanics]]: motion, loads, and the work of all that acts.
submodule(swage_mechanics) swage_mechanics_loads
  use swage_boundary, only: BOUNDARY_MOTION, BOUNDARY_PRESSURE, BOUNDARY_SYMMETRY, &
                            BOUNDARY_TRACTION
  use swage_mini_element, only: AXISYMMETRIC
  use swage_status, only: STATUS_ERROR
  use swage_tool_contact, only: facet_normal
  implicit none(type, external)

  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)

contains

  !> Directions and increments that the boundaries impose in this step.
  module subroutine prescribe_motion(self, status)
    class(mechanics_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    real(wp) :: direction(3), motion(3)
    integer :: i, j, k, later, n

    later = 0
    n = self%mesh%dimension
    call self%constraints%reset(n, self%mesh%n_node)
    if (self%settings%kind == AXISYMMETRIC) then
      ! The axis stays the axis
      direction = [1.0_wp, 0.0_wp, 0.0_wp]
      do j = 1, self%mesh%n_node
        if (abs(self%mesh%coordinates(1, j)) > 1.0e-12_wp * self%cell_size) cycle
        call self%constraints%add(j, direction(:n), 0.0_wp)
      end do
    end if
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i), boundary => self%boundaries(i)%boundary)
        select case (boundary%kind)
        case (BOUNDARY_SYMMETRY)
          do j = 1, size(place%node)
            call self%constraints%add(place%node(j), place%normal(:n), 0.0_wp)
          end do
        case (BOUNDARY_MOTION)
          motion = boundary%displacement_at(self%time_new) - boundary%displacement_at(self%time)
          do k = 1, n
            if (.not. boundary%prescribed(k)) cycle
            direction = 0.0_wp
            direction(k) = 1.0_wp
            do j = 1, size(place%node)
              call self%constraints%add(place%node(j), direction(:n), motion(k))
            end do
          end do
        case default
          ! A load
        end select
      end associate
      if (later == 0 .and. self%constraints%contradiction > 0) later = i
    end do
    call self%constraints%complete()
    if (self%constraints%contradiction > 0) then
      call status%raise(STATUS_ERROR, 'prescribe_motion', contradiction_text(self, later))
    end if

  end subroutine prescribe_motion

  !> Which boundaries contradict each other, and where.
  function contradiction_text(self, later) result(message)
    class(mechanics_t), intent(in) :: self
    !> The boundary that contradicts those before it.
    integer, intent(in) :: later
    character(len=:), allocatable :: message

    character(len=:), allocatable :: others
    integer :: i

    others = ''
    associate (node => self%constraints%contradiction)
      do i = 1, later - 1
        associate (place => self%boundaries(i))
          if (place%boundary%kind /= BOUNDARY_MOTION .and. &
              place%boundary%kind /= BOUNDARY_SYMMETRY) cycle
          if (all(place%node /= node)) cycle
          if (others /= '') others = others//' and'
          others = others//' &boundary '''//place%boundary%name//''''
        end associate
      end do
      if (others == '') others = ' the axis of revolution'
      message = self%boundaries(later)%title//': until time '//text(self%time_new)//' node '// &
        text(int(self%mesh%node_tag(node)))//near(self%mesh%coordinates(:, node))// &
        ' shall move otherwise than by'//others//': let them agree there, or leave one of the '// &
        '`components` out'
    end associate

  end function contradiction_text

  !> Tractions and pressures of the boundaries.
  module subroutine apply_loads(self, moved)
    class(mechanics_t), intent(inout) :: self
    !> Positions at the end of the step.
    real(wp), intent(in) :: moved(:, :)

    real(wp) :: factor
    integer :: i, k, n, node

    n = self%mesh%dimension
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i), boundary => self%boundaries(i)%boundary)
        self%load_force(:, i) = 0.0_wp
        select case (boundary%kind)
        case (BOUNDARY_TRACTION)
          factor = boundary%factor_at(self%time_new)
          do k = 1, size(place%node)
            node = place%node(k)
            self%residual(:n, node) = self%residual(:n, node) &
              - factor * boundary%value(:n) * place%area(node)
            self%load_force(:, i) = self%load_force(:, i) &
              + factor * boundary%value * place%area(node)
          end do
        case (BOUNDARY_PRESSURE)
          factor = boundary%factor_at(self%time_new) * boundary%pressure
          do k = 1, size(place%facet)
            if (self%settings%fixed_geometry) then
              call press_facet(self, self%mesh%coordinates, place%facet(k), factor, i)
            else
              call press_facet(self, moved, place%facet(k), factor, i)
            end if
          end do
        case default
          ! A motion
        end select
      end associate
    end do

  end subroutine apply_loads

  !> Force of a uniform pressure on a facet, and its derivative by the positions.
  subroutine press_facet(self, x, facet, pressure, boundary)
    class(mechanics_t), intent(inout) :: self
    !> Positions [length]; shape (n_dim, n_node).
    real(wp), intent(in) :: x(:, :)
    integer, intent(in) :: facet
    real(wp), intent(in) :: pressure
    !> Place of the boundary, for the sum of its forces.
    integer, intent(in) :: boundary

    real(wp) :: change(3), force(3), moved(self%mesh%dimension, self%mesh%dimension), normal(3), &
      weight(self%mesh%dimension), weight_change(self%mesh%dimension)
    integer :: a, b, j, n
    integer(gp) :: k

    n = self%mesh%dimension
    associate (node => self%mesh%facet_node(:, facet), cell => self%mesh%facet_cell(facet))
      call facet_normal(x(:, node), normal)
      weight = share(x(:, node))
      do a = 1, n
        force = -pressure * weight(a) * normal
        self%residual(:n, node(a)) = self%residual(:n, node(a)) - force(:n)
        self%load_force(:, boundary) = self%load_force(:, boundary) + force
      end do
      if (self%settings%fixed_geometry) return

      ! Normal and weights are polynomials of the positions: differences are exact derivatives
      do b = 1, n
        do j = 1, n
          moved = x(:, node)
          moved(j, b) = moved(j, b) + 0.5_wp * self%cell_size
          call facet_normal(moved, change)
          weight_change = share(moved)
          moved(j, b) = moved(j, b) - self%cell_size
          call facet_normal(moved, force)
          change = (change - force) / self%cell_size
          weight_change = (weight_change - share(moved)) / self%cell_size
          do a = 1, n
            k = self%matrix%cell_block(findloc(self%mesh%cell_node(:, cell), node(a), dim=1), &
                                       findloc(self%mesh%cell_node(:, cell), node(b), dim=1), cell)
            self%matrix%values(:n, j, k) = self%matrix%values(:n, j, k) &
              + pressure * (weight(a) * change(:n) + weight_change(a) * normal(:n))
          end do
        end do
      end do
    end associate

  contains

    !> Part of the facet's vector that each node gets; with the turn in axial symmetry.
    pure function share(corner) result(part)
      real(wp), intent(in) :: corner(:, :)
      real(wp) :: part(size(corner, 2))

      part = 1.0_wp / n
      if (self%settings%kind == AXISYMMETRIC) then
        part = TWO_PI / 6.0_wp * (corner(1, :) + sum(corner(1, :)))
      end if

    end function share

  end subroutine press_facet

  !> Collective. Forces of the step, and the work since the last one by the trapezoidal rule.
  module subroutine collect_work(self)
    class(mechanics_t), intent(inout) :: self

    real(wp), allocatable :: load_force(:, :), reaction(:, :), tool_force(:, :)
    real(wp) :: friction, motion(3), work
    integer :: i, j, n, node

    n = self%mesh%dimension
    allocate (tool_force(6, size(self%tools)), reaction(3, size(self%boundaries)), source=0.0_wp)
    friction = 0.0_wp
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        tool_force(1:3, contact%tool) = tool_force(1:3, contact%tool) + contact%force
        tool_force(4:6, contact%tool) = tool_force(4:6, contact%tool) + contact%torque
        friction = friction + contact%dissipation
      end associate
    end do
    work = 0.0_wp
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i))
        do j = 1, size(place%node)
          node = place%node(j)
          if (node > self%mesh%n_own_node) cycle
          if (any(place%boundary%kind == [BOUNDARY_MOTION, BOUNDARY_SYMMETRY])) then
            reaction(:n, i) = reaction(:n, i) + self%residual(:n, node)
          end if
        end do
      end associate
    end do
    ! Around the axis the radial forces on a tool and its torques cancel
    if (self%settings%kind == AXISYMMETRIC) tool_force([1, 4, 5, 6], :) = 0.0_wp
    allocate (load_force, source=self%load_force)
    do i = 1, size(self%tools)
      call self%comm%sum(tool_force(:, i))
    end do
    do i = 1, size(self%boundaries)
      call self%comm%sum(reaction(:, i))
      call self%comm%sum(load_force(:, i))
    end do
    call self%comm%sum(friction)

    ! Tools: force on the body times translation, torque times turn
    do i = 1, size(self%tools)
      call work_of_tool(self%tools(i), self%time, &
                        0.5_wp * (tool_force(:, i) + self%tool_force(:, i)), work)
    end do
    do i = 1, size(self%boundaries)
      associate (boundary => self%boundaries(i)%boundary)
        if (boundary%kind /= BOUNDARY_MOTION) cycle
        motion = boundary%displacement_at(self%time_new) - boundary%displacement_at(self%time)
        work = work + 0.5_wp * dot_product(reaction(:, i) + self%reaction(:, i), motion)
      end associate
    end do
    self%external_work = self%external_work + work + work_of_loads(self)
    self%friction_work = self%friction_work + friction
    work = sum(self%plastic_work)
    call self%comm%sum(work)
    self%total_plastic_work = self%total_plastic_work + work
    self%tool_force = tool_force
    self%reaction = reaction
    self%load_force = load_force

  end subroutine collect_work

  !> Work that a tool does on the body during a step.
  subroutine work_of_tool(tool, time_old, force, work)
    type(rigid_tool_t), intent(in) :: tool
    real(wp), intent(in) :: time_old
    !> Mean force on the tool and torque about its reference point.
    real(wp), intent(in) :: force(6)
    real(wp), intent(inout) :: work

    type(rigid_tool_t) :: before

    before = tool
    call before%begin_step(time_old, time_old)
    work = work - dot_product(force(1:3), tool%reference_point - before%reference_point) &
      - dot_product(force(4:6), tool%motion%get_axis()) * (tool%angle - before%angle)

  end subroutine work_of_tool

  !> Collective. Work of tractions and pressures during the step, with the forces of its end: exact
  !> for a load that is constant, of first order in the step otherwise.
  function work_of_loads(self) result(work)
    class(mechanics_t), intent(in) :: self
    real(wp) :: work

    real(wp) :: factor, normal(3)
    integer :: a, i, j, k, n, node

    work = 0.0_wp
    n = self%mesh%dimension
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i), boundary => self%boundaries(i)%boundary)
        factor = 0.5_wp * (boundary%factor_at(self%time) + boundary%factor_at(self%time_new))
        select case (boundary%kind)
        case (BOUNDARY_TRACTION)
          do j = 1, size(place%node)
            node = place%node(j)
            work = work + factor * place%area(node) &
              * dot_product(boundary%value(:n), self%increment(:, node))
          end do
        case (BOUNDARY_PRESSURE)
          do j = 1, size(place%facet)
            k = place%facet(j)
            associate (corner => self%mesh%facet_node(:, k))
              call facet_normal(self%mesh%coordinates(:, corner) &
                                + 0.5_wp * self%increment(:, corner), normal)
              do a = 1, n
                if (self%settings%kind == AXISYMMETRIC) then
                  work = work - factor * boundary%pressure * TWO_PI / 6.0_wp &
                    * (self%mesh%coordinates(1, corner(a)) &
                       + sum(self%mesh%coordinates(1, corner))) &
                    * dot_product(normal(:n), self%increment(:, corner(a)))
                else
                  work = work - factor * boundary%pressure / n &
                    * dot_product(normal(:n), self%increment(:, corner(a)))
                end if
              end do
            end associate
          end do
        case default
          ! A motion, whose work is that of its reaction
        end select
      end associate
    end do
    call self%comm%sum(work)

  end function work_of_loads

end submodule swage_mechanics_loads
