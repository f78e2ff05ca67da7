!> Reading and building of the contacts of [[swage_mechanics]], with tools and between bodies.
submodule(swage_mechanics) swage_mechanics_contact_setup
  use swage_body_contact, only: body_contact_create
  use swage_body_keys, only: interfaces_from_deck
  use swage_boundary, only: BOUNDARY_SYMMETRY
  use swage_contact_formulation_registry, only: contact_formulation_create
  use swage_contact_keys, only: contact_keys_t, penalty_of, refuse_formulation, take_contact
  use swage_contact_pair, only: contact_pair_create, contact_pair_t
  use swage_coupling_matrix, only: coupling_matrix_create
  use swage_contact_state, only: enforcement_t, LAGRANGE
  use swage_facet_quadrature, only: has_facet_quadrature
  use swage_friction, only: friction_law_t
  use swage_friction_registry, only: friction_from_group
  use swage_group, only: group_t, NAME_LENGTH
  use swage_mesh_interface, only: mesh_interface_t
  use swage_shared_surface, only: shared_surface_create
  use swage_slave_choice, only: choose_slave, contact_side_t, measure_sides, warn_of_coarse_slave
  use swage_spelling, only: did_you_mean, listed
  use swage_status, only: STATUS_ERROR
  use swage_sticking, only: sticking_create, sticking_t
  use swage_tool_contact, only: tool_contact_create
  implicit none(type, external)

  !> A tool may overlap the body by this share of the cell size before the first step.
  real(wp), parameter :: LARGEST_OVERLAP = 0.1_wp
  !> Surfaces so far apart, by the cell size, are tied where the user says nothing else.
  real(wp), parameter :: TIED_REACH = 0.1_wp
  !> What coordinates of surfaces that touch may be apart, by the reach [1].
  real(wp), parameter :: ROUNDING = 1.0e-6_wp

