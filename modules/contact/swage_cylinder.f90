!> Rigid cylinder: rolls, mandrels and round punches from outside, containers from inside.
module swage_cylinder
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_rigid_shape, only: DIRECTION_TOLERANCE, is_along, rigid_shape_t, shape_context_t, &
                               vector_text
  use swage_rotation, only: dyadic, IDENTITY, normalised, perpendicular
  use swage_status, only: status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: cylinder_t, cylinder_create, cylinder_from_group

  !> A circular cylinder without ends.
  !>
  !> In plane strain its axis is z and it is a circle; in an axisymmetric problem its axis is the
  !> axis of revolution y and it is a mandrel or the wall of a container.
  type, extends(rigid_shape_t) :: cylinder_t
    private
    real(wp) :: point(3) = 0.0_wp
    real(wp) :: axis(3) = 0.0_wp
    real(wp) :: radius = 0.0_wp
    !> 1: material outside; -1: material inside.
    real(wp) :: side = 1.0_wp
  contains
    procedure, public :: project => cylinder_project
  end type cylinder_t

contains

  !> Make a cylinder. On failure `cylinder` must not be used.
  pure subroutine cylinder_create(point, axis, radius, inside, dimension, cylinder, status)
    !> A point of its axis [length].
    real(wp), intent(in) :: point(3)
    !> Direction of its axis; its length does not matter.
    real(wp), intent(in) :: axis(3)
    !> [length], positive.
    real(wp), intent(in) :: radius
    !> True when the material is inside, as in a container.
    logical, intent(in) :: inside
    !> `plane_strain`, `axisymmetric` or `3d`.
    character(len=*), intent(in) :: dimension
    type(cylinder_t), intent(out) :: cylinder
    !> `STATUS_ERROR` when the radius is not positive, the axis is zero or not that of a cylinder
    !> in this dimension.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: why

    if (.not. radius > 0.0_wp) then
      call status%raise(STATUS_ERROR, 'cylinder_create', 'radius: must be above 0 [length]')
      return
    end if
    why = fault_of_axis(axis, dimension)
    if (why /= '') then
      call status%raise(STATUS_ERROR, 'cylinder_create', 'axis_direction = '//vector_text(axis)// &
                        ': '//why)
      return
    end if
    why = fault_of_point(point, radius, dimension)
    if (why /= '') then
      call status%raise(STATUS_ERROR, 'cylinder_create', 'axis_point = '//vector_text(point)// &
                        ': '//why)
      return
    end if

    cylinder%name = 'cylinder'
    cylinder%point = point
    cylinder%axis = normalised(axis)
    if (dimension == 'plane_strain') then
      cylinder%point(3) = 0.0_wp
      cylinder%axis = [0.0_wp, 0.0_wp, 1.0_wp]
    else if (dimension == 'axisymmetric') then
      cylinder%point = [0.0_wp, point(2), 0.0_wp]
      cylinder%axis = [0.0_wp, 1.0_wp, 0.0_wp]
    end if
    cylinder%anchor = cylinder%point
    cylinder%radius = radius
    if (inside) cylinder%side = -1.0_wp

  end subroutine cylinder_create

  !> Make a cylinder from its keys in a group `&tool`; faults of the keys stay in `group`.
  subroutine cylinder_from_group(group, context, shape)
    type(group_t), intent(inout) :: group
    type(shape_context_t), intent(in) :: context
    !> Not allocated when `group` has a fault or is being explained.
    class(rigid_shape_t), allocatable, intent(out) :: shape

    character(len=:), allocatable :: side, why
    real(wp) :: axis(3), point(3), radius
    type(cylinder_t) :: cylinder
    type(status_t) :: status

    point = 0.0_wp
    axis = [0.0_wp, 0.0_wp, 1.0_wp]
    if (context%dimension == 'axisymmetric') axis = [0.0_wp, 1.0_wp, 0.0_wp]
    radius = 0.0_wp
    allocate (side, source='outside')
    call group%take('axis_point', point, 'length', 'A point of the axis of the cylinder.')
    call group%take('axis_direction', axis, '1', &
                    'Direction of the axis of the cylinder; in 2D z, or y when axisymmetric.', &
                    required=context%dimension == '3d')
    call group%take('radius', radius, 'length', 'Radius of the cylinder.', above=0.0_wp, &
                    required=.true.)
    call group%take('side', side, 'Where the material is: outside a roll, inside a container.', &
                    choices=[character(len=7) :: 'outside', 'inside'])
    if (group%explaining .or. group%status%failed()) return

    why = fault_of_axis(axis, context%dimension)
    if (why /= '') call group%refuse('axis_direction', why)
    why = fault_of_point(point, radius, context%dimension)
    if (why /= '') call group%refuse('axis_point', why)
    if (group%status%failed()) return
    call cylinder_create(point, axis, radius, side == 'inside', context%dimension, cylinder, &
                         status)
    allocate (shape, source=cylinder)

  end subroutine cylinder_from_group

  !> What is wrong with the direction of an axis; empty when nothing is.
  pure function fault_of_axis(axis, dimension) result(why)
    real(wp), intent(in) :: axis(3)
    character(len=*), intent(in) :: dimension
    character(len=:), allocatable :: why

    real(wp) :: unit(3)

    why = ''
    unit = normalised(axis)
    if (norm2(unit) < 0.5_wp) then
      why = 'must not be the zero vector'
    else if (dimension == 'plane_strain' .and. .not. is_along(unit, 3)) then
      why = 'must be (0, 0, 1) in plane strain: only then the cylinder is a circle of the plane x-y'
    else if (dimension == 'axisymmetric' .and. .not. is_along(unit, 2)) then
      why = 'must be (0, 1, 0) in an axisymmetric problem: only then the cylinder is a '// &
        'surface of revolution about y'
    end if

  end function fault_of_axis

  !> What is wrong with a point of the axis; empty when nothing is.
  pure function fault_of_point(point, radius, dimension) result(why)
    real(wp), intent(in) :: point(3)
    real(wp), intent(in) :: radius
    character(len=*), intent(in) :: dimension
    character(len=:), allocatable :: why

    why = ''
    if (dimension == 'axisymmetric' .and. &
        max(abs(point(1)), abs(point(3))) > DIRECTION_TOLERANCE * radius) then
      why = 'must lie on the axis of revolution in an axisymmetric problem (first and third '// &
        'component 0)'
    end if

  end function fault_of_point

  !> See [[rigid_shape_t:project]].
  pure subroutine cylinder_project(self, x, penetration, normal, hessian)
    class(cylinder_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: penetration
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    real(wp) :: across(3), distance, outward(3)

    across = x - self%point
    across = across - dot_product(across, self%axis) * self%axis
    distance = norm2(across)
    penetration = self%side * (self%radius - distance)
    if (distance > epsilon(1.0_wp) * self%radius) then
      outward = across / distance
      hessian = self%side / distance &
        * (dyadic(self%axis, self%axis) + dyadic(outward, outward) - IDENTITY)
    else
      outward = perpendicular(self%axis)
      hessian = 0.0_wp
    end if
    normal = self%side * outward

  end subroutine cylinder_project

end module swage_cylinder
