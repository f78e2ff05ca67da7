!> Rigid sphere: balls and round-nosed punches from outside, sockets from inside.
module swage_sphere
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_rigid_shape, only: DIRECTION_TOLERANCE, rigid_shape_t, shape_context_t, &
                               vector_text
  use swage_rotation, only: dyadic, IDENTITY
  use swage_status, only: status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: sphere_t, sphere_create, sphere_from_group

  character(len=*), parameter :: NO_PLANE_STRAIN = &
    'a sphere is no surface of plane strain: use shape = ''cylinder'''

  !> A sphere; in an axisymmetric problem its centre is on the axis of revolution y.
  type, extends(rigid_shape_t) :: sphere_t
    private
    real(wp) :: centre(3) = 0.0_wp
    real(wp) :: radius = 0.0_wp
    !> 1: material outside; -1: material inside.
    real(wp) :: side = 1.0_wp
  contains
    procedure, public :: project => sphere_project
  end type sphere_t

contains

  !> Make a sphere. On failure `sphere` must not be used.
  pure subroutine sphere_create(centre, radius, inside, dimension, sphere, status)
    !> [length]
    real(wp), intent(in) :: centre(3)
    !> [length], positive.
    real(wp), intent(in) :: radius
    !> True when the material is inside, as in a socket.
    logical, intent(in) :: inside
    !> `axisymmetric` or `3d`; `plane_strain` is refused.
    character(len=*), intent(in) :: dimension
    type(sphere_t), intent(out) :: sphere
    !> `STATUS_ERROR` when the radius is not positive or the sphere is not one in this dimension.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: why

    if (.not. radius > 0.0_wp) then
      call status%raise(STATUS_ERROR, 'sphere_create', 'radius: must be above 0 [length]')
      return
    end if
    why = fault_of_centre(centre, radius, dimension)
    if (dimension == 'plane_strain') why = NO_PLANE_STRAIN
    if (why /= '') then
      call status%raise(STATUS_ERROR, 'sphere_create', 'centre = '//vector_text(centre)//': '//why)
      return
    end if

    sphere%name = 'sphere'
    sphere%centre = centre
    if (dimension == 'axisymmetric') sphere%centre = [0.0_wp, centre(2), 0.0_wp]
    sphere%anchor = sphere%centre
    sphere%radius = radius
    if (inside) sphere%side = -1.0_wp

  end subroutine sphere_create

  !> Make a sphere from its keys in a group `&tool`; faults of the keys stay in `group`.
  subroutine sphere_from_group(group, context, shape)
    type(group_t), intent(inout) :: group
    type(shape_context_t), intent(in) :: context
    !> Not allocated when `group` has a fault or is being explained.
    class(rigid_shape_t), allocatable, intent(out) :: shape

    character(len=:), allocatable :: side, why
    real(wp) :: centre(3), radius
    type(sphere_t) :: sphere
    type(status_t) :: status

    centre = 0.0_wp
    radius = 0.0_wp
    allocate (side, source='outside')
    call group%take('centre', centre, 'length', 'Centre of the sphere.', required=.true.)
    call group%take('radius', radius, 'length', 'Radius of the sphere.', above=0.0_wp, &
                    required=.true.)
    call group%take('side', side, 'Where the material is: outside a ball, inside a socket.', &
                    choices=[character(len=7) :: 'outside', 'inside'])
    if (group%explaining .or. group%status%failed()) return

    if (context%dimension == 'plane_strain') call group%refuse('shape', NO_PLANE_STRAIN)
    why = fault_of_centre(centre, radius, context%dimension)
    if (why /= '') call group%refuse('centre', why)
    if (group%status%failed()) return
    call sphere_create(centre, radius, side == 'inside', context%dimension, sphere, status)
    allocate (shape, source=sphere)

  end subroutine sphere_from_group

  !> What is wrong with a centre; empty when nothing is.
  pure function fault_of_centre(centre, radius, dimension) result(why)
    real(wp), intent(in) :: centre(3)
    real(wp), intent(in) :: radius
    character(len=*), intent(in) :: dimension
    character(len=:), allocatable :: why

    why = ''
    if (dimension == 'axisymmetric' .and. &
        max(abs(centre(1)), abs(centre(3))) > DIRECTION_TOLERANCE * radius) then
      why = 'must lie on the axis of revolution in an axisymmetric problem (first and third '// &
        'component 0): elsewhere the sphere would be a torus'
    end if

  end function fault_of_centre

  !> See [[rigid_shape_t:project]].
  pure subroutine sphere_project(self, x, penetration, normal, hessian)
    class(sphere_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: penetration
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    real(wp) :: distance, outward(3)

    outward = x - self%centre
    distance = norm2(outward)
    penetration = self%side * (self%radius - distance)
    if (distance > epsilon(1.0_wp) * self%radius) then
      outward = outward / distance
      hessian = self%side / distance * (dyadic(outward, outward) - IDENTITY)
    else
      outward = IDENTITY(:, 2)
      hessian = 0.0_wp
    end if
    normal = self%side * outward

  end subroutine sphere_project

end module swage_sphere
