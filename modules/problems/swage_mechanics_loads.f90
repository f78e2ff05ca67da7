!> Boundary conditions of [[swage_mechanics]]: motion and loads.
submodule(swage_mechanics) swage_mechanics_loads
  use swage_boundary, only: BOUNDARY_MOTION, BOUNDARY_PRESSURE, BOUNDARY_SYMMETRY, &
                            BOUNDARY_TRACTION
  use swage_cell_geometry, only: AXISYMMETRIC
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
    call self%constraints%reset(n, self%unknowns%n_node)
    if (self%settings%kind == AXISYMMETRIC) then
      ! The axis stays the axis
      direction = [1.0_wp, 0.0_wp, 0.0_wp]
      do j = 1, self%mesh%n_node
        if (abs(self%mesh%coordinates(1, j)) > 1.0e-12_wp * self%cell_size) cycle
        call self%constraints%add(self%unknowns%of_node(j), direction(:n), 0.0_wp)
      end do
    end if
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i), boundary => self%boundaries(i)%boundary, &
                 of_node => self%unknowns%of_node)
        select case (boundary%kind)
        case (BOUNDARY_SYMMETRY)
          do j = 1, size(place%node)
            call self%constraints%add(of_node(place%node(j)), place%normal(:n), 0.0_wp)
          end do
        case (BOUNDARY_MOTION)
          motion = boundary%displacement_at(self%time_new) - boundary%displacement_at(self%time)
          do k = 1, n
            if (.not. boundary%prescribed(k)) cycle
            direction = 0.0_wp
            direction(k) = 1.0_wp
            do j = 1, size(place%node)
              call self%constraints%add(of_node(place%node(j)), direction(:n), motion(k))
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
    associate (node => self%unknowns%mesh_node(self%constraints%contradiction))
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
            associate (force => self%residual(:n, self%unknowns%of_node(node)))
              force = force - factor * boundary%value(:n) * place%area(node)
            end associate
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
      weight = facet_share(self, x(:, node))
      do a = 1, n
        force = -pressure * weight(a) * normal
        associate (rest => self%residual(:n, self%unknowns%of_node(node(a))))
          rest = rest - force(:n)
        end associate
        self%load_force(:, boundary) = self%load_force(:, boundary) + force
      end do
      if (self%settings%fixed_geometry) return

      ! Normal and weights are polynomials of the positions: differences are exact derivatives
      do b = 1, n
        do j = 1, n
          moved = x(:, node)
          moved(j, b) = moved(j, b) + 0.5_wp * self%cell_size
          call facet_normal(moved, change)
          weight_change = facet_share(self, moved)
          moved(j, b) = moved(j, b) - self%cell_size
          call facet_normal(moved, force)
          change = (change - force) / self%cell_size
          weight_change = (weight_change - facet_share(self, moved)) / self%cell_size
          do a = 1, n
            k = self%matrix%cell_block(findloc(self%mesh%cell_node(:, cell), node(a), dim=1), &
                                       findloc(self%mesh%cell_node(:, cell), node(b), dim=1), cell)
            self%matrix%values(:n, j, k) = self%matrix%values(:n, j, k) &
              + pressure * (weight(a) * change(:n) + weight_change(a) * normal(:n))
          end do
        end do
      end do
    end associate

  end subroutine press_facet

  pure module function facet_share(self, x) result(part)
    class(mechanics_t), intent(in) :: self
    real(wp), intent(in) :: x(:, :)
    real(wp) :: part(size(x, 2))

    part = 1.0_wp / size(x, 1)
    if (self%settings%kind == AXISYMMETRIC) part = TWO_PI / 6.0_wp * (x(1, :) + sum(x(1, :)))

  end function facet_share

end submodule swage_mechanics_loads
