!> Rigid plane: flat dies, anvils, symmetry walls that may open.
module swage_plane
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_rigid_shape, only: DIRECTION_TOLERANCE, is_along, rigid_shape_t, shape_context_t, &
                               vector_text
  use swage_rotation, only: normalised
  use swage_status, only: status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: plane_t, plane_create, plane_from_group

  !> An unbounded plane; the tool is the half space behind it.
  type, extends(rigid_shape_t) :: plane_t
    private
    real(wp) :: point(3) = 0.0_wp
    real(wp) :: normal(3) = 0.0_wp
  contains
    procedure, public :: project => plane_project
  end type plane_t

contains

  !> Make a plane. On failure `plane` must not be used.
  pure subroutine plane_create(point, normal, dimension, plane, status)
    !> Any of its points [length].
    real(wp), intent(in) :: point(3)
    !> Out of the tool, towards the material; its length does not matter.
    real(wp), intent(in) :: normal(3)
    !> `plane_strain`, `axisymmetric` or `3d`.
    character(len=*), intent(in) :: dimension
    type(plane_t), intent(out) :: plane
    !> `STATUS_ERROR` when the normal is zero or the plane is not one in this dimension.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: why

    why = fault(normal, dimension)
    if (why /= '') then
      call status%raise(STATUS_ERROR, 'plane_create', 'normal = '//vector_text(normal)//': '//why)
      return
    end if
    plane%name = 'plane'
    plane%point = point
    plane%anchor = point
    plane%normal = normalised(normal)
    if (dimension /= '3d') plane%normal(3) = 0.0_wp

  end subroutine plane_create

  !> Make a plane from its keys in a group `&tool`; faults of the keys stay in `group`.
  subroutine plane_from_group(group, context, shape)
    type(group_t), intent(inout) :: group
    type(shape_context_t), intent(in) :: context
    !> Not allocated when `group` has a fault or is being explained.
    class(rigid_shape_t), allocatable, intent(out) :: shape

    character(len=:), allocatable :: why
    real(wp) :: normal(3), point(3)
    type(plane_t) :: plane
    type(status_t) :: status

    point = 0.0_wp
    normal = 0.0_wp
    call group%take('point', point, 'length', 'A point of the plane.', required=.true.)
    call group%take('normal', normal, '1', 'Direction out of the tool, towards the material.', &
                    required=.true.)
    if (group%explaining .or. group%status%failed()) return

    why = fault(normal, context%dimension)
    if (why /= '') then
      call group%refuse('normal', why)
      return
    end if
    call plane_create(point, normal, context%dimension, plane, status)
    allocate (shape, source=plane)

  end subroutine plane_from_group

  !> What is wrong with a normal; empty when nothing is.
  pure function fault(normal, dimension) result(why)
    real(wp), intent(in) :: normal(3)
    character(len=*), intent(in) :: dimension
    character(len=:), allocatable :: why

    real(wp) :: unit(3)

    why = ''
    unit = normalised(normal)
    if (norm2(unit) < 0.5_wp) then
      why = 'must not be the zero vector'
    else if (dimension == 'plane_strain' .and. abs(unit(3)) > DIRECTION_TOLERANCE) then
      why = 'must lie in the plane x-y in plane strain (third component 0)'
    else if (dimension == 'axisymmetric' .and. .not. is_along(unit, 2)) then
      why = 'must be (0, 1, 0) or (0, -1, 0) in an axisymmetric problem: a plane not at '// &
        'right angles to the axis of revolution y would be a cone'
    end if

  end function fault

  !> See [[rigid_shape_t:project]].
  pure subroutine plane_project(self, x, penetration, normal, hessian)
    class(plane_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: penetration
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    penetration = dot_product(self%point - x, self%normal)
    normal = self%normal
    hessian = 0.0_wp

  end subroutine plane_project

end module swage_plane
