!> Reading and building of [[swage_mechanics]].
submodule(swage_mechanics) swage_mechanics_setup
  use swage_block_matrix, only: block_matrix_create
  use swage_body_keys, only: explain_interface, take_body
  use swage_boundary, only: boundary_from_group, BOUNDARY_MOTION, BOUNDARY_PRESSURE, &
                            BOUNDARY_SYMMETRY, BOUNDARY_TRACTION, explain_boundary
  use swage_contact_keys, only: contact_keys_t, take_contact
  use swage_group, only: group_t
  use swage_linear_solver_registry, only: linear_solver_create
  use swage_material_registry, only: material_from_group
  use swage_motion, only: motion_from_group, motion_t
  use swage_number, only: number_text
  use swage_rigid_tool, only: tool_from_group
  use swage_status, only: STATUS_ERROR
  use swage_tool_contact, only: facet_normal
  use swage_tool_control, only: control_from_group, tool_control_t
  use swage_units, only: shown
  use swage_unknowns, only: unknowns_create
  implicit none(type, external)

  !> What `dimension` is called in the input, in the order of the kinds of the element.
  character(len=12), parameter :: DIMENSION_NAMES(3) = [character(len=12) :: &
    'plane_strain', 'axisymmetric', '3d']
  !> A symmetry plane is plane when its facets' normals agree to this.
  real(wp), parameter :: FLATNESS = 1.0e-6_wp
  !> Share of the fastest tool's speed below which friction fades.
  real(wp), parameter :: FADING = 0.01_wp
  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)

contains

  module procedure mechanics_create

    integer :: n

    mechanics%comm = comm
    mechanics%settings = settings
    mechanics%units = units
    mechanics%notes = ''
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
      if (size(m%pairs) > 0) then
        allocate (m%contact_force(n, n_node), m%contact_force_new(n, n_node), source=0.0_wp)
      end if
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
                              self%unknowns, int(self%unknowns%n_node_global), self%solver, status)

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
  module procedure checked_group

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

  end procedure checked_group

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

end submodule swage_mechanics_setup