contains

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

  end subroutine find_friction

  module procedure read_contacts

    class(friction_law_t), allocatable :: law
    type(contact_keys_t) :: keys
    type(group_t) :: group
    integer, allocatable :: facet(:), left_out(:), node(:), of_tools(:)
    real(wp), allocatable :: nodal(:, :)
    real(wp) :: penalty
    integer :: i, j, tool

    call check_frictions(deck, status)
    if (status%failed()) return
    call nodal_stiffness(self, nodal)
    allocate (of_tools(0), left_out(0))
    do i = 1, deck%count('contact')
      call deck%get('contact', i, group)
      call take_contact(group, keys)
      if (.not. is_between_bodies(self, keys)) then
        of_tools = [of_tools, i]
      else if (is_bonded_away(self, deck, group, keys)) then
        left_out = [left_out, i]
        call group%finish(status)
        if (status%failed()) return
        if (self%notes /= '') self%notes = self%notes//new_line('a')
        self%notes = self%notes//'contact '//group%name//': left out, for its surfaces are '// &
          'inside bodies that &interface bonds'
      end if
    end do
    call read_pairs(self, deck, [of_tools, left_out], nodal, status)
    if (status%failed()) return
    allocate (self%contacts(size(of_tools)))
    do i = 1, size(self%contacts)
      call deck%get('contact', of_tools(i), group)
      call take_contact(group, keys)
      if (keys%chooses) call refuse_choice(self, group, keys)
      call refuse_formulation(group)
      call find_slave(self, group, 'slave', keys%slave, facet)
      call need_surface(self, group, 'slave', facet)
      tool = 0
      do j = 1, size(self%tools)
        if (self%tools(j)%name == keys%master) tool = j
      end do
      if (tool == 0) call refuse_master(self, group, keys%master)
      call group%finish(status)
      if (status%failed()) return
      call find_friction(deck, group, keys, law, status)
      if (status%failed()) return
      call check_friction(self, law, group, facet, status)
      if (status%failed()) return
      call check_pairs(self, i, tool, facet, group, status)
      if (status%failed()) return
      call surface_nodes(self, facet, node)
      penalty = penalty_of(keys, keys%enforcement)
      call tool_contact_create(group%name, tool, law, keys%separation, facet, node, &
                               self%mesh%node_tag(node), nodal(2, node), &
                               penalty * nodal(1, node), &
                               penalty * keys%tangential * nodal(1, node), keys%enforcement, &
                               keys%inertia, self%contacts(i))
      call check_overlap(self, self%contacts(i), group, status)
      if (status%failed()) return
    end do
    call check_controls(self, deck, status)

  end procedure read_contacts

  !> A master must be known.
  subroutine refuse_master(self, group, master)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: master

    character(len=NAME_LENGTH) :: known(size(self%tools) + size(self%bodies))
    integer :: i, n

    if (master == '') return
    n = size(self%tools)
    do i = 1, n
      known(i) = self%tools(i)%name
    end do
    do i = 1, size(self%bodies)
      known(n + i) = self%bodies(i)%name
    end do
    call group%refuse('master', 'there is neither a &tool nor a &body named '''//master//''''// &
                      did_you_mean(master, known)//' Known names: '//listed(known, ', ', '''')// &
                      '; '//self%mesh%explain_group(master, self%mesh%dimension - 1))

  end subroutine refuse_master

  !> The second of two `bodies` is none.
  subroutine refuse_choice(self, group, keys)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(in) :: keys

    integer, allocatable :: ignored(:)

    call find_slave(self, group, 'bodies', [character(len=64) :: keys%slave, keys%master], ignored)

  end subroutine refuse_choice

  !> Collective. Contacts between bodies: their surfaces, conditions and coupling.
  subroutine read_pairs(self, deck, others, nodal, status)
    type(mechanics_t), intent(inout) :: self
    type(deck_t), intent(in) :: deck
    !> Contacts with tools, and those that are left out.
    integer, intent(in) :: others(:)
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

    n = deck%count('contact') - size(others)
    allocate (self%pairs(n))
    if (n == 0) return
    ! Which facets each pair has, as bits of the slave and the master of this rank's facets
    allocate (in_use(2 * n, self%mesh%n_facet), source=0_gp)
    k = 0
    do i = 1, deck%count('contact')
      if (any(others == i)) cycle
      k = k + 1
      call deck%get('contact', i, group)
      call take_contact(group, keys)
      call find_sides(self, group, keys, slave, master)
      call need_surface(self, group, trim(merge('bodies', 'slave ', keys%chooses)), slave)
      call need_surface(self, group, trim(merge('bodies', 'master', keys%chooses)), master)
      call check_sides(self, group, trim(merge('bodies', 'master', keys%chooses)), slave, master)
      call group%finish(status)
      if (status%failed()) return
      in_use(2 * k - 1, slave) = 1_gp
      in_use(2 * k, master) = 1_gp
      call check_doubles(self, deck, others, group, in_use(:2 * k, :), status)
      if (status%failed()) return
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
      if (any(others == i)) cycle
      k = k + 1
      call deck%get('contact', i, group)
      call take_contact(group, keys)
      call find_friction(deck, group, keys, law, status)
      if (status%failed()) return
      call compare_sides(self, group, keys, nodal, in_use(2 * k - 1:2 * k, :), self%pairs(k))
      slave = pack([(i, i=1, size(is_used))], in_use(2 * k - 1, :) > 0_gp)
      call check_friction(self, law, group, slave, status)
      if (status%failed()) return
      call create_pair(self, group, keys, law, on_surface(self, in_use(2 * k - 1, :)), &
                       on_surface(self, in_use(2 * k, :)), nodal, self%pairs(k), status)
      if (status%failed()) return
    end do

  end subroutine read_pairs

  !> Collective. Facets that meet by two contacts would be pushed twice.
  subroutine check_doubles(self, deck, others, group, in_use, status)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    !> Contacts with tools, and those that are left out.
    integer, intent(in) :: others(:)
    !> `&contact`, the last pair so far.
    type(group_t), intent(in) :: group
    !> 1 for the facets of the slave and of the master of each pair so far; shape (:, n_facet).
    integer(gp), intent(in) :: in_use(:, :)
    type(status_t), intent(inout) :: status

    type(group_t) :: earlier
    integer(gp) :: common(4)
    integer :: i, k, last

    last = size(in_use, 1)
    k = 0
    do i = 1, deck%count('contact')
      if (any(others == i)) cycle
      k = k + 2
      if (k == last) return
      associate (slave => in_use(last - 1, :), master => in_use(last, :))
        common = [sum(slave * in_use(k - 1, :)), sum(master * in_use(k, :)), &
                  sum(slave * in_use(k, :)), sum(master * in_use(k - 1, :))]
      end associate
      call self%comm%sum(common)
      if (.not. (all(common(:2) > 0_gp) .or. all(common(3:) > 0_gp))) cycle
      call deck%get('contact', i, earlier)
      call status%raise(STATUS_ERROR, 'check_doubles', group%title//': &contact '''// &
                        earlier%name//''' brings facets of the same two surfaces in touch '// &
                        'already: each pair of surfaces needs one contact, and both passes '// &
                        'over it are formulation = ''symmetric''')
      return
    end do

  end subroutine check_doubles

  !> Collective. Choose the slave where the keys leave that open, else judge it.
  subroutine compare_sides(self, group, keys, nodal, in_use, pair)
    type(mechanics_t), intent(inout) :: self
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    !> See `nodal_stiffness`.
    real(wp), intent(in) :: nodal(:, :)
    !> 1 for the facets of the slave and of the master; exchanged where the second one is to be the
    !> slave; shape (2, n_facet).
    integer(gp), intent(inout) :: in_use(:, :)
    !> Gets what is to be said about it.
    type(body_pair_t), intent(inout) :: pair

    type(contact_pair_t) :: surfaces
    type(contact_side_t) :: sides(2)
    real(wp), allocatable :: all_nodal(:, :)
    integer, allocatable :: master(:), slave(:)
    real(wp) :: reach
    integer :: chosen

    pair%choice = ''
    pair%warning = ''
    if (.not. (keys%chooses .or. keys%formulation == 'master_slave')) return
    allocate (slave, source=on_surface(self, in_use(1, :)))
    allocate (master, source=on_surface(self, in_use(2, :)))
    if (size(slave) == size(master)) then
      if (all(slave == master)) return
    end if
    associate (surface => self%surface)
      allocate (all_nodal(2, surface%n_node))
      call surface%gather(nodal(:2, :), all_nodal)
      call surface%gather(self%mesh%coordinates, self%surface_start)
      reach = maxval(all_nodal(2, :))
      call contact_pair_create(self%mesh%dimension, self%settings%kind == AXISYMMETRIC, &
                               surface%facet_node(:, slave), surface%facet_node(:, master), &
                               surface%n_node, reach, reach, .false., 1.0_wp, surfaces)
      call surfaces%begin_step(self%surface_start)
    end associate
    sides(1)%name = trim(keys%slave(1))
    sides(2)%name = keys%master
    call measure_sides(surfaces, all_nodal(1, :) * all_nodal(2, :), sides(1), sides(2))
    if (keys%chooses) then
      call choose_slave(sides, chosen, pair%choice)
      if (chosen == 2) in_use = in_use([2, 1], :)
    else
      call warn_of_coarse_slave(sides(1), sides(2), pair%warning)
      if (pair%warning /= '') pair%warning = group%describe('slave')//': '//pair%warning
    end if

  end subroutine compare_sides

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

  !> Collective. Both sides of a contact are one surface, or different ones.
  subroutine check_sides(self, group, key, slave, master)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(inout) :: group
    !> That a fault is laid to.
    character(len=*), intent(in) :: key
    integer, intent(in) :: slave(:)
    integer, intent(in) :: master(:)

    logical :: is_slave(self%mesh%n_facet)
    integer(gp) :: n_all(2), n_shared

    is_slave = .false.
    is_slave(slave) = .true.
    n_shared = count(is_slave(master), kind=gp)
    n_all = [size(slave, kind=gp), size(master, kind=gp)]
    call self%comm%sum(n_shared)
    call self%comm%sum(n_all)
    if (n_shared == 0_gp .or. all(n_all == n_shared)) return
    call group%refuse(key, 'gives '//text(int(n_shared))//' facets to both slave and master: '// &
                      'the two sides of a contact must be different surfaces, or one that may '// &
                      'fold onto itself')

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
    type(enforcement_t) :: enforcement
    integer, allocatable :: owner(:)
    real(wp) :: depth, inertia, reach, tangential
    logical :: separates
    integer :: n

    associate (surface => self%surface)
      n = surface%n_node
      allocate (all_nodal(2, n), penalty(n))
      call surface%gather(nodal(:2, :), all_nodal)
      reach = max(maxval(all_nodal(2, reshape(surface%facet_node(:, slave), &
                                              [size(surface%facet_node, 1) * size(slave)]))), &
                  maxval(all_nodal(2, reshape(surface%facet_node(:, master), &
                                              [size(surface%facet_node, 1) * size(master)]))))
      depth = reach
      if (keys%tied) then
        reach = TIED_REACH * reach
        if (keys%adjusts) reach = max(keys%fit%tolerance, ROUNDING * reach)
        depth = reach
      end if
      call contact_pair_create(self%mesh%dimension, self%settings%kind == AXISYMMETRIC, &
                               surface%facet_node(:, slave), surface%facet_node(:, master), n, &
                               reach, depth, keys%smoothing, keys%feature_angle * DEGREE, &
                               pair%surfaces)
      call contact_formulation_create(keys%formulation, keys%choice, pair%formulation)
      if (.not. allocated(pair%formulation)) then
        call group%refuse('projection', 'does not go with formulation '//keys%formulation)
      else if (.not. has_facet_quadrature(self%mesh%dimension, keys%choice%n_point)) then
        call group%refuse('quadrature_points', 'there is no rule with so many points: on a '// &
                          'line 1 to 10, on a triangle 1, 3, 6, 7 or 12')
      end if
      if (allocated(pair%formulation) .and. pair%surfaces%is_self) then
        if (keys%tied) call group%refuse('tied', 'cannot tie a surface to itself')
        if (.not. pair%formulation%admits_self()) then
          call group%refuse('master', 'is the slave itself, whose nodes are on both sides: '// &
                            'this needs formulation = ''symmetric'', or ''quasi_symmetric'' '// &
                            'with projection = ''l2'' and gap = ''dual''')
        end if
      end if
      if (keys%tied .and. pair%surfaces%is_self) then
        call group%refuse('tied', 'has no effect: a surface cannot be tied to itself')
      end if
      call group%finish(status)
      if (status%failed()) return
      call pair%formulation%list_owners(pair%surfaces, owner)
      call choose_multipliers(group, keys, pair, owner, enforcement, status)
      if (status%failed()) return
      penalty = penalty_of(keys, enforcement) &
        * pair_stiffness(surface%facet_node(:, slave), surface%facet_node(:, master), &
                         all_nodal(1, :))
      separates = keys%separation
      tangential = keys%tangential
      inertia = keys%inertia
      if (keys%tied) then
        ! Of the same stiffness in all directions
        separates = .false.
        tangential = 1.0_wp
        inertia = 0.0_wp
      end if
      call body_contact_create(group%name, law, separates, owner, surface%is_own, &
                               surface%mesh_node, all_nodal(2, :), penalty, &
                               tangential * penalty, enforcement, inertia, pair%contact)
      call check_start(self, group, keys, pair, status)
    end associate

  end subroutine create_pair

  !> Multipliers are unknowns where the motion of the nodes can satisfy all conditions at once; else
  !> those of Lagrange are refused.
  subroutine choose_multipliers(group, keys, pair, owner, enforcement, status)
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(in) :: keys
    type(body_pair_t), intent(in) :: pair
    !> Slave node of each condition, 0 where there is none.
    integer, intent(in) :: owner(:)
    type(enforcement_t), intent(out) :: enforcement
    type(status_t), intent(inout) :: status

    enforcement = keys%enforcement
    if (pair%surfaces%is_self) then
      if (enforcement%kind == LAGRANGE) then
        call group%refuse('enforcement', '''lagrange'' does not go with a surface that folds '// &
                          'onto itself, where both sides have conditions, more than they can '// &
                          'satisfy: take enforcement ''augmented_lagrangian''')
      end if
      enforcement%within_newton = .false.
    else if (.not. pair%formulation%admits_multipliers()) then
      if (enforcement%kind == LAGRANGE) then
        call group%refuse('enforcement', '''lagrange'' does not go with formulation '// &
                          keys%formulation//', whose conditions on both sides are more than '// &
                          'the surfaces can satisfy: take formulation ''quasi_symmetric'' or '// &
                          'enforcement ''augmented_lagrangian''')
      end if
      enforcement%within_newton = .false.
    else if (count(owner > 0) > size(pair%surfaces%slave%node)) then
      if (enforcement%kind == LAGRANGE) then
        call group%refuse('enforcement', '''lagrange'' admits one condition for each node of '// &
                          'the slave, which has '//text(size(pair%surfaces%slave%node))// &
                          '; this variant has '//text(count(owner > 0))//', more than the '// &
                          'surfaces can satisfy: take variant ''nodal'', formulation '// &
                          '''quasi_symmetric'' or enforcement ''augmented_lagrangian''')
      end if
      enforcement%within_newton = .false.
    end if
    call group%finish(status)

  end subroutine choose_multipliers

  !> Mean stiffnesses of both sides, one behind the other: the softer decides. One for all nodes, so
  !> that a uniform pressure needs a uniform penetration, whatever the sizes of the cells.
  pure function pair_stiffness(slave, master, stiffness) result(together)
    !> Corners of facets; shape (n_dim, :).
    integer, intent(in) :: slave(:, :), master(:, :)
    !> Of the surface nodes [stress/length]; shape (n_node).
    real(wp), intent(in) :: stiffness(:)
    real(wp) :: together

    real(wp) :: one, other

    one = sum(stiffness(reshape(slave, [size(slave)]))) / max(size(slave), 1)
    other = sum(stiffness(reshape(master, [size(master)]))) / max(size(master), 1)
    together = 2.0_wp * one * other / (one + other)

  end function pair_stiffness

  !> Collective. Bodies drawn into each other are a mistake in the input, unless the keys take the
  !> overlap away, or in some time.
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
    call doubt_pair(self, group, keys, pair)
    if (keys%tied) then
      call bind_pair(self, group, keys, pair, status)
      return
    end if
    call pair%contact%adjust(pair%rows, keys%fit)
    if (any(pair%surfaces%is_buried)) then
      call status%raise(STATUS_ERROR, 'check_start', group%describe('master')//': at the start '// &
                        text(count(pair%surfaces%is_buried))//' facets of the two surfaces are '// &
                        'inside the other body deeper than their cells ('// &
                        text(pair%surfaces%depth)//' [length]): draw the bodies apart')
      return
    end if
    if (keys%fit%duration > 0.0_wp) then
      call need_overlap(self, group, keys, pair, status)
      return
    end if
    deepest = keys%fit%tolerance
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
                        'cells: draw the bodies apart, or give `adjust` or '// &
                        '`interference_duration`')
    end if
    call self%comm%agree(status)

  end subroutine check_start

  !> Collective. Say what may be meant otherwise: bodies that share nodes cannot part there, and
  !> surfaces that do not meet at the start may never do.
  subroutine doubt_pair(self, group, keys, pair)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    type(body_pair_t), intent(inout) :: pair

    character(len=:), allocatable :: key
    integer(gp) :: n_row
    integer :: i, n_shared
    logical :: are_bodies(2), is_master(self%surface%n_node)

    n_row = int(pair%rows%n_row, gp)
    call self%comm%sum(n_row)
    if (n_row == 0_gp .and. .not. keys%tied) then
      if (pair%choice /= '') pair%choice = pair%choice//'; '
      pair%choice = pair%choice//'at the start nowhere within '//text(pair%surfaces%reach)// &
        ' [length] of each other'
    end if
    are_bodies = [(any([(self%bodies(i)%name == keys%slave(1), i=1, size(self%bodies))])), &
                  (any([(self%bodies(i)%name == keys%master, i=1, size(self%bodies))]))]
    if (pair%surfaces%is_self .or. .not. all(are_bodies)) return
    is_master = .false.
    is_master(pair%surfaces%master%node) = .true.
    n_shared = count(is_master(pair%surfaces%slave%node))
    if (n_shared == 0) return
    key = trim(merge('bodies', 'master', keys%chooses))
    if (pair%warning /= '') pair%warning = pair%warning//new_line('a')
    pair%warning = pair%warning//group%describe(key)//': the bodies share '//text(n_shared)// &
      ' nodes of their surfaces, and are bonded where they do: an &interface with treatment = '// &
      '''contact'' gives each its own'

  end subroutine doubt_pair

  !> Collective. An overlap that comes about in some time must be there.
  subroutine need_overlap(self, group, keys, pair, status)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    type(body_pair_t), intent(in) :: pair
    type(status_t), intent(inout) :: status

    !> Overlap by the cell that rounding leaves.
    real(wp), parameter :: NONE = 1.0e-9_wp

    real(wp) :: deepest

    deepest = 0.0_wp
    if (pair%rows%n_row > 0) deepest = max(deepest, maxval(pair%rows%gap(:pair%rows%n_row)))
    call self%comm%max(deepest)
    if (keys%fit%interference > 0.0_wp) return
    if (deepest > max(keys%fit%tolerance, NONE * pair%surfaces%reach)) return
    call status%raise(STATUS_ERROR, 'need_overlap', group%describe('interference_duration')// &
                      ' has no effect: at the start no overlap is larger than `adjust`, and '// &
                      'there is no `interference`')

  end subroutine need_overlap

  !> Collective. Tie two surfaces where they meet.
  subroutine bind_pair(self, group, keys, pair, status)
    type(mechanics_t), intent(in) :: self
    type(group_t), intent(in) :: group
    type(contact_keys_t), intent(in) :: keys
    type(body_pair_t), intent(inout) :: pair
    type(status_t), intent(inout) :: status

    integer(gp) :: n_tied

    n_tied = int(pair%rows%n_row, gp)
    call self%comm%sum(n_tied)
    if (n_tied == 0_gp) then
      if (keys%adjusts) then
        call status%raise(STATUS_ERROR, 'bind_pair', group%describe('adjust')//': nowhere are '// &
                          'the surfaces so close to each other: nothing is tied')
      else
        call status%raise(STATUS_ERROR, 'bind_pair', group%describe('tied')//': nowhere are '// &
                          'the surfaces within '//text(pair%surfaces%reach)//' [length] of '// &
                          'each other, a tenth of a cell: let them touch, or give `adjust`')
      end if
      return
    end if
    call pair%contact%bind(self%mesh%dimension, pair%rows, self%surface_start)

  end subroutine bind_pair

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
    call find_slave(self, group, trim(merge('bodies', 'slave ', keys%chooses)), keys%slave, slave)
    call find_slave(self, group, trim(merge('bodies', 'master', keys%chooses)), name, master)

  end subroutine find_sides

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
end submodule swage_mechanics_contact_setup
