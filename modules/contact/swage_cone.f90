!> Rigid cone between two cylinders: conical dies, tapered punches and mandrels, pointed indenters.
module swage_cone
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_profile, only: profile_create, profile_parameters_t, profile_t
  use swage_rigid_shape, only: rigid_shape_t, shape_context_t
  use swage_status, only: status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: cone_create, cone_from_group

  character(len=*), parameter :: NO_PLANE_STRAIN = &
    'a cone is no surface of plane strain: use shape = ''profile'''

contains

  !> Make a cone: a revolved profile of three pieces. On failure `cone` must not be used.
  !>
  !> Between its two heights the surface is a cone, beyond them a cylinder of the radius there:
  !> without end, or none where the radius is 0.
  pure subroutine cone_create(axis_point, axis_direction, heights, radii, fillets, inside, cone, &
                              key, status)
    !> Point of the axis from which heights count [length].
    real(wp), intent(in) :: axis_point(3)
    !> Direction of the axis; its length does not matter.
    real(wp), intent(in) :: axis_direction(3)
    !> Different from each other [length].
    real(wp), intent(in) :: heights(2)
    !> At these heights [length], at least 0, different from each other.
    real(wp), intent(in) :: radii(2)
    !> Radii of the arcs between cone and cylinders, or of the sphere at the tip [length], at
    !> least 0.
    real(wp), intent(in) :: fillets(2)
    !> True when the material is inside, as in a die.
    logical, intent(in) :: inside
    type(profile_t), intent(out) :: cone
    !> The parameter that is wrong, on failure.
    character(len=:), allocatable, intent(out) :: key
    !> `STATUS_ERROR` when heights or radii make no cone, or the fillets do not fit.
    type(status_t), intent(inout) :: status

    integer :: lower, upper
    real(wp) :: length
    type(profile_parameters_t) :: p

    if (.not. abs(heights(2) - heights(1)) > 0.0_wp) then
      key = 'heights'
      call status%raise(STATUS_ERROR, 'cone_create', 'must be different from each other')
      return
    end if
    if (minval(radii) < 0.0_wp .or. .not. abs(radii(2) - radii(1)) > 0.0_wp) then
      key = 'radii'
      call status%raise(STATUS_ERROR, 'cone_create', 'must be at least 0 and different from '// &
                        'each other: with equal ones use shape = ''cylinder''')
      return
    end if

    lower = merge(1, 2, heights(1) < heights(2))
    upper = 3 - lower
    ! The arcs end within this length of the cylinders, whose end the profile does not know
    length = abs(heights(2) - heights(1)) + sum(radii) + sum(fillets)
    allocate (p%points(2, 4), p%fillets(4))
    p%points(:, 1) = [radii(lower), heights(lower) - length]
    p%points(:, 2) = [radii(lower), heights(lower)]
    p%points(:, 3) = [radii(upper), heights(upper)]
    p%points(:, 4) = [radii(upper), heights(upper) + length]
    p%fillets = [0.0_wp, fillets(lower), fillets(upper), 0.0_wp]
    if (.not. radii(lower) > 0.0_wp) then
      p%points = p%points(:, 2:)
      p%fillets = p%fillets(2:)
    else if (.not. radii(upper) > 0.0_wp) then
      p%points = p%points(:, :3)
      p%fillets = p%fillets(:3)
    end if
    p%material_left = inside
    p%revolved = .true.
    p%axis_point = axis_point
    p%axis_direction = axis_direction
    call profile_create('cone', p, cone, key, status)

  end subroutine cone_create

  !> Make a cone from its keys in a group `&tool`; faults of the keys stay in `group`.
  subroutine cone_from_group(group, context, shape)
    type(group_t), intent(inout) :: group
    type(shape_context_t), intent(in) :: context
    !> Not allocated when `group` has a fault or is being explained.
    class(rigid_shape_t), allocatable, intent(out) :: shape

    character(len=:), allocatable :: key, side
    real(wp) :: axis_direction(3), axis_point(3), fillets(2), heights(2), radii(2)
    type(profile_t) :: cone
    type(status_t) :: status

    axis_point = 0.0_wp
    axis_direction = [0.0_wp, 1.0_wp, 0.0_wp]
    heights = 0.0_wp
    radii = 0.0_wp
    fillets = 0.0_wp
    allocate (side, source='')
    if (context%dimension == 'plane_strain') call group%refuse('shape', NO_PLANE_STRAIN)
    if (context%dimension == '3d') then
      call group%take('axis_point', axis_point, 'length', &
                      'In 3D, point of the axis from which heights count.')
      call group%take('axis_direction', axis_direction, '1', &
                      'In 3D, direction of the axis; heights count along it.', required=.true.)
    end if
    call group%take('heights', heights, 'length', &
                    'Where the cone begins and ends along the axis (y when axisymmetric); '// &
                    'beyond them it goes on as cylinders.', required=.true.)
    call group%take('radii', radii, 'length', 'Radii at these heights; 0 is a tip.', &
                    lower=0.0_wp, required=.true.)
    call group%take('fillets', fillets, 'length', 'Radii of the arcs at these heights, between '// &
                    'cone and cylinder or of the tip.', lower=0.0_wp)
    call group%take('side', side, 'Where the material is: inside a die, outside a punch.', &
                    choices=[character(len=7) :: 'inside', 'outside'], required=.true.)
    if (group%explaining .or. group%status%failed()) return

    call cone_create(axis_point, axis_direction, heights, radii, fillets, side == 'inside', cone, &
                     key, status)
    if (status%failed()) then
      if (key == 'points') key = 'radii'
      call group%refuse(key, trim(status%message))
      return
    end if
    allocate (shape, source=cone)

  end subroutine cone_from_group

end module swage_cone
