!> Reading and building of [[swage_mechanics]].
submodule(swage_mechanics) swage_mechanics_setup
  use swage_block_matrix, only: block_matrix_create
  use swage_body_contact, only: body_contact_create
  use swage_body_keys, only: explain_interface, take_body
  use swage_boundary, only: boundary_from_group, BOUNDARY_MOTION, BOUNDARY_PRESSURE, &
                            BOUNDARY_SYMMETRY, BOUNDARY_TRACTION, explain_boundary
  use swage_contact_formulation, only: CHOICE_LENGTH, contact_choice_t
  use swage_contact_formulation_registry, only: contact_formulation_create, &
    contact_formulation_names
  use swage_contact_pair, only: contact_pair_create
  use swage_coupling_matrix, only: coupling_matrix_create
  use swage_facet_quadrature, only: has_facet_quadrature
  use swage_friction, only: friction_law_t
  use swage_friction_registry, only: friction_from_group
  use swage_group, only: group_t
  use swage_linear_solver_registry, only: linear_solver_create
  use swage_material_registry, only: material_from_group
  use swage_motion, only: motion_from_group, motion_t
  use swage_number, only: number_text
  use swage_rigid_tool, only: tool_from_group
  use swage_shared_surface, only: shared_surface_create
  use swage_status, only: EXIT_MESH, STATUS_ERROR
  use swage_tool_contact, only: AUGMENTED_LAGRANGIAN, enforcement_t, ENFORCEMENT_NAMES, &
    facet_normal, PENALTY, tool_contact_create
  use swage_tool_control, only: control_from_group, tool_control_t
  use swage_units, only: shown
  use swage_unknowns, only: unknowns_create
  implicit none(type, external)

  !> What `dimension` is called in the input, in the order of the kinds of the element.
  character(len=12), parameter :: DIMENSION_NAMES(3) = [character(len=12) :: &
    'plane_strain', 'axisymmetric', '3d']
  !> A tool may overlap the body by this share of the cell size before the first step.
  real(wp), parameter :: LARGEST_OVERLAP = 0.1_wp
  !> A symmetry plane is plane when its facets' normals agree to this.
  real(wp), parameter :: FLATNESS = 1.0e-6_wp
  !> Share of the fastest tool's speed below which friction fades.
  real(wp), parameter :: FADING = 0.01_wp
  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)

  !> What a group `&contact` says; the names in it are still to be looked up.
  type :: contact_keys_t
    character(len=64), allocatable :: slave(:)
    character(len=:), allocatable :: master
    character(len=:), allocatable :: friction
    !> Stiffness by that of a cell, and that of bonds by the former [1].
    real(wp) :: penalty = 10.0_wp
    real(wp) :: tangential = 1.0_wp
    !> Resistance of a rubbing node to a change of slip, by the flow stress on the cell size [1].
    real(wp) :: inertia = 5.0_wp
    type(enforcement_t) :: enforcement
    logical :: separation = .true.
    !> Between bodies.
    character(len=:), allocatable :: formulation
    type(contact_choice_t) :: choice
    logical :: smoothing = .true.
    !> [degrees]
    real(wp) :: feature_angle = 40.0_wp
    !> Whether distances at the start are adjusted, and up to which gap [length].
    logical :: adjusts = .false.
    real(wp) :: adjust = 0.0_wp
  end type contact_keys_t

