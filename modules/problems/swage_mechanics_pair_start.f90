!> One contact of [[swage_mechanics]] between bodies: its conditions, and how its surfaces are to
!> each other at the start.
submodule(swage_mechanics:swage_mechanics_pair_setup) swage_mechanics_pair_start
  use swage_body_contact, only: body_contact_create
  use swage_contact_formulation_registry, only: contact_formulation_create
  use swage_contact_keys, only: penalty_of
  use swage_contact_pair, only: contact_pair_create
  use swage_contact_state, only: enforcement_t, LAGRANGE
  use swage_facet_quadrature, only: has_facet_quadrature
  implicit none(type, external)

  !> Surfaces so far apart, by the cell size, are tied where the user says nothing else.
  real(wp), parameter :: TIED_REACH = 0.1_wp
  !> What coordinates of surfaces that touch may be apart, by the reach [1].
  real(wp), parameter :: ROUNDING = 1.0e-6_wp

contains

  module procedure create_pair

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
      reach = maxval(all_nodal(2, [surface%facet_node(:, slave), surface%facet_node(:, master)]))
      depth = reach
      if (keys%tied) then
        reach = TIED_REACH * reach
        if (keys%adjusts) reach = max(keys%fit%tolerance, ROUNDING * reach)
        depth = reach
      end if
      call contact_pair_create(self%mesh%dimension, self%settings%kind == AXISYMMETRIC, &
                               surface%facet_node(:, slave), surface%facet_node(:, master), n, &
                               reach, depth, keys%smoothing, keys%feature_angle, &
                               pair%surfaces)
      ! Corners of a surface that folds meet each other, and neither has a side to press on
      pair%surfaces%has_vertices = .not. (keys%tied .or. pair%surfaces%is_self)
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

  end procedure create_pair

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

    logical :: is_slave(pair%surfaces%n_node)
    integer :: n_of_slave

    ! Vertices of the master are few, and touch where no condition of the slave does
    is_slave = .false.
    is_slave(pair%surfaces%slave%node) = .true.
    n_of_slave = count(is_slave(pack(owner, owner > 0)))
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
    else if (n_of_slave > size(pair%surfaces%slave%node)) then
      if (enforcement%kind == LAGRANGE) then
        call group%refuse('enforcement', '''lagrange'' admits one condition for each node of '// &
                          'the slave, which has '//text(size(pair%surfaces%slave%node))// &
                          '; this variant has '//text(n_of_slave)//', more than the '// &
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
    if (pair%warning /= '') pair%warning = pair%warning//new_line('a')
    pair%warning = pair%warning//group%describe(key_of_side(keys, 'master'))//': the bodies '// &
      'share '//text(n_shared)//' nodes of their surfaces, and are bonded where they do: an '// &
      '&interface with treatment = ''contact'' gives each its own'

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

end submodule swage_mechanics_pair_start
