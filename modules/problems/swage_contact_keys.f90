!> The group `&contact`: what two surfaces that meet do to each other.
module swage_contact_keys
  use swage_body_contact, only: start_fit_t
  use swage_contact_formulation, only: CHOICE_LENGTH, contact_choice_t
  use swage_contact_formulation_registry, only: contact_formulation_names
  use swage_contact_surface, only: DEFAULT_FEATURE_ANGLE
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_text, only: text
  use swage_tool_contact, only: enforcement_t, ENFORCEMENT_NAMES, LAGRANGE, PENALTY
  implicit none(type, external)
  private

  public :: contact_keys_t, penalty_of, take_contact, refuse_formulation

  !> Penetration by the cell size that Lagrange multipliers may leave, unless the user says else.
  real(wp), parameter :: CLOSED = 1.0e-8_wp
  !> Penalty factor beyond which multipliers that are unknowns gain nothing, and lose digits.
  real(wp), parameter :: STIFFEST = 10.0_wp

  !> What a group `&contact` says; the names in it are still to be looked up.
  type :: contact_keys_t
    character(len=64), allocatable :: slave(:)
    character(len=:), allocatable :: master
    !> The two are named without saying which is which.
    logical :: chooses = .false.
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
    !> [angle], radian.
    real(wp) :: feature_angle = DEFAULT_FEATURE_ANGLE
    type(start_fit_t) :: fit
    !> Surfaces stay together as they are drawn, those up to `adjust` apart where it is given.
    logical :: tied = .false.
    logical :: adjusts = .false.
  end type contact_keys_t

  !> Stiffness of a tie by that of a cell where the user gives none: its conditions are linear and
  !> never change, so that nothing speaks for a soft one but rounding [1].
  real(wp), parameter :: STIFF_TIE = 100.0_wp