contains

  module procedure mechanics_create

    integer :: n

    mechanics%comm = comm
    mechanics%settings = settings
    mechanics%units = units
    mechanics%notes = ''
    mechanics%worst = ''
    call move_mesh(mesh, mechanics%mesh)
    n = mechanics%mesh%dimension

    call read_bodies(mechanics, deck, status)
    call comm%agree(status)
    if (status%failed()) return
    call build_cells(mechanics)
    call read_boundaries(mechanics, deck, status)
    call comm%agree(status)
    if (status%failed()) return
    call read_tools(mechanics, deck, status)
    call comm%agree(status)
    if (status%failed()) return
    call read_contacts(mechanics, deck, status)
    call comm%agree(status)
    if (status%failed()) return
    call check_whole(mechanics, deck, status)
    if (status%failed()) return

    associate (m => mechanics, n_node => mechanics%mesh%n_node, &
               n_unknown => mechanics%unknowns%n_node)
      allocate (m%initial_coordinates, source=m%mesh%coordinates)
      allocate (m%increment(n, n_node), m%increment_last(n, n_node), &
                m%increment_before(n, n_node), m%displacement(n, n_node), &
                source=0.0_wp)
      allocate (m%pressure(n_unknown), m%pressure_new(n_unknown), m%pressure_last(n_unknown), &
                m%pressure_before(n_unknown), source=0.0_wp)
      allocate (m%temperature(n_node), source=settings%initial_temperature)
      allocate (m%support_force(n, n_node), source=0.0_wp)
      allocate (m%residual(n + 1, n_unknown), m%correction(n + 1, n_unknown), &
                m%base(n + 1, n_unknown), source=0.0_wp)
      allocate (m%tool_force(6, size(m%tools)), m%reaction(3, size(m%boundaries)), &
                m%load_force(3, size(m%boundaries)), source=0.0_wp)
    end associate

  end procedure mechanics_create

  module procedure mechanics_explain

    character(len=:), allocatable :: material, group_name
    type(contact_keys_t) :: keys

    select case (kind)
    case ('body')
      call take_body(group, material, group_name)
    case ('boundary')
      call explain_boundary(group)
    case ('interface')
      call explain_interface(group)
    case ('contact')
      call take_contact(group, keys)
    case default
      ! Another owner's group
    end select

  end procedure mechanics_explain

  module procedure create_solver

  ! Displacements are positive definite, pressures negative; an idle slot is an identity row
    call linear_solver_create(self%settings%linear_solver, self%comm, self%unknowns%halo, &
                              self%unknowns, self%matrix, int(self%unknowns%n_node_global), &
                              self%solver, status)

  end procedure create_solver

  !> Move the mesh; the old one is left empty.
  subroutine move_mesh(from, to)
    type(mesh_t), intent(inout) :: from
    type(mesh_t), intent(inout) :: to

    type(mesh_t) :: nothing

    to = from
    from = nothing

  end subroutine move_mesh

  !> Bodies, their materials, and which cell belongs to which.
  subroutine read_bodies(self, deck, status)
    type(mechanics_t), intent(inout) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: group_name, material
    integer, allocatable :: cells(:)
    type(group_t) :: group, material_group
    integer :: i, j

    allocate (self%materials(deck%count('material')))
    do i = 1, size(self%materials)
      call deck%get('material', i, material_group)
      self%materials(i)%name = material_group%name
      call material_from_group(material_group, deck, self%units, self%materials(i)%law, status)
      if (status%failed()) return
      call check_temperature(material_group, self%materials(i)%law, &
                             self%settings%initial_temperature, status)
      if (status%failed()) return
    end do
    if (deck%count('body') == 0) then
      call status%raise(STATUS_ERROR, 'read_bodies', deck%path//': there is no &body: name a '// &
                        'physical group of the mesh and its material')
      return
    end if

    allocate (self%bodies(deck%count('body')))
    allocate (self%body_of_cell(self%mesh%n_cell), self%material_of_cell(self%mesh%n_cell), &
              source=0)
    do i = 1, size(self%bodies)
      call deck%get('body', i, group)
      self%bodies(i)%name = group%name
      call take_body(group, material, group_name)
      self%bodies(i)%group = checked_group(self, group, 'group', group_name, self%mesh%dimension)
      call group%finish(status)
      if (status%failed()) return
      call deck%find('material', material, material_group, status, from=group, key='material')
      if (status%failed()) return
      do j = 1, size(self%materials)
        if (self%materials(j)%name == material) self%bodies(i)%material = j
      end do
      cells = self%mesh%group_cells(self%bodies(i)%group)
      do j = 1, size(cells)
        associate (body => self%body_of_cell(cells(j)))
          if (body > 0) then
            call status%raise(STATUS_ERROR, 'read_bodies', group%describe('group')//': cell '// &
                              text(int(self%mesh%cell_tag(cells(j))))// &
                              ' belongs to body '''//self%bodies(body)%name//''' too: give '// &
                              'each cell to one body')
            return
          end if
          body = i
        end associate
        self%material_of_cell(cells(j)) = self%bodies(i)%material
      end do
    end do
    i = findloc(self%body_of_cell, 0, dim=1)
    if (i > 0) then
      group_name = 'no physical group'
      j = self%mesh%cell_group(i)
      if (j > 0) group_name = 'physical group '//text(self%mesh%groups(j)%tag)//' '''// &
        trim(self%mesh%groups(j)%name)//''''
      call status%raise(STATUS_ERROR, 'read_bodies', deck%path//': cell '// &
                        text(int(self%mesh%cell_tag(i)))//' of the mesh, in '// &
                        group_name//', belongs to no body: add a &body for it')
    end if

  end subroutine read_bodies

  !> Refuse a run at a temperature for which a law is not known.
  subroutine check_temperature(group, law, temperature, status)
    !> The `&material`.
    type(group_t), intent(in) :: group
    class(material_law_t), intent(in) :: law
    !> Kelvin [temperature].
    real(wp), intent(in) :: temperature
    type(status_t), intent(inout) :: status

    ! What a sum of degrees Celsius and 273.15 rounds
    real(wp), parameter :: ROUNDING = 1.0e-6_wp

    if (temperature >= law%lowest_temperature - ROUNDING .and. &
        temperature <= law%highest_temperature + ROUNDING) return
    call status%raise(STATUS_ERROR, 'check_temperature', group%describe('flow_stress')// &
                      ': is known from '//celsius(law%lowest_temperature)//' to '// &
                      celsius(law%highest_temperature)//' degC, and &job temperature is '// &
                      celsius(temperature)//' degC')

  end subroutine check_temperature

  !> To a millionth: what kelvin have rounded.
  pure function celsius(temperature) result(string)
    !> Kelvin.
    real(wp), intent(in) :: temperature
    character(len=:), allocatable :: string

    string = number_text(1.0e-6_wp * anint(1.0e6_wp * shown(temperature, 'temperature')))

  end function celsius

  !> Place of a group that must exist and hold something; a fault goes to the input group.
  function checked_group(self, group, key, name, n_dim) result(place)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: key
    character(len=*), intent(in) :: name
    !> Dimension of the entities that are meant; any when negative.
    integer, intent(in) :: n_dim
    integer :: place

    place = 0
    if (name == '') return
    if (n_dim < 0) then
      place = self%mesh%find_group(name)
      if (place == 0) call group%refuse(key, self%mesh%explain_group(name))
    else
      place = self%mesh%find_group(name, n_dim)
      if (place == 0) call group%refuse(key, self%mesh%explain_group(name, n_dim))
    end if
    if (place == 0) return
    if (self%mesh%groups(place)%n_entity_global == 0_gp) then
      call group%refuse(key, 'the physical group is empty in the mesh: assign entities to it')
    end if

  end function checked_group

  !> States, batches, matrix: all that follows from mesh and materials.
  subroutine build_cells(self)
    type(mechanics_t), intent(inout) :: self

    real(wp) :: corners(self%mesh%dimension, self%mesh%dimension + 1)
    real(wp) :: size_of_cell(self%mesh%n_cell), sums(4)
    integer :: cell, i, n, n_state

    associate (mesh => self%mesh)
      n = mesh%n_cell
      n_state = 0
      do i = 1, size(self%materials)
        n_state = max(n_state, self%materials(i)%law%n_state)
      end do
      allocate (self%deviator(6, n), self%deviator_new(6, n), source=0.0_wp)
      allocate (self%state(n_state, n), self%state_new(n_state, n), source=0.0_wp)
      allocate (self%log_volume(n), self%log_volume_new(n), self%mean_stress(n), &
                self%mean_stress_old(n), self%bubble_modulus(n), &
                self%relaxation(n), self%flow_stress(n), self%volume_new(n), source=0.0_wp)
      do cell = 1, n
        associate (law => self%materials(self%material_of_cell(cell))%law)
          self%bubble_modulus(cell) = law%reference_modulus
          self%relaxation(cell) = law%initial_relaxation
          self%flow_stress(cell) = law%initial_flow_stress
          call set_initial_state(law, self%state(:, cell))
        end associate
        corners = mesh%coordinates(:, mesh%cell_node(:, cell))
        self%volume_new(cell) = cell_volume(self%settings%kind, corners)
      end do
      self%state_new = self%state
      allocate (self%initial_volume, source=self%volume_new)
      allocate (self%bubble_modulus_new, source=self%bubble_modulus)
      allocate (self%relaxation_new, source=self%relaxation)
      allocate (self%flow_stress_new, source=self%flow_stress)

      call build_batches(self, n_state)
      call unknowns_create(mesh, self%comm, self%material_of_cell, size(self%materials), &
                           self%unknowns)
      call block_matrix_create(self%unknowns, self%matrix)
      call self%matrix%expect(self%cell_order)
      size_of_cell = mesh%cell_size()
      sums = [sum(size_of_cell), real(n, wp), &
              sum((self%bubble_modulus * self%initial_volume / size_of_cell)**2), &
              sum(self%bubble_modulus * self%initial_volume)]
      call self%comm%sum(sums)
      self%cell_size = sums(1) / sums(2)
      self%least_force = LEAST_STRAIN * sqrt(sums(3))
      self%energies%least = LEAST_STRAIN**2 * sums(4)
    end associate

  end subroutine build_cells

  !> The history of a virgin point.
  pure subroutine set_initial_state(law, state)
    class(material_law_t), intent(in) :: law
    real(wp), intent(inout) :: state(:)

    integer :: i, row, width

    row = 1
    do i = 1, size(law%state_table)
      width = law%state_table(i)%width()
      state(row:row + width - 1) = law%state_table(i)%initial
      row = row + width
    end do

  end subroutine set_initial_state

  subroutine read_boundaries(self, deck, status)
    type(mechanics_t), intent(inout) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    integer, allocatable :: places(:)
    type(group_t) :: group
    integer :: i, j

    allocate (self%boundaries(deck%count('boundary')))
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i))
        call deck%get('boundary', i, group)
        call boundary_from_group(group, self%mesh%dimension, place%boundary)
        allocate (places(size(place%boundary%groups)))
        do j = 1, size(places)
          places(j) = checked_group(self, group, 'group', trim(place%boundary%groups(j)), -1)
        end do
        call group%finish(status)
        if (status%failed()) return

        place%title = group%describe('kind')
        call list_boundary(self, places, place%node, place%facet)
        select case (place%boundary%kind)
        case (BOUNDARY_SYMMETRY)
          call find_plane(self, place, group, status)
        case (BOUNDARY_TRACTION, BOUNDARY_PRESSURE)
          call need_facets(self, place, group, status)
        case default
          ! Any nodes will do
        end select
        if (status%failed()) return
        if (place%boundary%kind == BOUNDARY_TRACTION) call spread_traction(self, place)
        deallocate (places)
      end associate
    end do

  end subroutine read_boundaries

  !> Local nodes and facets of several groups, each once.
  subroutine list_boundary(self, places, node, facet)
    type(mechanics_t), intent(in) :: self
    integer, intent(in) :: places(:)
    integer, allocatable, intent(out) :: node(:)
    integer, allocatable, intent(out) :: facet(:)

    logical :: has_facet(self%mesh%n_facet), has_node(self%mesh%n_node)
    integer :: i

    has_node = .false.
    has_facet = .false.
    do i = 1, size(places)
      has_node(self%mesh%group_nodes(places(i))) = .true.
      has_facet(self%mesh%group_facets(places(i))) = .true.
    end do
    node = pack([(i, i=1, size(has_node))], has_node)
    facet = pack([(i, i=1, size(has_facet))], has_facet)

  end subroutine list_boundary

  !> Collective. A load needs a surface.
  subroutine need_facets(self, place, group, status)
    type(mechanics_t), intent(in) :: self
    type(boundary_place_t), intent(in) :: place
    type(group_t), intent(inout) :: group
    type(status_t), intent(inout) :: status

    integer(gp) :: n_facet

    n_facet = size(place%facet, kind=gp)
    call self%comm%sum(n_facet)
    if (n_facet == 0_gp) then
      call group%refuse('group', 'holds no facet of the bodies'' outer surface, which '// &
                        'this kind of boundary needs')
      call group%finish(status)
    end if

  end subroutine need_facets

  !> Collective. Normal of a symmetry plane.
  subroutine find_plane(self, place, group, status)
    type(mechanics_t), intent(in) :: self
    type(boundary_place_t), intent(inout) :: place
    type(group_t), intent(inout) :: group
    type(status_t), intent(inout) :: status

    real(wp) :: normal(3), sums(4)
    integer :: i

    call need_facets(self, place, group, status)
    if (status%failed()) return
    sums = 0.0_wp
    do i = 1, size(place%facet)
      call facet_normal(self%mesh%coordinates(:, self%mesh%facet_node(:, place%facet(i))), normal)
      sums = sums + [normal, norm2(normal)]
    end do
    call self%comm%sum(sums)
    if (norm2(sums(1:3)) < (1.0_wp - FLATNESS) * sums(4)) then
      call group%refuse('group', 'is not plane, as a symmetry must be: give each plane a '// &
                        '&boundary of its own')
      call group%finish(status)
      return
    end if
    normal = sums(1:3) / norm2(sums(1:3))
    ! A coordinate plane is meant exactly
    where (abs(normal) < FLATNESS) normal = 0.0_wp
    place%normal = normal / norm2(normal)

  end subroutine find_plane

  !> Nodal areas of a surface, of this rank's facets.
  subroutine spread_traction(self, place)
    type(mechanics_t), intent(in) :: self
    type(boundary_place_t), intent(inout) :: place

    real(wp) :: normal(3)
    integer :: i, n

    n = self%mesh%dimension
    allocate (place%area(self%mesh%n_node), source=0.0_wp)
    do i = 1, size(place%facet)
      associate (node => self%mesh%facet_node(:, place%facet(i)), x => self%mesh%coordinates)
        call facet_normal(x(:, node), normal)
        if (self%settings%kind == AXISYMMETRIC) then
          place%area(node) = place%area(node) &
            + norm2(normal) * TWO_PI / 6.0_wp * (x(1, node) + sum(x(1, node)))
        else
          place%area(node) = place%area(node) + norm2(normal) / n
        end if
      end associate
    end do

  end subroutine spread_traction

  subroutine read_tools(self, deck, status)
    type(mechanics_t), intent(inout) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    type(group_t) :: group
    type(motion_t) :: motion
    type(tool_control_t) :: control
    real(wp) :: size_of_mesh, speed
    integer :: i

    ! Motions and controls that no tool has are checked all the same
    do i = 1, deck%count('motion')
      call deck%get('motion', i, group)
      call motion_from_group(group, deck, trim(DIMENSION_NAMES(self%settings%kind)), motion, status)
      if (status%failed()) return
    end do
    do i = 1, deck%count('control')
      call deck%get('control', i, group)
      call control_from_group(group, trim(DIMENSION_NAMES(self%settings%kind)), control)
      call group%finish(status)
      if (status%failed()) return
    end do
    allocate (self%tools(deck%count('tool')))
    size_of_mesh = maxval(abs(self%mesh%coordinates))
    call self%comm%max(size_of_mesh)
    speed = 0.0_wp
    do i = 1, size(self%tools)
      call deck%get('tool', i, group)
      call tool_from_group(group, deck, self%comm, trim(DIMENSION_NAMES(self%settings%kind)), &
                           self%tools(i), status)
      if (status%failed()) return
      speed = max(speed, self%tools(i)%speed(size_of_mesh))
    end do
    do i = 1, size(self%boundaries)
      associate (boundary => self%boundaries(i)%boundary)
        if (boundary%kind == BOUNDARY_MOTION) speed = max(speed, norm2(boundary%velocity))
      end associate
    end do
    self%slip_rate = FADING * speed
    call create_controls(self)

  end subroutine read_tools

  subroutine take_contact(group, keys)
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(out) :: keys

    character(len=:), allocatable :: kind

    allocate (keys%slave(0))
    keys%master = ''
    keys%friction = 'none'
    allocate (kind, source=trim(ENFORCEMENT_NAMES(PENALTY)))
    call group%take_list('slave', keys%slave, 'Name of a &body, whose whole surface except '// &
                         'symmetry planes may touch, or physical groups of its surface.', &
                         required=.true.)
    call group%take('master', keys%master, 'Name of the &tool, of another &body, or of a '// &
                    'physical group of its surface.', required=.true.)
    call group%take('friction', keys%friction, 'Name of the &friction; ''none'': frictionless.')
    call group%take('enforcement', kind, 'Pressure by penetration, or multipliers that bring '// &
                    'the penetration to nothing.', choices=ENFORCEMENT_NAMES)
    call group%take('penalty_factor', keys%penalty, '1', 'Contact pressure by penetration, as '// &
                    'a multiple of the stiffness of a cell.', above=0.0_wp)
    call group%take('tangential_factor', keys%tangential, '1', 'Friction stress by slip of a '// &
                    'law that bonds, as a multiple of that of the pressure.', above=0.0_wp)
    associate (rule => keys%enforcement)
      call group%take('penetration_tolerance', rule%penetration_tolerance, '1', 'Penetration, '// &
                      'by the cell size, below which multipliers are left alone.', above=0.0_wp)
      call group%take('multiplier_tolerance', rule%multiplier_tolerance, '1', 'Change of '// &
                      'multipliers, by the largest pressure, below which they are left alone.', &
                      above=0.0_wp)
      call group%take('maximum_augmentations', rule%maximum_augmentations, 'Changes of '// &
                      'multipliers in an increment after which it is taken as it is.', lower=1)
    end associate
    call group%take('sliding_inertia', keys%inertia, '1', 'Resistance of nodes that rub on the '// &
                    'tool to a slip that deviates by more than 5 % of a cell from that of the '// &
                    'last increments, as a multiple of the flow stress by the cell size: keeps '// &
                    'nodes at an edge from snapping.', lower=0.0_wp)
    call group%take('separation', keys%separation, 'False: nodes that touch stay on the tool, '// &
                    'and the contact carries tension.')
    call take_formulation(group, keys)
    keys%enforcement%kind = findloc(ENFORCEMENT_NAMES == kind, .true., dim=1)
    if (group%explaining .or. keys%enforcement%kind == AUGMENTED_LAGRANGIAN) return
    call refuse_idle('penetration_tolerance')
    call refuse_idle('multiplier_tolerance')
    call refuse_idle('maximum_augmentations')

  contains

    subroutine refuse_idle(key)
      character(len=*), intent(in) :: key

      if (group%given(key)) then
        call group%refuse(key, 'has no effect with enforcement = '''//kind//'''')
      end if

    end subroutine refuse_idle

  end subroutine take_contact

  !> Keys of a contact between bodies, which one with a tool must not have.
  subroutine take_formulation(group, keys)
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(inout) :: keys

    character(len=CHOICE_LENGTH), allocatable :: names(:)
    character(len=:), allocatable :: gap, projection, quadrature, variant

    allocate (names, source=contact_formulation_names())
    keys%formulation = 'quasi_symmetric'
    variant = trim(keys%choice%variant)
    projection = trim(keys%choice%projection)
    gap = trim(keys%choice%gap)
    quadrature = trim(keys%choice%quadrature)
    call group%take('formulation', keys%formulation, 'How bodies press on each other: '// &
                    'pressures of the slave that act on the master by a projection, '// &
                    'conditions at points of the slave alone, or of both.', choices=names)
    call group%take('variant', variant, 'Where conditions are that nothing projects: nodes, '// &
                    'the middle of each facet, or quadrature points.', &
                    choices=[character(len=9) :: 'nodal', 'one_point', 'full'])
    call group%take('projection', projection, 'How ''quasi_symmetric'' brings the pressure of '// &
                    'the slave to the master.', &
                    choices=[character(len=13) :: 'l2', 'lumped', 'interpolation', 'nodal'])
    call group%take('gap', gap, 'Distances of ''quasi_symmetric'': distributed as the forces '// &
                    'are, or the mean of those from both sides.', &
                    choices=[character(len=8) :: 'dual', 'averaged'])
    call group%take('quadrature', quadrature, 'Integrals on the pieces that facets of both '// &
                    'sides have in common, or on whole facets of the slave.', &
                    choices=[character(len=7) :: 'clipped', 'slave'])
    call group%take('quadrature_points', keys%choice%n_point, 'Points on a facet of the slave '// &
                    'where integrals are not clipped.', lower=1)
    call group%take('smoothing', keys%smoothing, 'Normals interpolated between nodes, instead '// &
                    'of those of flat facets.')
    call group%take('feature_angle', keys%feature_angle, 'angle', 'Angle between normals of '// &
                    'facets from which on an edge is sharp.', above=0.0_wp, below=180.0_wp)
    call group%take('adjust', keys%adjust, 'length', 'Gaps up to this size, and overlaps of '// &
                    'any size, count as none at the start.', lower=0.0_wp)
    keys%adjusts = group%given('adjust')
    call check_formulation(group, keys%formulation, variant, projection, quadrature)
    keys%choice%variant = variant
    keys%choice%projection = projection
    keys%choice%gap = gap
    keys%choice%quadrature = quadrature

  end subroutine take_formulation

  !> Keys of one formulation mean nothing to another.
  subroutine check_formulation(group, formulation, variant, projection, quadrature)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: formulation, variant, projection, quadrature

    logical :: has_points, integrates, is_projected

    if (group%explaining) return
    is_projected = formulation == 'quasi_symmetric'
    ! The other projections take distances at nodes, from both sides
    integrates = is_projected .and. (projection == 'l2' .or. projection == 'lumped')
    if (integrates) then
      has_points = quadrature == 'slave'
    else
      has_points = .not. is_projected .and. variant == 'full'
    end if
    if (is_projected) call refuse_idle('variant')
    if (.not. is_projected) call refuse_idle('projection')
    if (.not. integrates) call refuse_idle('gap')
    if (.not. integrates) call refuse_idle('quadrature')
    if (.not. has_points) call refuse_idle('quadrature_points')

  contains

    subroutine refuse_idle(key)
      character(len=*), intent(in) :: key

      if (group%given(key)) then
        call group%refuse(key, 'has no effect with the formulation that the other keys choose')
      end if

    end subroutine refuse_idle

  end subroutine check_formulation

  !> Keys that mean nothing where the master is a tool.
  subroutine refuse_formulation(group)
    type(group_t), intent(inout) :: group

    character(len=17), parameter :: KEYS(9) = [character(len=17) :: 'formulation', 'variant', &
      'projection', 'gap', 'quadrature', 'quadrature_points', 'smoothing', 'feature_angle', &
      'adjust']
    integer :: i

    do i = 1, size(KEYS)
      if (group%given(trim(KEYS(i)))) then
        call group%refuse(trim(KEYS(i)), 'has no effect: the master is a tool')
      end if
    end do

  end subroutine refuse_formulation

  !> True when the master of a contact is a body or a part of its surface.
  function is_between_bodies(self, keys) result(between)
    type(mechanics_t), intent(in) :: self
    type(contact_keys_t), intent(in) :: keys
    logical :: between

    integer :: i

    between = .false.
    do i = 1, size(self%tools)
      if (self%tools(i)%name == keys%master) return
    end do
    between = self%mesh%find_group(keys%master, self%mesh%dimension - 1) > 0
    do i = 1, size(self%bodies)
      between = between .or. self%bodies(i)%name == keys%master
    end do

  end function is_between_bodies

  !> The friction of a contact.
  subroutine find_friction(deck, group, keys, law, status)
    type(deck_t), intent(in) :: deck
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    class(friction_law_t), allocatable, intent(out) :: law
    type(status_t), intent(inout) :: status

    type(group_t) :: friction_group

    if (keys%friction == 'none') then
      call default_friction(deck, law, status)
    else
      call deck%find('friction', keys%friction, friction_group, status, from=group, key='friction')
      if (status%failed()) return
      call friction_from_group(friction_group, law, status)
    end if

  end subroutine find_friction

  subroutine read_contacts(self, deck, status)
    type(mechanics_t), intent(inout) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    class(friction_law_t), allocatable :: law
    type(contact_keys_t) :: keys
    type(group_t) :: group, tool_group
    integer, allocatable :: facet(:), node(:), of_tools(:)
    real(wp), allocatable :: nodal(:, :)
    integer :: i, j, tool

    call check_frictions(deck, status)
    if (status%failed()) return
    call nodal_stiffness(self, nodal)
    allocate (of_tools(0))
    do i = 1, deck%count('contact')
      call deck%get('contact', i, group)
      call take_contact(group, keys)
      if (.not. is_between_bodies(self, keys)) of_tools = [of_tools, i]
    end do
    call read_pairs(self, deck, of_tools, nodal, status)
    if (status%failed()) return
    allocate (self%contacts(size(of_tools)))
    do i = 1, size(self%contacts)
      call deck%get('contact', of_tools(i), group)
      call take_contact(group, keys)
      call refuse_formulation(group)
      call find_slave(self, group, 'slave', keys%slave, facet)
      call need_surface(self, group, 'slave', facet)
      call group%finish(status)
      if (status%failed()) return
      call deck%find('tool', keys%master, tool_group, status, from=group, key='master')
      if (status%failed()) return
      tool = 0
      do j = 1, size(self%tools)
        if (self%tools(j)%name == keys%master) tool = j
      end do
      call find_friction(deck, group, keys, law, status)
      if (status%failed()) return
      call check_friction(self, law, group, facet, status)
      if (status%failed()) return
      call check_pairs(self, i, tool, facet, group, status)
      if (status%failed()) return
      call surface_nodes(self, facet, node)
      call tool_contact_create(group%name, tool, law, keys%separation, facet, node, &
                               self%mesh%node_tag(node), nodal(2, node), &
                               keys%penalty * nodal(1, node), &
                               keys%penalty * keys%tangential * nodal(1, node), keys%enforcement, &
                               keys%inertia, self%contacts(i))
      call check_overlap(self, self%contacts(i), group, status)
      if (status%failed()) return
    end do
    call check_controls(self, deck, status)

  end subroutine read_contacts

  !> Collective. Contacts between bodies: their surfaces, conditions and coupling.
  subroutine read_pairs(self, deck, of_tools, nodal, status)
    type(mechanics_t), intent(inout) :: self
    type(deck_t), intent(in) :: deck
    !> Contacts with tools.
    integer, intent(in) :: of_tools(:)
    !> Stiffness and cell size around the nodes; see `nodal_stiffness`.
    real(wp), intent(in) :: nodal(:, :)
    type(status_t), intent(inout) :: status

    class(friction_law_t), allocatable :: law
    type(contact_keys_t) :: keys
    type(group_t) :: group
    integer, allocatable :: master(:), slave(:), unknown_node(:)
    integer(gp), allocatable :: in_use(:, :), node_global(:)
    logical, allocatable :: is_used(:)
    integer :: i, k, n

    n = deck%count('contact') - size(of_tools)
    allocate (self%pairs(n))
    if (n == 0) return
    ! Which facets each pair has, as bits of the slave and the master of this rank's facets
    allocate (in_use(2 * n, self%mesh%n_facet), source=0_gp)
    k = 0
    do i = 1, deck%count('contact')
      if (any(of_tools == i)) cycle
      k = k + 1
      call deck%get('contact', i, group)
      call take_contact(group, keys)
      call find_slave(self, group, 'slave', keys%slave, slave)
      call need_surface(self, group, 'slave', slave)
      call find_slave(self, group, 'master', [keys%master], master)
      call need_surface(self, group, 'master', master)
      call check_sides(self, group, slave, master)
      call group%finish(status)
      if (status%failed()) return
      in_use(2 * k - 1, slave) = 1_gp
      in_use(2 * k, master) = 1_gp
    end do
    allocate (is_used(self%mesh%n_facet))
    is_used = any(in_use > 0_gp, dim=1)
    call shared_surface_create(self%comm, self%mesh, pack([(i, i=1, size(is_used))], is_used), &
                               pack(self%body_of_cell(self%mesh%facet_cell), is_used), &
                               self%surface)
    associate (surface => self%surface)
      allocate (self%surface_start(3, surface%n_node), self%surface_moved(3, surface%n_node))
      allocate (self%matrix%coupling)
      allocate (unknown_node(surface%n_node), source=0)
      allocate (node_global(surface%n_node), source=0_gp)
      do i = 1, surface%n_node
        if (surface%mesh_node(i) == 0) cycle
        unknown_node(i) = self%unknowns%of_node(surface%mesh_node(i))
        if (surface%is_own(i)) node_global(i) = self%unknowns%node_global(unknown_node(i))
      end do
      call self%comm%sum(node_global)
      call coupling_matrix_create(self%comm, self%mesh%dimension, node_global, unknown_node, &
                                  surface%is_own, self%matrix%coupling)
    end associate

    k = 0
    do i = 1, deck%count('contact')
      if (any(of_tools == i)) cycle
      k = k + 1
      call deck%get('contact', i, group)
      call take_contact(group, keys)
      call find_friction(deck, group, keys, law, status)
      if (status%failed()) return
      slave = pack([(i, i=1, size(is_used))], in_use(2 * k - 1, :) > 0_gp)
      call check_friction(self, law, group, slave, status)
      if (status%failed()) return
      call create_pair(self, group, keys, law, on_surface(self, in_use(2 * k - 1, :)), &
                       on_surface(self, in_use(2 * k, :)), nodal, self%pairs(k), status)
      if (status%failed()) return
    end do

  end subroutine read_pairs

  !> Collective. Facets of the shared surface, from those of this rank that are marked.
  function on_surface(self, is_marked) result(places)
    type(mechanics_t), intent(in) :: self
    !> 1 or 0; shape (n_facet of the mesh).
    integer(gp), intent(in) :: is_marked(:)
    integer, allocatable :: places(:)

    integer(gp), allocatable :: marks(:)
    integer :: i

    allocate (marks(self%surface%n_facet), source=0_gp)
    do i = 1, size(marks)
      if (self%surface%mesh_facet(i) > 0) marks(i) = is_marked(self%surface%mesh_facet(i))
    end do
    call self%comm%sum(marks)
    allocate (places, source=pack([(i, i=1, size(marks))], marks > 0_gp))

  end function on_surface

  !> Collective. A body cannot press on itself in this way, and no facet may be on both sides.
  subroutine check_sides(self, group, slave, master)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    integer, intent(in) :: slave(:)
    integer, intent(in) :: master(:)

    logical :: is_slave(self%mesh%n_facet)
    integer(gp) :: n_shared

    is_slave = .false.
    is_slave(slave) = .true.
    n_shared = count(is_slave(master), kind=gp)
    call self%comm%sum(n_shared)
    if (n_shared == 0_gp) return
    call group%refuse('master', 'has '//text(int(n_shared))//' facets that the slave has, too: '// &
                      'the two sides of a contact must be different surfaces')

  end subroutine check_sides

  !> Collective. A pair of surfaces with its formulation and what is enforced there.
  subroutine create_pair(self, group, keys, law, slave, master, nodal, pair, status)
    type(mechanics_t), intent(inout) :: self
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(in) :: keys
    class(friction_law_t), intent(in) :: law
    !> Facets of the shared surface.
    integer, intent(in) :: slave(:), master(:)
    !> Stiffness and cell size around the nodes; see `nodal_stiffness`.
    real(wp), intent(in) :: nodal(:, :)
    type(body_pair_t), intent(inout) :: pair
    type(status_t), intent(inout) :: status

    real(wp), parameter :: DEGREE = acos(-1.0_wp) / 180.0_wp

    real(wp), allocatable :: all_nodal(:, :), penalty(:)
    integer, allocatable :: owner(:)
    real(wp) :: reach
    integer :: n

    associate (surface => self%surface)
      n = surface%n_node
      allocate (all_nodal(2, n), penalty(n))
      call surface%gather(nodal(:2, :), all_nodal)
      reach = max(maxval(all_nodal(2, reshape(surface%facet_node(:, slave), &
                                              [size(surface%facet_node, 1) * size(slave)]))), &
                  maxval(all_nodal(2, reshape(surface%facet_node(:, master), &
                                              [size(surface%facet_node, 1) * size(master)]))))
      call contact_pair_create(self%mesh%dimension, self%settings%kind == AXISYMMETRIC, &
                               surface%facet_node(:, slave), surface%facet_node(:, master), n, &
                               reach, reach, keys%smoothing, keys%feature_angle * DEGREE, &
                               pair%surfaces)
      call contact_formulation_create(keys%formulation, keys%choice, pair%formulation)
      if (.not. allocated(pair%formulation)) then
        call group%refuse('projection', 'does not go with formulation '//keys%formulation)
      else if (.not. has_facet_quadrature(self%mesh%dimension, keys%choice%n_point)) then
        call group%refuse('quadrature_points', 'there is no rule with so many points: on a '// &
                          'line 1 to 10, on a triangle 1, 3, 6, 7 or 12')
      end if
      call group%finish(status)
      if (status%failed()) return
      call pair%formulation%list_owners(pair%surfaces, owner)
      penalty = keys%penalty * pair_stiffness(surface%facet_node(:, master), all_nodal(1, :))
      call body_contact_create(group%name, law, keys%separation, owner, surface%is_own, &
                               surface%mesh_node, all_nodal(2, :), penalty, &
                               keys%tangential * penalty, keys%enforcement, keys%inertia, &
                               pair%contact)
      call check_start(self, group, keys, pair, status)
    end associate

  end subroutine create_pair

  !> Stiffness of each node and the mean of the master, one behind the other: the softer decides.
  pure function pair_stiffness(master, stiffness) result(together)
    !> Corners of facets; shape (n_dim, :).
    integer, intent(in) :: master(:, :)
    !> Of the surface nodes [stress/length]; shape (n_node).
    real(wp), intent(in) :: stiffness(:)
    real(wp) :: together(size(stiffness))

    real(wp) :: mean

    mean = sum(stiffness(reshape(master, [size(master)]))) / max(size(master), 1)
    together = 2.0_wp * stiffness * mean / (stiffness + mean)

  end function pair_stiffness

  !> Collective. Bodies drawn into each other are a mistake in the input, unless they are adjusted.
  subroutine check_start(self, group, keys, pair, status)
    type(mechanics_t), intent(inout) :: self
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    type(body_pair_t), intent(inout) :: pair
    type(status_t), intent(inout) :: status

    real(wp) :: deepest
    integer :: row, worst

    call self%surface%gather(self%mesh%coordinates, self%surface_start)
    call pair%surfaces%begin_step(self%surface_start)
    call pair%formulation%evaluate(pair%surfaces, self%surface%is_own, pair%rows)
    if (keys%adjusts) then
      call pair%contact%adjust(pair%rows, keys%adjust)
      return
    end if
    deepest = 0.0_wp
    worst = 0
    do row = 1, pair%rows%n_row
      associate (place => pair%contact%place(pair%rows%key(row)), gap => pair%rows%gap(row))
        if (gap <= LARGEST_OVERLAP * pair%contact%size(place) .or. gap <= deepest) cycle
      end associate
      deepest = pair%rows%gap(row)
      worst = pair%rows%slave(row)
    end do
    if (worst > 0) then
      call status%raise(STATUS_ERROR, 'check_start', group%describe('master')//': at the start '// &
                        'node '//text(int(self%surface%node_tag(worst)))// &
                        near(self%surface_start(:self%mesh%dimension, worst))//' is '// &
                        text(deepest)//' [length] inside the master, more than a tenth of its '// &
                        'cells: draw the bodies apart, or give `adjust`')
    end if
    call self%comm%agree(status)

  end subroutine check_start

  !> Collective. A facet that meets a tool by two contacts would be pushed twice.
  subroutine check_pairs(self, n, tool, facet, group, status)
    type(mechanics_t), intent(in) :: self
    !> Place of the contact in hand; those before it are made.
    integer, intent(in) :: n
    integer, intent(in) :: tool
    integer, intent(in) :: facet(:)
    !> `&contact`.
    type(group_t), intent(in) :: group
    type(status_t), intent(inout) :: status

    integer(gp) :: n_shared
    integer :: i
    logical :: touching(self%mesh%n_facet)

    do i = 1, n - 1
      if (self%contacts(i)%tool /= tool) cycle
      touching = .false.
      touching(self%contacts(i)%facet) = .true.
      n_shared = count(touching(facet), kind=gp)
      call self%comm%sum(n_shared)
      if (n_shared == 0_gp) cycle
      call status%raise(STATUS_ERROR, 'check_pairs', group%describe('slave')//': &contact '''// &
                        self%contacts(i)%name//''' brings '//text(int(n_shared))//' of its '// &
                        'facets in touch with tool '''//self%tools(tool)%name//''' already: '// &
                        'each needs one contact with a tool')
      return
    end do

  end subroutine check_pairs

  !> Forces on a tool that nothing can touch have nothing to balance them.
  subroutine check_controls(self, deck, status)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    type(group_t) :: group
    integer :: i

    do i = 1, size(self%tools)
      if (size(self%tools(i)%controls) == 0 .or. any(self%contacts%tool == i)) cycle
      call deck%get('tool', i, group)
      call status%raise(STATUS_ERROR, 'check_controls', group%describe('controls')//': no '// &
                        '&contact has this tool as its master: nothing balances the forces on it')
      return
    end do

  end subroutine check_controls

  !> Frictions that no contact uses are checked all the same.
  subroutine check_frictions(deck, status)
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    class(friction_law_t), allocatable :: law
    type(group_t) :: group
    integer :: i

    do i = 1, deck%count('friction')
      call deck%get('friction', i, group)
      call friction_from_group(group, law, status)
      if (status%failed()) return
    end do

  end subroutine check_frictions

  !> Collective. A friction limited by the flow stress needs a body that flows, and a regularised
  !> one a slip rate.
  subroutine check_friction(self, law, group, facet, status)
    type(mechanics_t), intent(in) :: self
    class(friction_law_t), intent(in) :: law
    !> `&contact`.
    type(group_t), intent(in) :: group
    integer, intent(in) :: facet(:)
    type(status_t), intent(inout) :: status

    integer :: i, material

    if (law%is_regularised .and. law%regularisation_velocity <= 0.0_wp &
        .and. self%slip_rate <= 0.0_wp) then
      call status%raise(STATUS_ERROR, 'check_friction', group%describe('friction')//': no '// &
                        'motion is prescribed, so no slip rate follows from its speed: give '// &
                        '`regularisation_velocity` in the &friction')
    end if
    if (law%uses_flow_stress) then
      do i = 1, size(facet)
        material = self%material_of_cell(self%mesh%facet_cell(facet(i)))
        if (self%materials(material)%law%initial_flow_stress > 0.0_wp) cycle
        call status%raise(STATUS_ERROR, 'check_friction', group%describe('friction')//': it is '// &
                          'limited by the flow stress of the body, but material '// &
                          self%materials(material)%name//' never flows: give `flow_stress` in '// &
                          'the &friction')
        exit
      end do
    end if
    call self%comm%agree(status)

  end subroutine check_friction

  !> Facets of a body, or of groups of its surface.
  subroutine find_slave(self, group, key, slave, facet)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    !> Key that named them.
    character(len=*), intent(in) :: key
    character(len=*), intent(in) :: slave(:)
    integer, allocatable, intent(out) :: facet(:)

    logical :: touching(self%mesh%n_facet)
    integer :: body, i, j, place

    touching = .false.
    allocate (facet(0))
    do i = 1, size(slave)
      body = 0
      do j = 1, size(self%bodies)
        if (self%bodies(j)%name == slave(i)) body = j
      end do
      if (body > 0) then
        where (self%body_of_cell(self%mesh%facet_cell) == body) touching = .true.
        do j = 1, size(self%boundaries)
          if (self%boundaries(j)%boundary%kind /= BOUNDARY_SYMMETRY) cycle
          touching(self%boundaries(j)%facet) = .false.
        end do
        if (self%settings%kind == AXISYMMETRIC) call leave_axis(self, touching)
      else if (any([(self%tools(j)%name == slave(i), j=1, size(self%tools))])) then
        call group%refuse(key, trim(slave(i))//' is a tool: the slave is a &body, or '// &
                          'groups of its surface, and the tool the master')
        return
      else
        place = checked_group(self, group, key, trim(slave(i)), self%mesh%dimension - 1)
        if (place == 0) return
        touching(self%mesh%group_facets(place)) = .true.
      end if
    end do
    facet = pack([(i, i=1, size(touching))], touching)

  end subroutine find_slave

  !> Collective. A contact needs a surface; a fault stays in `group`.
  subroutine need_surface(self, group, key, facet)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: key
    integer, intent(in) :: facet(:)

    integer(gp) :: n_facet

    n_facet = size(facet, kind=gp)
    call self%comm%sum(n_facet)
    if (n_facet > 0_gp) return
    call group%refuse(key, 'holds no facet of the bodies'' outer surface: name a &body, or '// &
                      'a physical group of its surface')

  end subroutine need_surface

  !> The axis of revolution is no surface.
  subroutine leave_axis(self, touching)
    type(mechanics_t), intent(in) :: self
    logical, intent(inout) :: touching(:)

    integer :: i

    do i = 1, size(touching)
      if (all(abs(self%mesh%coordinates(1, self%mesh%facet_node(:, i))) &
              <= 1.0e-9_wp * self%cell_size)) touching(i) = .false.
    end do

  end subroutine leave_axis

  !> Without friction, by the registry's own law of that name.
  subroutine default_friction(deck, law, status)
    use swage_deck, only: deck_from_text
    type(deck_t), intent(in) :: deck
    class(friction_law_t), allocatable, intent(out) :: law
    type(status_t), intent(inout) :: status

    type(deck_t) :: own
    type(group_t) :: group

    call deck_from_text('&friction name = ''none'', kind = ''none'' /', deck%path, own, status)
    if (status%failed()) return
    call own%get('friction', 1, group)
    call friction_from_group(group, law, status)

  end subroutine default_friction

  !> Collective. This rank's own nodes of a surface whose facets may lie on other ranks.
  subroutine surface_nodes(self, facet, node)
    type(mechanics_t), intent(in) :: self
    integer, intent(in) :: facet(:)
    integer, allocatable, intent(out) :: node(:)

    real(wp), allocatable :: touched(:, :)
    integer :: i

    allocate (touched(1, self%mesh%n_node), source=0.0_wp)
    do i = 1, size(facet)
      touched(1, self%mesh%facet_node(:, facet(i))) = 1.0_wp
    end do
    call self%mesh%halo%accumulate(touched)
    node = pack([(i, i=1, self%mesh%n_own_node)], touched(1, :self%mesh%n_own_node) > 0.0_wp)

  end subroutine surface_nodes

  !> Collective. Means over the cells around each node: stiffness 3G by cell size, and cell size.
  subroutine nodal_stiffness(self, nodal)
    type(mechanics_t), intent(in) :: self
    !> [stress/length], [length], and the number of cells; shape (3, n_node).
    real(wp), allocatable, intent(out) :: nodal(:, :)

    real(wp) :: size_of_cell(self%mesh%n_cell)
    integer :: a, cell

    allocate (nodal(3, self%mesh%n_node), source=0.0_wp)
    size_of_cell = self%mesh%cell_size()
    do cell = 1, self%mesh%n_cell
      associate (modulus => self%materials(self%material_of_cell(cell))%law%reference_modulus)
        do a = 1, size(self%mesh%cell_node, 1)
          associate (node => nodal(:, self%mesh%cell_node(a, cell)))
            node = node + [1.5_wp * modulus / size_of_cell(cell), size_of_cell(cell), 1.0_wp]
          end associate
        end do
      end associate
    end do
    call self%mesh%halo%accumulate(nodal)
    nodal(1, :) = nodal(1, :) / nodal(3, :)
    nodal(2, :) = nodal(2, :) / nodal(3, :)

  end subroutine nodal_stiffness

  !> A tool drawn into the body is a mistake in the input.
  subroutine check_overlap(self, contact, group, status)
    type(mechanics_t), intent(in) :: self
    type(tool_contact_t), intent(in) :: contact
    type(group_t), intent(in) :: group
    type(status_t), intent(inout) :: status

    real(wp) :: deepest, hessian(3, 3), normal(3), penetration, x(3)
    integer :: i, worst

    deepest = 0.0_wp
    worst = 0
    do i = 1, size(contact%node)
      x = 0.0_wp
      x(:self%mesh%dimension) = self%mesh%coordinates(:, contact%node(i))
      call self%tools(contact%tool)%project(x, penetration, normal, hessian)
      if (penetration > LARGEST_OVERLAP * contact%size(i) .and. penetration > deepest) then
        deepest = penetration
        worst = contact%node(i)
      end if
    end do
    if (worst > 0) then
      call status%raise(STATUS_ERROR, 'check_overlap', group%describe('master')// &
                        ': at the start node '//text(int(self%mesh%node_tag(worst)))// &
                        near(self%mesh%coordinates(:, worst))//' is '//text(deepest)// &
                        ' [length] inside the tool, more than a tenth of its cells: move the '// &
                        'tool out of the body')
    end if
    call self%comm%agree(status)

  end subroutine check_overlap

end submodule swage_mechanics_setup
