!> Reading and building of the contacts of [[swage_mechanics]]: what those with tools and those
!> between bodies share. Each kind has a submodule of this one.
submodule(swage_mechanics) swage_mechanics_contact_setup
  use swage_body_keys, only: interfaces_from_deck
  use swage_boundary, only: BOUNDARY_SYMMETRY
  use swage_contact_keys, only: contact_keys_t, take_contact
  use swage_friction, only: friction_law_t
  use swage_friction_registry, only: friction_from_group
  use swage_group, only: group_t
  use swage_mesh_interface, only: mesh_interface_t
  use swage_status, only: STATUS_ERROR
  use swage_sticking, only: sticking_create, sticking_t
  implicit none(type, external)

  !> A tool or a body may overlap a body by this share of the cell size before the first step.
  real(wp), parameter :: LARGEST_OVERLAP = 0.1_wp

  interface
    !> Collective. Contacts with tools; without them, tools that follow forces are refused.
    module subroutine read_tool_contacts(self, deck, places, nodal, status)
      implicit none(type, external)
      type(mechanics_t), intent(inout) :: self
      type(deck_t), intent(in) :: deck
      !> Among the groups `&contact`.
      integer, intent(in) :: places(:)
      !> See `nodal_stiffness`.
      real(wp), intent(in) :: nodal(:, :)
      type(status_t), intent(inout) :: status
    end subroutine read_tool_contacts

    !> Collective. Contacts between bodies: their surfaces, conditions and coupling.
    module subroutine read_pairs(self, deck, places, nodal, status)
      implicit none(type, external)
      type(mechanics_t), intent(inout) :: self
      type(deck_t), intent(in) :: deck
      !> Among the groups `&contact`.
      integer, intent(in) :: places(:)
      !> See `nodal_stiffness`.
      real(wp), intent(in) :: nodal(:, :)
      type(status_t), intent(inout) :: status
    end subroutine read_pairs
  end interface

