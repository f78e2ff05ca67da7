!> What [[swage_mechanics]] tells the outside: history, fields, pictures of the tools.
submodule(swage_mechanics) swage_mechanics_output
  use swage_contact_state, only: contact_state_t
  use swage_boundary, only: BOUNDARY_MOTION, BOUNDARY_SYMMETRY
  use swage_field_list, only: FIELD_CELL, FIELD_NODAL
  use swage_cell_geometry, only: AXISYMMETRIC
  use swage_mesh_quality, only: mesh_quality_t, measure_quality
  use swage_rigid_shape, only: shape_picture_t, shape_view_t
  implicit none(type, external)

  character(len=1), parameter :: AXIS_NAMES(3) = ['x', 'y', 'z']

contains

  module procedure mechanics_history_columns

    integer :: i, k

    allocate (names(0), dimensions(0))
    do i = 1, size(self%tools)
      do k = 1, 3
        call add_column('force_'//self%tools(i)%name//'_'//AXIS_NAMES(k), 'force')
      end do
      do k = 1, 3
        call add_column('torque_'//self%tools(i)%name//'_'//AXIS_NAMES(k), 'torque')
      end do
      do k = 1, 3
        call add_column('position_'//self%tools(i)%name//'_'//AXIS_NAMES(k), 'length')
      end do
      call add_column('angle_'//self%tools(i)%name, 'angle')
    end do
    do i = 1, size(self%boundaries)
      associate (boundary => self%boundaries(i)%boundary)
        select case (boundary%kind)
        case (BOUNDARY_MOTION, BOUNDARY_SYMMETRY)
          do k = 1, 3
            call add_column('reaction_'//boundary%name//'_'//AXIS_NAMES(k), 'force')
          end do
        case default
          do k = 1, 3
            call add_column('load_'//boundary%name//'_'//AXIS_NAMES(k), 'force')
          end do
        end select
        do k = 1, 3
          call add_column('displacement_'//boundary%name//'_'//AXIS_NAMES(k), 'length')
        end do
      end associate
    end do
    do i = 1, size(self%contacts)
      call add_contact(self%contacts(i)%name)
    end do
    do i = 1, size(self%pairs)
      call add_contact(self%pairs(i)%contact%name)
    end do
    call add_column('volume', 'length^3')
    call add_column('mass_error', '1')
    call add_column('external_work', 'energy')
    call add_column('plastic_work', 'energy')
    call add_column('elastic_energy', 'energy')
    call add_column('friction_work', 'energy')
    call add_column('contact_energy', 'energy')
    call add_column('stabilisation_work', 'energy')
    call add_column('energy_error', '1')

  contains

    subroutine add_contact(name)
      character(len=*), intent(in) :: name

      call add_column('contact_nodes_'//name, '1')
      call add_column('contact_area_'//name, 'length^2')
      call add_column('penetration_'//name, 'length')
      call add_column('penetration_by_cell_'//name, '1')

    end subroutine add_contact

    subroutine add_column(name, dimension)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: dimension

      names = [character(len=64) :: names, name]
      dimensions = [character(len=64) :: dimensions, dimension]

    end subroutine add_column

  end procedure mechanics_history_columns

  module procedure mechanics_history_values

    real(wp) :: mean(4)
    integer :: i, j

    allocate (values(0))
    do i = 1, size(self%tools)
      values = [values, self%tool_force(:, i), self%tools(i)%position, self%tools(i)%angle]
    end do
    do i = 1, size(self%boundaries)
      associate (place => self%boundaries(i))
        if (place%boundary%kind == BOUNDARY_MOTION .or. &
            place%boundary%kind == BOUNDARY_SYMMETRY) then
          values = [values, self%reaction(:, i)]
        else
          values = [values, self%load_force(:, i)]
        end if
        ! The mean over the boundary's nodes
        mean = 0.0_wp
        do j = 1, size(place%node)
          if (place%node(j) > self%mesh%n_own_node) cycle
          mean(:self%mesh%dimension) = mean(:self%mesh%dimension) &
            + self%displacement(:, place%node(j))
          mean(4) = mean(4) + 1.0_wp
        end do
        call self%comm%sum(mean)
        values = [values, mean(1:3) / max(mean(4), 1.0_wp)]
      end associate
    end do
    do i = 1, size(self%contacts)
      values = [values, contact_values(self, self%contacts(i)%contact_state_t)]
    end do
    do i = 1, size(self%pairs)
      values = [values, contact_values(self, self%pairs(i)%contact%contact_state_t)]
    end do
    associate (energies => self%energies)
      values = [values, mass_balance(self), energies%external, energies%plastic, &
                energies%elastic, energies%friction, energies%contact, energies%stabilisation, &
                energies%error()]
    end associate

  end procedure mechanics_history_values

  !> Collective. Conditions in contact, their area, and the largest penetration, also by the cell.
  function contact_values(self, contact) result(values)
    class(mechanics_t), intent(in) :: self
    type(contact_state_t), intent(in) :: contact
    !> [1], [length^2], [length], [1].
    real(wp) :: values(4)

    values(1) = real(count(contact%active), wp)
    values(2) = sum(contact%area, mask=contact%active)
    values(3) = max(0.0_wp, maxval(contact%penetration, mask=contact%active))
    values(4) = max(0.0_wp, maxval(contact%penetration / contact%size, mask=contact%active))
    call self%comm%sum(values(:2))
    call self%comm%max(values(3))
    call self%comm%max(values(4))

  end function contact_values

  !> Collective. Volume, and its excess over that of the same mass at the present pressure.
  function mass_balance(self) result(balance)
    class(mechanics_t), intent(in) :: self
    !> Volume [length^3], relative mass error [1].
    real(wp) :: balance(2)

    real(wp) :: volumes(2)
    integer :: cell

    volumes = 0.0_wp
    do cell = 1, self%mesh%n_cell
      associate (law => self%materials(self%material_of_cell(cell))%law)
        if (self%settings%fixed_geometry) then
          volumes(1) = volumes(1) + self%initial_volume(cell) * (1.0_wp + self%log_volume(cell))
        else
          volumes(1) = volumes(1) + self%volume_new(cell)
        end if
        volumes(2) = volumes(2) + self%initial_volume(cell) &
          * sum(exp(-law%inverse_bulk_modulus * cell_pressures(self, cell))) &
          / size(self%mesh%cell_node, 1)
      end associate
    end do
    call self%comm%sum(volumes)
    balance = [volumes(1), volumes(1) / volumes(2) - 1.0_wp]

  end function mass_balance

  !> Pressures at the vertices of a cell [stress]; shape (n_vertex).
  pure function cell_pressures(self, cell) result(pressures)
    class(mechanics_t), intent(in) :: self
    integer, intent(in) :: cell
    real(wp) :: pressures(size(self%mesh%cell_node, 1))

    if (allocated(self%unknowns%cell_pressure)) then
      pressures = self%pressure(self%unknowns%cell_pressure(:, cell))
    else
      pressures = self%pressure(self%mesh%cell_node(:, cell))
    end if

  end function cell_pressures

  module procedure mechanics_collect_fields

    real(wp), allocatable :: row(:, :), stress(:, :), vectors(:, :), weights(:, :)
    integer :: i, n

    n = self%mesh%n_node
    allocate (vectors(3, n), source=0.0_wp)
    vectors(:self%mesh%dimension, :) = self%displacement
    call fields%add('displacement', 'length', 'since the start of the run', FIELD_NODAL, vectors)
    if (self%dt_last > 0.0_wp) then
      vectors(:self%mesh%dimension, :) = self%increment_last / self%dt_last
    end if
    call fields%add('velocity', 'length/time', 'mean of the last increment', FIELD_NODAL, vectors)
    allocate (row(2, n), weights(3, n))
    if (self%unknowns%n_further_global == 0_gp) then
      call fields%add('pressure', 'stress', 'positive in compression', FIELD_NODAL, &
                      reshape(self%pressure, [1, n]))
    else
      call mean_pressures(self, row)
      call fields%add('pressure', 'stress', 'positive in compression; where materials meet the '// &
                      'mean of theirs, by the volumes of cells', FIELD_NODAL, row(1:1, :))
      call fields%add('pressure_jump', 'stress', 'largest less smallest pressure of the '// &
                      'materials that meet at a node', FIELD_NODAL, row(2:2, :))
    end if
    call fields%add('temperature', 'temperature', 'nodal temperature', FIELD_NODAL, &
                    reshape(self%temperature, [1, n]))
    call contact_fields(self, row, weights)
    call fields%add('contact_pressure', 'stress', 'of tools and masters, 0 where there is none', &
                    FIELD_NODAL, row(1:1, :))
    call fields%add('penetration', 'length', 'into tools and masters, 0 where there is none', &
                    FIELD_NODAL, row(2:2, :))
    call fields%add('friction_traction', 'stress', 'of tools and masters on slaves', FIELD_NODAL, &
                    weights)

    allocate (stress(6, self%mesh%n_cell))
    stress = self%deviator
    do i = 1, 3
      stress(i, :) = stress(i, :) + self%mean_stress
    end do
    call fields%add('stress', 'stress', 'Cauchy stress', FIELD_CELL, stress, is_tensor=.true.)
    call fields%add('equivalent_stress', 'stress', 'von Mises', FIELD_CELL, &
                    reshape(sqrt(1.5_wp * sum(self%deviator**2, dim=1)), [1, self%mesh%n_cell]))
    call state_fields(self, fields)
    call fields%add('volume_ratio', '1', 'cell volume by its volume before the first step', &
                    FIELD_CELL, reshape(exp(self%log_volume), [1, self%mesh%n_cell]))
    call fields%add('body', '1', 'number of the &body in the input, 0 for tools', FIELD_CELL, &
                    reshape(real(self%body_of_cell, wp), [1, self%mesh%n_cell]))
    call fields%add('material', '1', 'number of the &material in the input, 0 for tools', &
                    FIELD_CELL, reshape(real(self%material_of_cell, wp), [1, self%mesh%n_cell]))

  end procedure mechanics_collect_fields

  !> Collective. Mean and range of the pressures of each node, on all copies.
  subroutine mean_pressures(self, row)
    class(mechanics_t), intent(in) :: self
    !> Mean weighted by the volumes of cells, and largest less smallest [stress]; shape (2, n_node).
    real(wp), contiguous, intent(out) :: row(:, :)

    real(wp), allocatable :: greatest(:), least(:), volume(:, :), whole(:)
    integer :: a, cell, i, node

    allocate (volume(1, self%unknowns%n_node), source=0.0_wp)
    do cell = 1, self%mesh%n_cell
      do a = 1, size(self%mesh%cell_node, 1)
        associate (share => volume(1, self%unknowns%cell_pressure(a, cell)))
          share = share + self%volume_new(cell)
        end associate
      end do
    end do
    call self%unknowns%halo%accumulate(volume)

    ! The owner of a node owns all its pressures
    row = 0.0_wp
    allocate (whole(self%mesh%n_own_node), source=0.0_wp)
    allocate (greatest(self%mesh%n_own_node), source=-huge(1.0_wp))
    allocate (least(self%mesh%n_own_node), source=huge(1.0_wp))
    do i = 1, self%unknowns%n_own_node
      node = self%unknowns%mesh_node(i)
      whole(node) = whole(node) + volume(1, i)
      row(1, node) = row(1, node) + volume(1, i) * self%pressure(i)
      greatest(node) = max(greatest(node), self%pressure(i))
      least(node) = min(least(node), self%pressure(i))
    end do
    row(1, :size(whole)) = row(1, :size(whole)) / whole
    row(2, :size(whole)) = greatest - least
    call self%mesh%halo%update(row)

  end subroutine mean_pressures

  !> Contact pressure, penetration and friction on all copies of the nodes.
  subroutine contact_fields(self, row, traction)
    class(mechanics_t), intent(in) :: self
    real(wp), contiguous, intent(out) :: row(:, :)
    real(wp), contiguous, intent(out) :: traction(:, :)

    real(wp), allocatable :: area(:), penetration(:), pressure(:), shear(:, :)
    integer, allocatable :: node(:)
    logical, allocatable :: active(:)
    integer :: i, j

    row = 0.0_wp
    traction = 0.0_wp
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i))
        do j = 1, size(contact%node)
          if (.not. contact%active(j)) cycle
          associate (node => contact%node(j))
            row(1, node) = row(1, node) + contact%pressure(j)
            row(2, node) = max(row(2, node), contact%penetration(j))
            traction(:, node) = traction(:, node) + contact%traction(:, j)
          end associate
        end do
      end associate
    end do
    do i = 1, size(self%pairs)
      call self%pairs(i)%contact%list_nodes(node, area, penetration, pressure, shear, active)
      do j = 1, size(node)
        if (.not. active(j)) cycle
        row(1, node(j)) = row(1, node(j)) + pressure(j)
        row(2, node(j)) = max(row(2, node(j)), penetration(j))
        traction(:, node(j)) = traction(:, node(j)) + shear(:, j)
      end do
    end do
    call self%mesh%halo%update(row)
    call self%mesh%halo%update(traction)

  end subroutine contact_fields

  !> The histories of all laws; 0 in cells whose law has no such variable.
  subroutine state_fields(self, fields)
    class(mechanics_t), intent(in) :: self
    type(field_list_t), intent(inout) :: fields

    real(wp), allocatable :: values(:, :)
    integer :: cell, i, j, material, row, width

    do i = 1, size(self%materials)
      do j = 1, size(self%materials(i)%law%state_table)
        associate (variable => self%materials(i)%law%state_table(j))
          if (fields%find(trim(variable%name)) > 0) cycle
          width = variable%width()
          allocate (values(width, self%mesh%n_cell), source=0.0_wp)
          do material = 1, size(self%materials)
            row = row_of(self%materials(material)%law, variable%name)
            if (row == 0) cycle
            do cell = 1, self%mesh%n_cell
              if (self%material_of_cell(cell) /= material) cycle
              values(:, cell) = self%state(row:row + width - 1, cell)
            end do
          end do
          call fields%add(trim(variable%name), trim(variable%dimension), 'history of the law', &
                          FIELD_CELL, values, is_tensor=width == 6)
          deallocate (values)
        end associate
      end do
    end do
    ! Pictures count on the strain, also of a body that cannot flow
    if (fields%find('equivalent_plastic_strain') == 0) then
      allocate (values(1, self%mesh%n_cell), source=0.0_wp)
      call fields%add('equivalent_plastic_strain', '1', 'history of the law', FIELD_CELL, values)
    end if

  end subroutine state_fields

  !> First row of a history variable, 0 when the law has none of that name.
  pure function row_of(law, name) result(row)
    class(material_law_t), intent(in) :: law
    character(len=*), intent(in) :: name
    integer :: row

    integer :: i, next

    row = 0
    next = 1
    do i = 1, size(law%state_table)
      if (law%state_table(i)%name == name) row = next
      next = next + law%state_table(i)%width()
    end do

  end function row_of

  module procedure mechanics_tool_surface

    integer, parameter :: VTK_LINE = 3, VTK_TRIANGLE = 5

    integer :: i, k
    integer(gp) :: start
    real(wp) :: lower(3), upper(3)
    type(shape_picture_t) :: picture
    type(shape_view_t) :: view

    lower = huge(1.0_wp)
    upper = -huge(1.0_wp)
    do k = 1, self%mesh%dimension
      if (self%mesh%n_node > 0) then
        lower(k) = minval(self%mesh%coordinates(k, :))
        upper(k) = maxval(self%mesh%coordinates(k, :))
      end if
      call self%comm%min(lower(k))
      call self%comm%max(upper(k))
    end do
    lower(self%mesh%dimension + 1:) = 0.0_wp
    upper(self%mesh%dimension + 1:) = 0.0_wp
    view%n_dim = self%mesh%dimension
    view%axisymmetric = self%settings%kind == AXISYMMETRIC
    view%centre = 0.5_wp * (lower + upper)
    view%extent = 0.6_wp * maxval(upper - lower)

    allocate (points(3, 0), connectivity(0), offsets(1), types(0))
    offsets = 0_gp
    if (self%comm%rank /= 0) return
    do i = 1, size(self%tools)
      call self%tools(i)%draw(view, picture)
      start = size(points, 2, kind=gp)
      points = reshape([points, picture%points], [3, size(points, 2) + size(picture%points, 2)])
      connectivity = [connectivity, start + int(reshape(picture%cells, [size(picture%cells)]), gp) &
                      - 1_gp]
      start = offsets(size(offsets))
      offsets = [offsets, (start + int(k * view%n_dim, gp), k=1, size(picture%cells, 2))]
      types = [types, (merge(VTK_LINE, VTK_TRIANGLE, view%n_dim == 2), k=1, size(picture%cells, 2))]
    end do

  end procedure mechanics_tool_surface

  module procedure mechanics_summary

    type(mesh_quality_t) :: quality
    integer :: i

    call measure_quality(self%mesh, self%comm, quality)
    text = 'mesh: '//number_of(self%mesh%n_node_global)//' nodes, '// &
      number_of(self%mesh%n_cell_global)//' cells, mean cell size '//number_of_real(self%cell_size)
    text = text//new_line('a')//'mesh: cell quality (1 regular, 0 flat) at least '// &
      number_of_real(quality%minimum)//' (cell '//number_of(quality%worst_cell)//'), mean '// &
      number_of_real(quality%mean)
    if (self%mesh%report%n_reoriented > 0_gp) then
      text = text//new_line('a')//'mesh: '//number_of(self%mesh%report%n_reoriented)// &
        ' cells were given in negative order and turned'
    end if
    if (self%mesh%report%n_dropped_node > 0_gp) then
      text = text//new_line('a')//'mesh: '//number_of(self%mesh%report%n_dropped_node)// &
        ' nodes belong to no cell and were left out'
    end if
    if (self%mesh%report%n_merged_node > 0_gp) then
      text = text//new_line('a')//'interfaces: '//number_of(self%mesh%report%n_merged_node)// &
        ' nodes became one with those at the same place'
    end if
    if (self%mesh%report%n_split_node > 0_gp) then
      text = text//new_line('a')//'interfaces: '//number_of(self%mesh%report%n_split_node)// &
        ' nodes added where bodies are apart'
    end if
    text = text//new_line('a')//'mesh: peak memory of rank 0 while reading '// &
      number_of_real(self%mesh%report%peak_memory)//' MB'
    if (self%unknowns%n_further_global > 0_gp) then
      text = text//new_line('a')//'interfaces: '//number_of(self%unknowns%n_further_global)// &
        ' further pressures at nodes where materials meet'
    end if
    do i = 1, size(self%bodies)
      text = text//new_line('a')//'body '//self%bodies(i)%name//': material '// &
        self%materials(self%bodies(i)%material)%name//', law '// &
        trim(self%materials(self%bodies(i)%material)%law%label)
    end do
    do i = 1, size(self%tools)
      if (.not. allocated(self%tools(i)%shape%note)) cycle
      text = text//new_line('a')//'tool '//self%tools(i)%name//': '//self%tools(i)%shape%note
    end do
    do i = 1, size(self%contacts)
      text = text//new_line('a')//'contact '//self%contacts(i)%name//': tool '// &
        self%tools(self%contacts(i)%tool)%name//', friction '//self%contacts(i)%friction%name
    end do
    do i = 1, size(self%pairs)
      associate (pair => self%pairs(i))
        text = text//new_line('a')//'contact '//pair%contact%name//': between bodies, '// &
          number_of(int(pair%surfaces%slave%n_facet, gp))//' facets on '// &
          number_of(int(pair%surfaces%master%n_facet, gp))
        if (pair%contact%is_tied) then
          text = text//', tied'
        else
          text = text//', friction '//pair%contact%friction%name
        end if
        if (pair%choice /= '') then
          text = text//new_line('a')//'contact '//pair%contact%name//': '//pair%choice
        end if
      end associate
    end do

  end procedure mechanics_summary

  module procedure mechanics_doubts

    integer :: i

    text = ''
    do i = 1, size(self%pairs)
      if (self%pairs(i)%warning == '') cycle
      if (text /= '') text = text//new_line('a')
      text = text//self%pairs(i)%warning
    end do

  end procedure mechanics_doubts

  pure function number_of(count) result(string)
    integer(gp), intent(in) :: count
    character(len=:), allocatable :: string

    string = text(int(count))

  end function number_of

  pure function number_of_real(value) result(string)
    real(wp), intent(in) :: value
    character(len=:), allocatable :: string

    string = text(value)

  end function number_of_real

end submodule swage_mechanics_output
