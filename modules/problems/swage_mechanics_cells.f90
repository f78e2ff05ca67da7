!> What [[swage_mechanics]] does with its cells: gather a batch, call its law, scatter residual and
!> tangent.
submodule(swage_mechanics) swage_mechanics_cells
  use swage_mini_element, only: mini_batch_create
  use swage_point_batch, only: point_batch_create
  use swage_state_table, only: rotate_state
  implicit none(type, external)

  !> Smallest θ of the bubble: perfect plasticity would make its compliance infinite.
  real(wp), parameter :: MINIMUM_RELAXATION = 1.0e-3_wp
  !> Newton iterations of the first step during which the bubble of a fluid follows its viscosity.
  integer, parameter :: FREE_ITERATIONS = 4

  !> How the grad-div modulus grows with the square of ln(V/V0) [1]: cells that have nearly lost
  !> their volume, as those at the edge of a sticking tool, resist before they invert.
  real(wp), parameter :: STIFFENING = 3.0_wp

contains

  module subroutine build_batches(self, n_state)
    type(mechanics_t), intent(inout) :: self
    integer, intent(in) :: n_state

    integer :: cell, first, i, last, place

    ! Cells keep the order of the mesh: that of the arrays they are gathered from
    allocate (self%cell_order(self%mesh%n_cell), self%batches(count_batches(self)))
    place = 0
    last = 0
    do i = 1, size(self%materials)
      first = last + 1
      do cell = 1, self%mesh%n_cell
        if (self%material_of_cell(cell) /= i) cycle
        last = last + 1
        self%cell_order(last) = cell
      end do
      do while (first <= last)
        place = place + 1
        self%batches(place) = cell_range_t(first, min(first + LANES - 1, last), i)
        first = self%batches(place)%last + 1
      end do
    end do
    allocate (self%element)
    call mini_batch_create(self%settings%kind, self%settings%fixed_geometry, self%element)
    self%element%bubble_factor = self%settings%bubble_factor
    call point_batch_create(LANES, n_state, self%points)

  end subroutine build_batches

  !> Batches that the cells of this rank need, of one material each.
  pure function count_batches(self) result(n_batch)
    type(mechanics_t), intent(in) :: self
    integer :: n_batch

    integer :: i

    n_batch = 0
    do i = 1, size(self%materials)
      n_batch = n_batch + (count(self%material_of_cell == i) + LANES - 1) / LANES
    end do

  end function count_batches

  module subroutine mechanics_gather(self, range)
    class(mechanics_t), intent(inout) :: self
    type(cell_range_t), intent(in) :: range

    integer :: i, n
    real(wp) :: lost, share

    associate (element => self%element, points => self%points, &
               law => self%materials(range%material)%law)
      n = range%last - range%first + 1
      element%n_cell = n
      element%inverse_bulk_modulus = law%inverse_bulk_modulus
      call points%start(n)
      points%dt = self%time_new - self%time
      points%time = self%time_new
      ! The viscosity of a fluid is given as 2η/dt of the last step
      share = 1.0_wp
      if (law%fluid .and. self%dt_last > 0.0_wp) share = self%dt_last / points%dt
      associate (cells => self%cell_order(range%first:range%last))
        call gather_nodes(element%n_dim, self%mesh%n_node, self%mesh%n_cell, n, cells, &
                          self%mesh%cell_node, self%mesh%coordinates, self%increment, &
                          self%temperature, element, points)
        associate (n_node => self%unknowns%n_node, n_cell => self%mesh%n_cell)
          if (allocated(self%unknowns%cell_pressure)) then
            call gather_pressures(element%n_vertex, n_node, n_cell, n, cells, &
                                  self%unknowns%cell_pressure, self%pressure, self%pressure_new, &
                                  element)
          else
            call gather_pressures(element%n_vertex, n_node, n_cell, n, cells, &
                                  self%mesh%cell_node, self%pressure, self%pressure_new, element)
          end if
        end associate
        do i = 1, n
          element%deviator_old(i, :) = self%deviator(:, cells(i))
          element%log_volume_old(i) = self%log_volume(cells(i))
          element%bubble_modulus(i) = share * self%bubble_modulus(cells(i))
          element%relaxation(i) = self%relaxation(cells(i))
          lost = self%log_volume(cells(i)) &
            + law%inverse_bulk_modulus * sum(element%pressure_old(i, :)) / element%n_vertex
          element%grad_div_modulus(i) = self%settings%grad_div * self%flow_stress(cells(i)) &
            * (1.0_wp + STIFFENING * lost**2)
          points%cell(i) = self%mesh%cell_tag(cells(i))
          points%state_old(i, :law%n_state) = self%state(:law%n_state, cells(i))
        end do
      end associate
      call element%start(points)
      if (element%inverted == 0 .and. .not. self%settings%fixed_geometry) then
        call rotate_state(law%state_table, points%rotation_increment, points%state_old)
      end if
    end associate

  end subroutine mechanics_gather

  !> Values at the vertices of cells.
  pure subroutine gather_nodes(n_dim, n_node, n_cell, n, cells, cell_node, coordinates, increment, &
                               temperature, element, points)
    integer, intent(in) :: n_dim, n_node, n_cell
    integer, intent(in) :: n
    integer, intent(in) :: cells(n)
    integer, intent(in) :: cell_node(n_dim + 1, n_cell)
    real(wp), intent(in) :: coordinates(n_dim, n_node), increment(n_dim, n_node)
    real(wp), intent(in) :: temperature(n_node)
    type(mini_batch_t), intent(inout) :: element
    type(point_batch_t), intent(inout) :: points

    real(wp) :: mean
    integer :: a, i, node

    do i = 1, n
      mean = 0.0_wp
      do a = 1, n_dim + 1
        node = cell_node(a, cells(i))
        element%coordinates(i, 1, a) = coordinates(1, node)
        element%coordinates(i, 2, a) = coordinates(2, node)
        element%displacement(i, 1, a) = increment(1, node)
        element%displacement(i, 2, a) = increment(2, node)
        if (n_dim == 3) then
          element%coordinates(i, 3, a) = coordinates(3, node)
          element%displacement(i, 3, a) = increment(3, node)
        end if
        mean = mean + temperature(node)
      end do
      mean = mean / (n_dim + 1)
      points%temperature_old(i) = mean
      points%temperature_new(i) = mean
    end do

  end subroutine gather_nodes

  !> Pressures at the vertices of cells.
  pure subroutine gather_pressures(n_vertex, n_node, n_cell, n, cells, cell_pressure, pressure, &
                                   pressure_new, element)
    integer, intent(in) :: n_vertex
    !> Unknown nodes.
    integer, intent(in) :: n_node
    integer, intent(in) :: n_cell
    integer, intent(in) :: n
    integer, intent(in) :: cells(n)
    integer, intent(in) :: cell_pressure(n_vertex, n_cell)
    real(wp), intent(in) :: pressure(n_node), pressure_new(n_node)
    type(mini_batch_t), intent(inout) :: element

    integer :: a, i, node

    do i = 1, n
      do a = 1, n_vertex
        node = cell_pressure(a, cells(i))
        element%pressure_old(i, a) = pressure(node)
        element%pressure_new(i, a) = pressure_new(node)
      end do
    end do

  end subroutine gather_pressures

  module subroutine evaluate_batch(self, range, size_of_step, status)
    class(mechanics_t), intent(inout) :: self
    type(cell_range_t), intent(in) :: range
    type(step_size_t), intent(inout) :: size_of_step
    type(status_t), intent(inout) :: status

    integer :: n_failed

    associate (element => self%element, points => self%points, &
               law => self%materials(range%material)%law, &
               cells => self%cell_order(range%first:range%last))
      ! Nothing is known about the viscosity of a fluid before it has moved
      if (law%initial_relaxation <= 0.0_wp .and. .not. self%dt_last > 0.0_wp &
          .and. self%n_evaluation > 1 .and. self%n_evaluation <= FREE_ITERATIONS) then
        self%bubble_modulus(cells) = self%bubble_modulus_new(cells)
      end if
      call self%gather(range)
      if (element%inverted > 0) then
        call status%raise(STATUS_RETRY, 'evaluate_batch', &
                          place_of(self, cells(element%inverted))//' is inverted', &
                          EXIT_CONVERGENCE)
        return
      end if
      call law%update(points, n_failed)
      if (n_failed > 0) then
        call status%raise(STATUS_RETRY, 'evaluate_batch', 'law '//trim(law%label)// &
                          ' of material '//self%materials(range%material)%name//' fails in '// &
                          place_of(self, cells(points%first_failed))//': '// &
                          trim(points%failure)//others(n_failed - 1), EXIT_CONVERGENCE)
        return
      end if
      call element%finish(points, with_tangent=.true.)
      self%recommended_step = min(self%recommended_step, points%suggested_time_step)

      call self%matrix%add_cells(cells, element%tangent)
      associate (unknowns => self%unknowns, n_cell => self%mesh%n_cell)
        if (allocated(unknowns%cell_pressure)) then
          call scatter_split(element%n_dim, unknowns%n_node, n_cell, size(cells), cells, &
                             unknowns%cell_node, unknowns%cell_pressure, element%residual, &
                             self%residual)
        else
          call scatter_forces(element%n_dim, unknowns%n_node, n_cell, size(cells), cells, &
                              self%mesh%cell_node, element%residual, self%residual)
        end if
      end associate
      call keep_results(self, law, cells)
      call measure_batch(element, points, size_of_step)
    end associate

  end subroutine evaluate_batch

  !> A cell, for messages.
  function place_of(self, cell) result(place)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: cell
    character(len=:), allocatable :: place

    real(wp) :: centre(self%mesh%dimension)
    integer :: a

    centre = 0.0_wp
    do a = 1, size(self%mesh%cell_node, 1)
      centre = centre + self%mesh%coordinates(:, self%mesh%cell_node(a, cell))
    end do
    place = 'cell '//text(int(self%mesh%cell_tag(cell)))//' of body '// &
      self%bodies(self%body_of_cell(cell))%name// &
      near(centre / size(self%mesh%cell_node, 1))

  end function place_of

  !> How many points fail besides the first.
  pure function others(n) result(words)
    integer, intent(in) :: n
    character(len=:), allocatable :: words

    words = ''
    if (n == 1) words = ', and in one more cell beside it'
    if (n > 1) words = ', and in '//text(n)//' more cells beside it'

  end function others

  !> Add the residual of each cell to its nodes.
  pure subroutine scatter_forces(n_dim, n_node, n_cell, n, cells, cell_node, cell_residual, &
                                 residual)
    integer, intent(in) :: n_dim, n_node, n_cell
    integer, intent(in) :: n
    integer, intent(in) :: cells(n)
    integer, intent(in) :: cell_node(n_dim + 1, n_cell)
    real(wp), intent(in) :: cell_residual(LANES, 4, 4)
    real(wp), intent(inout) :: residual(n_dim + 1, n_node)

    integer :: a, i, node

    do i = 1, n
      do a = 1, n_dim + 1
        node = cell_node(a, cells(i))
        residual(1, node) = residual(1, node) + cell_residual(i, 1, a)
        residual(2, node) = residual(2, node) + cell_residual(i, 2, a)
        residual(3, node) = residual(3, node) + cell_residual(i, 3, a)
        if (n_dim == 3) residual(4, node) = residual(4, node) + cell_residual(i, 4, a)
      end do
    end do

  end subroutine scatter_forces

  !> The same where forces and volume equations may belong to different unknown nodes.
  pure subroutine scatter_split(n_dim, n_node, n_cell, n, cells, cell_node, cell_pressure, &
                                cell_residual, residual)
    integer, intent(in) :: n_dim, n_node, n_cell
    integer, intent(in) :: n
    integer, intent(in) :: cells(n)
    integer, intent(in) :: cell_node(n_dim + 1, n_cell), cell_pressure(n_dim + 1, n_cell)
    real(wp), intent(in) :: cell_residual(LANES, 4, 4)
    real(wp), intent(inout) :: residual(n_dim + 1, n_node)

    integer :: a, i, node

    do i = 1, n
      do a = 1, n_dim + 1
        node = cell_node(a, cells(i))
        residual(1, node) = residual(1, node) + cell_residual(i, 1, a)
        residual(2, node) = residual(2, node) + cell_residual(i, 2, a)
        if (n_dim == 3) residual(3, node) = residual(3, node) + cell_residual(i, 3, a)
        node = cell_pressure(a, cells(i))
        residual(n_dim + 1, node) = residual(n_dim + 1, node) + cell_residual(i, n_dim + 1, a)
      end do
    end do

  end subroutine scatter_split

  !> What belongs to the end of the step.
  pure subroutine keep_results(self, law, cells)
    class(mechanics_t), intent(inout) :: self
    class(material_law_t), intent(in) :: law
    integer, intent(in) :: cells(:)

    integer :: cell, i

    associate (element => self%element, points => self%points)
      do i = 1, size(cells)
        cell = cells(i)
        self%deviator_new(:, cell) = points%deviatoric_stress(i, :)
        self%log_volume_new(cell) = element%log_volume_new(i)
        self%volume_new(cell) = element%volume_new(i)
        self%mean_stress(cell) = element%mean_stress(i)
        self%state_new(:law%n_state, cell) = points%state_new(i, :law%n_state)
        self%bubble_modulus_new(cell) = max(points%bubble_modulus(i), &
                                            MINIMUM_RELAXATION * points%memory_modulus(i))
        self%relaxation_new(cell) = points%relaxation_factor(i)
        if (law%initial_relaxation > 0.0_wp) then
          self%relaxation_new(cell) = max(self%relaxation_new(cell), MINIMUM_RELAXATION)
        end if
        self%flow_stress_new(cell) = points%flow_stress(i)
      end do
    end associate

  end subroutine keep_results

  !> Sizes of forces, strains and works.
  pure subroutine measure_batch(element, points, size_of_step)
    type(mini_batch_t), intent(in) :: element
    type(point_batch_t), intent(in) :: points
    type(step_size_t), intent(inout) :: size_of_step

    real(wp) :: force(LANES), strain(LANES), work(LANES)
    integer :: i

    ! In 2D the fourth vertex has neither force nor displacement
    associate (r => element%residual, u => element%displacement, e => points%strain_increment)
      do i = 1, LANES
        force(i) = r(i, 1, 1)**2 + r(i, 2, 1)**2 + r(i, 1, 2)**2 + r(i, 2, 2)**2 &
          + r(i, 1, 3)**2 + r(i, 2, 3)**2 + r(i, 1, 4)**2 + r(i, 2, 4)**2
        work(i) = r(i, 1, 1) * u(i, 1, 1) + r(i, 2, 1) * u(i, 2, 1) &
          + r(i, 1, 2) * u(i, 1, 2) + r(i, 2, 2) * u(i, 2, 2) &
          + r(i, 1, 3) * u(i, 1, 3) + r(i, 2, 3) * u(i, 2, 3) &
          + r(i, 1, 4) * u(i, 1, 4) + r(i, 2, 4) * u(i, 2, 4)
        strain(i) = element%volume_new(i) * sqrt(e(i, 1)**2 + e(i, 2)**2 + e(i, 3)**2 &
                                                 + e(i, 4)**2 + e(i, 5)**2 + e(i, 6)**2)
      end do
      if (element%n_dim == 3) then
        do i = 1, LANES
          force(i) = force(i) + r(i, 3, 1)**2 + r(i, 3, 2)**2 + r(i, 3, 3)**2 + r(i, 3, 4)**2
          work(i) = work(i) + r(i, 3, 1) * u(i, 3, 1) + r(i, 3, 2) * u(i, 3, 2) &
            + r(i, 3, 3) * u(i, 3, 3) + r(i, 3, 4) * u(i, 3, 4)
        end do
      end if
    end associate
    ! Room without a cell does not count
    do i = element%n_cell + 1, LANES
      force(i) = 0.0_wp
      strain(i) = 0.0_wp
      work(i) = 0.0_wp
    end do
    size_of_step%force = size_of_step%force + force
    size_of_step%strained_volume = size_of_step%strained_volume + strain
    size_of_step%work = size_of_step%work + abs(work)

  end subroutine measure_batch

end submodule swage_mechanics_cells