contains

  !> The only place where the keys of `&contact` are named.
  subroutine take_contact(group, keys)
    type(group_t), intent(inout) :: group
    type(contact_keys_t), intent(out) :: keys

    character(len=64), allocatable :: bodies(:)
    character(len=:), allocatable :: kind

    allocate (bodies(0), keys%slave(0))
    keys%master = ''
    call group%take_list('bodies', bodies, 'In place of `slave` and `master`: names of two '// &
                         '&body, or of groups of their surfaces, of which the finer becomes '// &
                         'the slave, or the softer where both are about as fine.')
    keys%chooses = group%given('bodies')
    keys%friction = 'none'
    allocate (kind, source=trim(ENFORCEMENT_NAMES(PENALTY)))
    call group%take_list('slave', keys%slave, 'Name of a &body, whose whole surface except '// &
                         'symmetry planes may touch, or physical groups of its surface.', &
                         required=group%explaining .or. (group%given('master') &
                                                         .and. .not. keys%chooses))
    call group%take('master', keys%master, 'Name of the &tool, of another &body, or of a '// &
                    'physical group of its surface.', required=group%explaining .or. &
                    (group%given('slave') .and. .not. keys%chooses))
    if (keys%chooses) then
      call take_sides(group, bodies, keys)
    else if (.not. (group%explaining .or. group%given('slave') .or. group%given('master'))) then
      call group%refuse('slave', 'must be given with `master`, or `bodies` for both')
    end if
    call group%take('friction', keys%friction, 'Name of the &friction; ''none'': frictionless.')
    call group%take('enforcement', kind, 'Pressure by penetration; multipliers that bring '// &
                    'the penetration below a tolerance; or multipliers as unknowns, which '// &
                    'leave none.', choices=ENFORCEMENT_NAMES)
    keys%enforcement%kind = findloc(ENFORCEMENT_NAMES == kind, .true., dim=1)
    if (keys%enforcement%kind == LAGRANGE) keys%enforcement%penetration_tolerance = CLOSED
    call group%take('penalty_factor', keys%penalty, '1', 'Contact pressure by penetration, as '// &
                    'a multiple of the stiffness of a cell; without it 100 where surfaces are '// &
                    'tied. With multipliers as unknowns the result does not depend on it, and '// &
                    'a larger one than '//text(STIFFEST)//' counts as that.', above=0.0_wp)
    call group%take('tangential_factor', keys%tangential, '1', 'Friction stress by slip of a '// &
                    'law that bonds, as a multiple of that of the pressure.', above=0.0_wp)
    associate (rule => keys%enforcement)
      call group%take('penetration_tolerance', rule%penetration_tolerance, '1', 'Penetration, '// &
                      'by the cell size, below which multipliers are left alone; of '// &
                      '''lagrange'' by default '//text(CLOSED)//'.', above=0.0_wp)
      call group%take('multiplier_tolerance', rule%multiplier_tolerance, '1', 'Change of '// &
                      'multipliers, by the largest pressure, below which they are left alone.', &
                      above=0.0_wp)
      call group%take('maximum_augmentations', rule%maximum_augmentations, 'Changes of '// &
                      'multipliers in an increment after which it is taken as it is.', lower=1)
    end associate
    call group%take('sliding_inertia', keys%inertia, '1', 'Resistance of nodes that rub on the '// &
                    'master to a slip that deviates by more than 5 % of a cell from that of '// &
                    'the last increments, as a multiple of the flow stress by the cell size: '// &
                    'keeps nodes at an edge from snapping.', lower=0.0_wp)
    call group%take('separation', keys%separation, 'False: what touches stays on the master, '// &
                    'and the contact carries tension.')
    call take_formulation(group, keys)
    if (keys%tied .and. .not. group%given('penalty_factor')) keys%penalty = STIFF_TIE
    if (keys%tied .and. keys%enforcement%kind == LAGRANGE) then
      call group%refuse('enforcement', '''lagrange'' has multipliers of the pressure alone, '// &
                        'and a tie holds in all directions: ''augmented_lagrangian'' has them '// &
                        'for all')
    end if
    keys%enforcement%within_newton = keys%enforcement%kind /= PENALTY .and. .not. keys%tied
    keys%enforcement%cell_share = 1.0_wp / penalty_of(keys, keys%enforcement)
    if (group%explaining .or. keys%enforcement%kind /= PENALTY) return
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

  !> Two bodies; the first one counts as the slave until one is chosen.
  subroutine take_sides(group, bodies, keys)
    type(group_t), intent(inout) :: group
    character(len=64), intent(in) :: bodies(:)
    type(contact_keys_t), intent(inout) :: keys

    if (group%given('slave')) then
      call group%refuse('slave', 'is one too many: `bodies` names both sides')
    else if (group%given('master')) then
      call group%refuse('master', 'is one too many: `bodies` names both sides')
    else if (size(bodies) /= 2) then
      call group%refuse('bodies', 'must be the names of two bodies')
    else if (bodies(1) == bodies(2)) then
      call group%refuse('bodies', 'are the same: name two')
    end if
    deallocate (keys%slave)
    allocate (keys%slave(1))
    keys%slave = ''
    if (size(bodies) > 0) keys%slave(1) = bodies(1)
    if (size(bodies) > 1) keys%master = trim(bodies(2))

  end subroutine take_sides

  !> Penalty by the stiffness of a cell.
  pure function penalty_of(keys, enforcement) result(penalty)
    type(contact_keys_t), intent(in) :: keys
    !> As it is for the formulation.
    type(enforcement_t), intent(in) :: enforcement
    !> [1]
    real(wp) :: penalty

    penalty = keys%penalty
    if (enforcement%within_newton) penalty = min(penalty, STIFFEST)

  end function penalty_of

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
    call group%take('smoothing', keys%smoothing, 'Facets curved to normals interpolated '// &
                    'between nodes, instead of flat ones.')
    call group%take('feature_angle', keys%feature_angle, 'angle', 'Facets that meet at a '// &
                    'larger angle, in radian, keep a sharp edge.', above=0.0_wp, upper=1.5_wp)
    call group%take('adjust', keys%fit%tolerance, 'length', 'Gaps and overlaps of the drawing '// &
                    'up to this size count as none.', lower=0.0_wp)
    call group%take('interference', keys%fit%interference, 'length', 'Overlap that bodies have '// &
                    'on top of what is drawn, as of a shrink fit.', lower=0.0_wp)
    call group%take('interference_duration', keys%fit%duration, 'time', 'Time from the start '// &
                    'over which that overlap, and one drawn beyond `adjust`, comes about; 0: '// &
                    'in the first increment.', lower=0.0_wp)
    keys%adjusts = group%given('adjust')
    call group%take('tied', keys%tied, 'True: where surfaces meet at the start, up to `adjust` '// &
                    'or a tenth of a cell apart, they stay together as they are drawn and '// &
                    'neither part nor slide.')
    call check_formulation(group, keys%formulation, variant, projection, quadrature)
    if (keys%tied) call check_tie(group, keys%formulation, projection, gap)
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

  !> A tie is made by the projection of least squares, and has no friction.
  subroutine check_tie(group, formulation, projection, gap)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: formulation, projection, gap

    character(len=21), parameter :: KEYS(6) = [character(len=21) :: 'friction', &
      'tangential_factor', 'sliding_inertia', 'separation', 'interference', &
      'interference_duration']
    integer :: i

    if (group%explaining) return
    do i = 1, size(KEYS)
      if (group%given(trim(KEYS(i)))) then
        call group%refuse(trim(KEYS(i)), 'has no effect: tied surfaces neither slide nor part')
      end if
    end do
    if (formulation /= 'quasi_symmetric') then
      call group%refuse('formulation', 'cannot tie surfaces: ''quasi_symmetric'' does')
    else if (projection /= 'l2') then
      call group%refuse('projection', 'cannot tie surfaces: ''l2'' does')
    else if (gap /= 'dual') then
      call group%refuse('gap', 'cannot be that of tied surfaces: ''dual'' is')
    end if

  end subroutine check_tie

  !> Keys that mean nothing where the master is a tool.
  subroutine refuse_formulation(group)
    type(group_t), intent(inout) :: group

    character(len=21), parameter :: KEYS(12) = [character(len=21) :: 'formulation', 'variant', &
      'projection', 'gap', 'quadrature', 'quadrature_points', 'smoothing', 'feature_angle', &
      'adjust', 'interference', 'interference_duration', 'tied']
    integer :: i

    do i = 1, size(KEYS)
      if (group%given(trim(KEYS(i)))) then
        call group%refuse(trim(KEYS(i)), 'has no effect: the master is a tool')
      end if
    end do

  end subroutine refuse_formulation

end module swage_contact_keys
