!> Works and energies of [[swage_mechanics]], and the forces that do them.
!>
!> Everything is a trapezoid: the mean of the forces at both ends of the step times the motion
!> between them. Equilibrium at both ends makes the work of the nodal forces that of the stresses,
!> and the volume equation, tested with the mean pressure, makes the work of the pressure elastic
!> energy and work of the bubbles. What remains is of third order in the step, even where the
!> stress rises from zero to the flow stress within it.
submodule(swage_mechanics) swage_mechanics_energy
  use swage_boundary, only: BOUNDARY_MOTION, BOUNDARY_PRESSURE, BOUNDARY_SYMMETRY, &
                            BOUNDARY_TRACTION
  use swage_mandel, only: deviator, matrix_from_mandel, rotated, SQRT2
  use swage_tool_contact, only: contact_work_t, facet_normal
  implicit none(type, external)

  !> A cell flows when its plastic strain increment is more than this share of the whole.
  real(wp), parameter :: FLOWS = 1.0e-6_wp

contains

  module subroutine collect_work(self)
    class(mechanics_t), intent(inout) :: self

    type(energy_balance_t) :: step
    real(wp), allocatable :: support(:, :)
    real(wp), allocatable :: load_force(:, :), reaction(:, :), tool_force(:, :)
    real(wp) :: sums(6)
    integer :: i

    call collect_forces(self, tool_force, reaction, load_force)
    allocate (support, source=self%residual(:self%mesh%dimension, :))
    call self%constraints%remove_from(support)
    support = self%residual(:self%mesh%dimension, :) - support

    call add_cells(self, step)
    call add_contacts(self, step)
    call add_loads(self, step%external)
    do i = 1, self%mesh%n_own_node
      step%external = step%external &
        + 0.5_wp * dot_product(self%support_force(:, i) + support(:, i), self%increment(:, i))
    end do
    sums = [step%external, step%elastic, step%plastic, step%friction, step%contact, &
            step%stabilisation]
    call self%comm%sum(sums)
    step%external = sums(1)
    step%elastic = sums(2)
    step%plastic = sums(3)
    step%friction = sums(4)
    step%contact = sums(5)
    step%stabilisation = sums(6)
    do i = 1, size(self%tools)
      call add_tool(self%tools(i), self%time, 0.5_wp * (tool_force(:, i) + self%tool_force(:, i)), &
                    step%external)
    end do

    call self%energies%add(step)
    self%support_force = support(:, self%unknowns%of_node)
    if (size(self%pairs) > 0) self%contact_force = self%contact_force_new
    call move_alloc(tool_force, self%tool_force)
    call move_alloc(reaction, self%reaction)
    call move_alloc(load_force, self%load_force)

  end subroutine collect_work

  !> Collective. Forces and torques on the tools, forces of supports and loads on the bodies.
  subroutine collect_forces(self, tool_force, reaction, load_force)
    class(mechanics_t), intent(in) :: self
    !> Shape (6, n_tool).
    real(wp), allocatable, intent(out) :: tool_force(:, :)
    !> Shape (3, n_boundary).
    real(wp), allocatable, intent(out) :: reaction(:, :), load_force(:, :)

    integer :: i, j, n

    n = self%mesh%dimension
    allocate (tool_force(6, size(self%tools)), reaction(3, size(self%boundaries)), source=0.0_wp)
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        tool_force(1:3, contact%tool) = tool_force(1:3, contact%tool) + contact%force
        tool_force(4:6, contact%tool) = tool_force(4:6, contact%tool) + contact%torque
      end associate
    end do
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i))
        if (all(place%boundary%kind /= [BOUNDARY_MOTION, BOUNDARY_SYMMETRY])) cycle
        do j = 1, size(place%node)
          if (place%node(j) > self%mesh%n_own_node) cycle
          reaction(:n, i) = reaction(:n, i) + self%residual(:n, place%node(j))
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

  end subroutine collect_forces

  !> Energies of the cells of this rank: the kinematics of the step once more, no law.
  subroutine add_cells(self, step)
    class(mechanics_t), intent(inout) :: self
    type(energy_balance_t), intent(inout) :: step

    real(wp) :: compliance
    integer :: batch, i

    do batch = 1, size(self%batches)
      call self%gather(self%batches(batch))
      associate (law => self%materials(self%batches(batch)%material)%law)
        compliance = 0.0_wp
        if (.not. law%fluid) compliance = 1.0_wp / law%reference_modulus
        do i = 1, self%element%n_cell
          call add_cell(self, i, self%cell_order(self%batches(batch)%first + i - 1), compliance, &
                        step)
        end do
      end associate
    end do

  end subroutine add_cells

  !> Energies of cell `i` of the batch.
  pure subroutine add_cell(self, i, cell, compliance, step)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: i
    integer, intent(in) :: cell
    !> 1/(2G) [1/stress], 0 for a fluid.
    real(wp), intent(in) :: compliance
    type(energy_balance_t), intent(inout) :: step

    real(wp) :: back(3, 3), bubble_force(3), excess(2), mean(6), mean_volume, plastic(6), &
      pressure, strain(6), stress(6, 2), volume(2), volume_change
    integer :: a, v

    associate (element => self%element, points => self%points)
      v = element%n_vertex
      strain = points%strain_increment(i, :)
      volume = [element%volume_old(i), element%volume_new(i)]
      stress(:, 1) = points%stress_old(i, :)
      stress(:, 1) = deviator(stress(:, 1))
      stress(:, 2) = self%deviator_new(:, cell)

      plastic = deviator(strain) - compliance * (stress(:, 2) - stress(:, 1))
      ! While the logarithm of the volume and the deviator grow in proportion the latter works on a
      ! mean of the volumes
      mean_volume = volume(2)
      if (.not. element%fixed_geometry) then
        associate (log_volume => element%log_volume_new(i))
          mean_volume = mean_volume * exp(-log_volume) * 2.0_wp * relative_energy(-log_volume)
        end associate
      end if
      step%elastic = step%elastic &
        + 0.5_wp * mean_volume * compliance * dot_product(stress(:, 2), stress(:, 2)) &
        + compressed_energy(element%inverse_bulk_modulus, element%pressure_new(i, :v), volume(2), &
                            element%log_volume_new(i), element%fixed_geometry)

      ! What the grad-div term adds to the pressure
      excess = [self%mean_stress_old(cell) + sum(element%pressure_old(i, :v)) / v, &
                self%mean_stress(cell) + sum(element%pressure_new(i, :v)) / v]
      volume_change = volume(2) - volume(1)
      if (element%fixed_geometry) then
        volume_change = volume(1) * (element%log_volume_new(i) - element%log_volume_old(i))
      end if
      step%stabilisation = step%stabilisation + 0.5_wp * sum(excess) * volume_change

      ! The force on the bubble that stress and pressure leave
      bubble_force = 0.0_wp
      do a = 1, v
        pressure = 0.5_wp * (element%pressure_old(i, a) + element%pressure_new(i, a))
        bubble_force = bubble_force + pressure * element%bubble_pressure(i, :, a)
      end do
      if (self%settings%kind == AXISYMMETRIC) then
        mean = 0.5_wp / volume(1) * matmul(stress, volume)
        bubble_force(1) = bubble_force(1) + element%bubble_moment(i) * (mean(3) - mean(1))
        bubble_force(2) = bubble_force(2) - element%bubble_moment(i) / SQRT2 * mean(6)
      end if
      step%stabilisation = step%stabilisation - dot_product(bubble_force, element%bubble(i, :))

      stress(1:3, 1) = stress(1:3, 1) + self%mean_stress_old(cell)
      stress(1:3, 2) = stress(1:3, 2) + self%mean_stress(cell)
      step%plastic = step%plastic + 0.5_wp * dot_product(plastic, matmul(stress, volume))
      if (.not. element%fixed_geometry .and. norm2(plastic) > FLOWS * norm2(strain)) then
        ! The strain of the middle is not what the forces of either end work on. Their difference
        ! is of second order and counts where the stress is not the same at both ends
        step%plastic = step%plastic &
          - 0.5_wp * dot_product(element%linear_strain(i, :), matmul(stress, volume))
        back = transpose(points%rotation_increment(i, :, :))
        stress(:, 1) = rotated(stress(:, 1), back)
        step%plastic = step%plastic + 0.5_wp &
          * (volume(1) * rate_of_work(stress(:, 1), element%displacement(i, :, :v), &
                                      element%gradient_old(i, :, :v), element%hoop_old(i)) &
             + volume(2) * rate_of_work(stress(:, 2), element%displacement(i, :, :v), &
                                        element%gradient_new(i, :, :v), element%hoop_new(i)))
      end if
    end associate

  end subroutine add_cell

  !> Stress times gradient of a displacement: the work of the nodal forces by the volume.
  pure function rate_of_work(stress, displacement, gradient, hoop) result(work)
    !> Mandel [stress].
    real(wp), intent(in) :: stress(6)
    !> Of the vertices [length]; shape (3, n_vertex).
    real(wp), intent(in) :: displacement(:, :)
    !> Of the vertex functions [1/length]; shape (3, n_vertex).
    real(wp), intent(in) :: gradient(:, :)
    !> [1/length]; see `mini_batch_t`.
    real(wp), intent(in) :: hoop
    real(wp) :: work

    real(wp) :: matrix(3, 3)
    integer :: a

    matrix = matrix_from_mandel(stress)
    work = hoop * matrix(3, 3) * sum(displacement(1, :))
    do a = 1, size(displacement, 2)
      work = work + dot_product(displacement(:, a), matmul(matrix, gradient(:, a)))
    end do

  end function rate_of_work

  !> Energy of the pressure in a cell, V0 exp(-p/κ) its law: of the pressures of the vertices by
  !> the mass matrix of the volume equation.
  pure function compressed_energy(inverse_bulk_modulus, pressure, volume, log_volume, &
                                  fixed_geometry) result(energy)
    !> [1/stress]
    real(wp), intent(in) :: inverse_bulk_modulus
    !> Of the vertices [stress].
    real(wp), intent(in) :: pressure(:)
    !> Present volume [length^3], and ln(V/V0).
    real(wp), intent(in) :: volume
    real(wp), intent(in) :: log_volume
    logical, intent(in) :: fixed_geometry
    real(wp) :: energy

    real(wp) :: root(size(pressure)), strain
    integer :: a, v

    energy = 0.0_wp
    if (.not. inverse_bulk_modulus > 0.0_wp) return
    v = size(pressure)
    ! Its square is twice the energy per volume: p²/κ, but for the change of the volume
    root = pressure * sqrt(inverse_bulk_modulus)
    if (.not. fixed_geometry) then
      do a = 1, v
        strain = inverse_bulk_modulus * pressure(a)
        root(a) = root(a) * sqrt(2.0_wp * relative_energy(strain))
      end do
    end if
    energy = 0.5_wp * (sum(root)**2 + sum(root**2)) / (v * (v + 1)) * volume
    if (.not. fixed_geometry) energy = energy * exp(-log_volume)

  end function compressed_energy

  !> (1 - (1 + x) exp(-x)) / x², whose numerator is the energy of the pressure xκ by κ V0.
  pure function relative_energy(x) result(energy)
    real(wp), intent(in) :: x
    real(wp) :: energy

    !> Below, the series is the more precise.
    real(wp), parameter :: SMALL = 1.0e-3_wp

    if (abs(x) < SMALL) then
      energy = 0.5_wp - x * (1.0_wp / 3.0_wp - x * (0.125_wp - x / 30.0_wp))
    else
      energy = (1.0_wp - (1.0_wp + x) * exp(-x)) / x**2
    end if

  end function relative_energy

  !> Energies of this rank's nodes in contact, and what the works of the tools count too much.
  subroutine add_contacts(self, step)
    class(mechanics_t), intent(in) :: self
    type(energy_balance_t), intent(inout) :: step

    type(contact_work_t) :: work
    real(wp), allocatable :: moved(:, :), start(:, :)
    integer :: i

    allocate (start, source=self%positions())
    allocate (moved, source=start + self%increment)
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        call contact%work(self%tools(contact%tool), start, moved, work)
      end associate
      step%contact = step%contact + work%stored
      step%friction = step%friction + work%friction
      step%stabilisation = step%stabilisation + work%inertia
      step%external = step%external - work%excess
    end do
    do i = 1, size(self%pairs)
      associate (pair => self%pairs(i))
        call pair%contact%work(pair%rows, self%surface_start, self%surface_moved, work)
      end associate
      step%contact = step%contact + work%stored
      step%friction = step%friction + work%friction
      step%stabilisation = step%stabilisation + work%inertia
      step%external = step%external - work%excess
    end do
    if (size(self%pairs) > 0) step%external = step%external + work_of_change(self)

  end subroutine add_contacts

  !> Pairs take the forces of the start of the step from conditions that are made anew there, with
  !> other shares of facets that gape: what the forces that were in balance do more, on own nodes.
  pure function work_of_change(self) result(work)
    class(mechanics_t), intent(in) :: self
    real(wp) :: work

    integer :: i

    work = 0.0_wp
    do i = 1, size(self%pairs)
      work = work - 0.5_wp * sum(self%pairs(i)%contact%nodal_load &
                                 * (self%surface_moved - self%surface_start))
    end do
    do i = 1, self%mesh%n_own_node
      work = work - 0.5_wp * dot_product(self%contact_force(:, i), self%increment(:, i))
    end do

  end function work_of_change

  !> Work of a tool on the bodies: force times translation, torque times turn.
  subroutine add_tool(tool, time_old, force, work)
    type(rigid_tool_t), intent(in) :: tool
    real(wp), intent(in) :: time_old
    !> Mean force on the tool and torque about its reference point.
    real(wp), intent(in) :: force(6)
    real(wp), intent(inout) :: work

    type(rigid_tool_t) :: before

    before = tool
    call before%begin_step(time_old, time_old)
    work = work - dot_product(force(1:3), tool%reference_point - before%reference_point) &
      - dot_product(force(4:6), tool%axis) * (tool%angle - before%angle)

  end subroutine add_tool

  !> Work of tractions and pressures on this rank's facets. They start from nothing, as the stress
  !> does: before the first step no load is carried.
  subroutine add_loads(self, work)
    class(mechanics_t), intent(in) :: self
    real(wp), intent(inout) :: work

    real(wp) :: factor(2)
    integer :: i, j, node

    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i), boundary => self%boundaries(i)%boundary)
        factor = [boundary%factor_at(self%time), boundary%factor_at(self%time_new)]
        if (.not. self%dt_last > 0.0_wp) factor(1) = 0.0_wp
        select case (boundary%kind)
        case (BOUNDARY_TRACTION)
          do j = 1, size(place%node)
            node = place%node(j)
            work = work + 0.5_wp * sum(factor) * place%area(node) &
              * dot_product(boundary%value(:self%mesh%dimension), self%increment(:, node))
          end do
        case (BOUNDARY_PRESSURE)
          do j = 1, size(place%facet)
            work = work + facet_work(self, place%facet(j), boundary%pressure * factor)
          end do
        case default
          ! A motion, whose work is that of the supports
        end select
      end associate
    end do

  end subroutine add_loads

  !> Work of a pressure on a facet that follows the surface.
  function facet_work(self, facet, pressure) result(work)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: facet
    !> At both ends of the step [stress].
    real(wp), intent(in) :: pressure(2)
    real(wp) :: work

    real(wp) :: normal(3), x(self%mesh%dimension, self%mesh%dimension)
    integer :: i, n

    n = self%mesh%dimension
    work = 0.0_wp
    associate (corner => self%mesh%facet_node(:, facet))
      do i = 1, 2
        x = self%mesh%coordinates(:, corner)
        if (i == 2 .and. .not. self%settings%fixed_geometry) x = x + self%increment(:, corner)
        call facet_normal(x, normal)
        work = work - 0.5_wp * pressure(i) &
          * dot_product(matmul(normal(:n), self%increment(:, corner)), facet_share(self, x))
      end do
    end associate

  end function facet_work

end submodule swage_mechanics_energy