contains

  module procedure read_contacts

    integer, allocatable :: of_bodies(:), of_tools(:)
    real(wp), allocatable :: nodal(:, :)

    call check_frictions(deck, status)
    if (status%failed()) return
    call sort_contacts(self, deck, of_tools, of_bodies, status)
    if (status%failed()) return
    call nodal_stiffness(self, nodal)
    call read_pairs(self, deck, of_bodies, nodal, status)
    if (status%failed()) return
    call read_tool_contacts(self, deck, of_tools, nodal, status)

  end procedure read_contacts

  !> Collective. Tell contacts with tools from those between bodies; those whose bodies are bonded
  !> are neither.
  subroutine sort_contacts(self, deck, of_tools, of_bodies, status)
    type(mechanics_t), intent(inout) :: self
    type(deck_t), intent(in) :: deck
    !> Places among the groups `&contact`.
    integer, allocatable, intent(out) :: of_tools(:), of_bodies(:)
    type(status_t), intent(inout) :: status

    type(contact_keys_t) :: keys
    type(group_t) :: group
    integer :: i

    allocate (of_tools(0), of_bodies(0))
    do i = 1, deck%count('contact')
      call deck%get('contact', i, group)
      call take_contact(group, keys)
      if (.not. is_between_bodies(self, keys)) then
        of_tools = [of_tools, i]
      else if (is_bonded_away(self, deck, group, keys)) then
        call group%finish(status)
        if (status%failed()) return
        if (self%notes /= '') self%notes = self%notes//new_line('a')
        self%notes = self%notes//'contact '//group%name//': left out, for its surfaces are '// &
          'inside bodies that &interface bonds'
      else
        of_bodies = [of_bodies, i]
      end if
    end do

  end subroutine sort_contacts

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

  !> Collective. True when bodies are bonded and no facet of either side is left at the surface: the
  !> same input serves bonded bodies and bodies in contact.
  function is_bonded_away(self, deck, group, keys) result(is_away)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    !> `&contact`; keeps a fault of its surfaces.
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(in) :: keys
    logical :: is_away

    integer, allocatable :: master(:), slave(:)
    integer(gp) :: n_facet
    type(mesh_interface_t), allocatable :: interfaces(:)
    type(status_t) :: status

    is_away = .false.
    call interfaces_from_deck(deck, interfaces, status)
    if (status%failed() .or. all(interfaces%separates)) return
    call find_sides(self, group, keys, slave, master)
    n_facet = size(slave, kind=gp) + size(master, kind=gp)
    call self%comm%sum(n_facet)
    is_away = n_facet == 0_gp

  end function is_bonded_away

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

  !> Collective. The friction of a contact, which the bodies and the motion must allow.
  subroutine find_friction(self, deck, group, keys, facet, law, status)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    !> Of the slave.
    integer, intent(in) :: facet(:)
    class(friction_law_t), allocatable, intent(out) :: law
    type(status_t), intent(inout) :: status

    type(group_t) :: friction_group
    type(sticking_t) :: bond

    if (keys%tied) then
      call sticking_create(bond)
      allocate (law, source=bond)
    else if (keys%friction == 'none') then
      call default_friction(deck, law, status)
    else
      call deck%find('friction', keys%friction, friction_group, status, from=group, key='friction')
      if (status%failed()) return
      call friction_from_group(friction_group, law, status)
    end if
    if (status%failed()) return
    call check_friction(self, law, group, facet, status)

  end subroutine find_friction

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

  !> Facets of both sides of a contact between bodies.
  subroutine find_sides(self, group, keys, slave, master)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(in) :: keys
    integer, allocatable, intent(out) :: slave(:)
    integer, allocatable, intent(out) :: master(:)

    ! Workaround: gfortran 12, a constructor of this text as the argument breaks the compiler
    character(len=len(keys%slave)) :: name(1)

    name(1) = keys%master
    call find_facets(self, group, key_of_side(keys, 'slave'), keys%slave, slave)
    call find_facets(self, group, key_of_side(keys, 'master'), name, master)

  end subroutine find_sides

  !> Facets of a body, or of groups of its surface.
  subroutine find_facets(self, group, key, names, facet)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    !> Key that named them.
    character(len=*), intent(in) :: key
    character(len=*), intent(in) :: names(:)
    integer, allocatable, intent(out) :: facet(:)

    logical :: touching(self%mesh%n_facet)
    integer :: body, i, j, place

    touching = .false.
    allocate (facet(0))
    do i = 1, size(names)
      body = 0
      do j = 1, size(self%bodies)
        if (self%bodies(j)%name == names(i)) body = j
      end do
      if (body > 0) then
        where (self%body_of_cell(self%mesh%facet_cell) == body) touching = .true.
        do j = 1, size(self%boundaries)
          if (self%boundaries(j)%boundary%kind /= BOUNDARY_SYMMETRY) cycle
          touching(self%boundaries(j)%facet) = .false.
        end do
        if (self%settings%kind == AXISYMMETRIC) call leave_axis(self, touching)
      else if (any([(self%tools(j)%name == names(i), j=1, size(self%tools))])) then
        call group%refuse(key, trim(names(i))//' is a tool: the slave is a &body, or '// &
                          'groups of its surface, and the tool the master')
        return
      else
        place = checked_group(self, group, key, trim(names(i)), self%mesh%dimension - 1)
        if (place == 0) return
        touching(self%mesh%group_facets(place)) = .true.
      end if
    end do
    facet = pack([(i, i=1, size(touching))], touching)

  end subroutine find_facets

  !> The key that a fault of one side of a contact between bodies is laid to.
  pure function key_of_side(keys, side) result(key)
    type(contact_keys_t), intent(in) :: keys
    !> `slave` or `master`.
    character(len=*), intent(in) :: side
    character(len=:), allocatable :: key

    key = side
    if (keys%chooses) key = 'bodies'

  end function key_of_side

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

end submodule swage_mechanics_contact_setup
