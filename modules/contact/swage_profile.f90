!> Rigid tools drawn as a profile: dies, containers, punches with rounded edges, rings, cones.
module swage_profile
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_profile_curve, only: profile_curve_create, profile_curve_t
  use swage_rigid_shape, only: rigid_shape_t, shape_context_t, shape_picture_t, &
                               shape_view_t
  use swage_rotation, only: cross_product, dyadic, IDENTITY, normalised, perpendicular
  use swage_status, only: status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: profile_t, profile_parameters_t, profile_create, profile_from_group

  !> A profile and how it becomes a surface.
  type :: profile_parameters_t
    !> Corners [length]; shape (2, n).
    real(wp), allocatable :: points(:, :)
    !> Radii of the arcs at the corners [length]; see [[profile_curve_create]].
    real(wp), allocatable :: fillets(:)
    logical :: closed = .false.
    !> True when the material is to the left of the way from the first point to the last.
    logical :: material_left = .true.
    !> True when the points are (distance from the axis, height along it), not (x, y) in the plane
    !> at right angles to the axis.
    logical :: revolved = .false.
    !> A point of the axis, the origin of the profile [length].
    real(wp) :: axis_point(3) = 0.0_wp
    !> Direction of the axis; its length does not matter.
    real(wp) :: axis_direction(3) = [0.0_wp, 0.0_wp, 1.0_wp]
    !> Direction of the first coordinate of a profile that is not revolved; only its part at right
    !> angles to the axis counts.
    real(wp) :: first_direction(3) = [1.0_wp, 0.0_wp, 0.0_wp]
  end type profile_parameters_t

  !> A plane curve of straight pieces and arcs, revolved about an axis or moved along it.
  type, extends(rigid_shape_t) :: profile_t
    private
    type(profile_curve_t) :: curve
    logical :: revolved = .false.
    real(wp) :: point(3) = 0.0_wp
    real(wp) :: axis(3) = 0.0_wp
    !> Directions of the coordinates of a profile that is not revolved.
    real(wp) :: first(3) = 0.0_wp
    real(wp) :: second(3) = 0.0_wp
    !> A distance from the axis that counts as 0 [length].
    real(wp) :: smallest = 0.0_wp
  contains
    procedure, public :: project => profile_project
    procedure, public :: draw => profile_draw
  end type profile_t

contains

  !> Make a profile. On failure `profile` must not be used.
  pure subroutine profile_create(name, parameters, profile, key, status)
    !> What the key `shape` calls it.
    character(len=*), intent(in) :: name
    type(profile_parameters_t), intent(in) :: parameters
    type(profile_t), intent(out) :: profile
    !> The parameter that is wrong, on failure.
    character(len=:), allocatable, intent(out) :: key
    !> `STATUS_ERROR` when the points make no such curve, or a direction none.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: why
    real(wp), allocatable :: fillets(:)

    profile%name = name
    profile%revolved = parameters%revolved
    profile%point = parameters%axis_point
    profile%axis = normalised(parameters%axis_direction)
    if (norm2(profile%axis) < 0.5_wp) then
      key = 'axis_direction'
      call status%raise(STATUS_ERROR, 'profile_create', 'must not be the zero vector')
      return
    end if
    if (parameters%revolved) then
      profile%first = perpendicular(profile%axis)
    else
      profile%first = normalised(parameters%first_direction)
      profile%first = normalised(profile%first &
                                 - dot_product(profile%first, profile%axis) * profile%axis)
      if (norm2(profile%first) < 0.5_wp) then
        key = 'first_direction'
        call status%raise(STATUS_ERROR, 'profile_create', &
                          'must be neither the zero vector nor along the axis_direction')
        return
      end if
    end if
    profile%second = cross_product(profile%axis, profile%first)

    allocate (fillets(0))
    if (allocated(parameters%fillets)) fillets = parameters%fillets
    call profile_curve_create(parameters%points, fillets, parameters%closed, &
                              parameters%material_left, parameters%revolved, profile%curve, key, &
                              why)
    if (why /= '') then
      call status%raise(STATUS_ERROR, 'profile_create', why)
      return
    end if
    profile%smallest = epsilon(1.0_wp) * maxval(abs(parameters%points))
    if (profile%revolved) then
      profile%anchor = profile%point + parameters%points(2, 1) * profile%axis
    else
      profile%anchor = profile%point + parameters%points(1, 1) * profile%first &
        + parameters%points(2, 1) * profile%second
    end if

  end subroutine profile_create

  !> Make a profile from its keys in a group `&tool`; faults of the keys stay in `group`.
  subroutine profile_from_group(group, context, shape)
    type(group_t), intent(inout) :: group
    type(shape_context_t), intent(in) :: context
    !> Not allocated when `group` has a fault or is being explained.
    class(rigid_shape_t), allocatable, intent(out) :: shape

    character(len=:), allocatable :: key, side, sweep
    real(wp), allocatable :: points(:)
    type(profile_parameters_t) :: p
    type(profile_t) :: profile
    type(status_t) :: status

    allocate (side, source='')
    allocate (sweep, source='')
    call group%take_list('points', points, 'length', &
                         'Corners x1, y1, x2, y2 ... of the profile; where it is revolved, '// &
                         'as in an axisymmetric problem: radius and height. First and last '// &
                         'segment have no end, but end on an axis of revolution.', required=.true.)
    call group%take_list('fillets', p%fillets, 'length', &
                         'Radius of the arc at each point, or one for all corners.', lower=0.0_wp)
    call group%take('closed', p%closed, 'True when a segment leads from the last point to the '// &
                    'first.')
    call group%take('side', side, 'Where the material is on the way from the first to the last '// &
                    'point.', choices=[character(len=5) :: 'left', 'right'], required=.true.)
    select case (context%dimension)
    case ('3d')
      call group%take('sweep', sweep, 'In 3D, how the profile becomes a surface: revolved '// &
                      'about the axis, or extruded along it without end.', &
                      choices=[character(len=8) :: 'revolved', 'extruded'], required=.true.)
      call group%take('axis_point', p%axis_point, 'length', 'In 3D, origin of the '// &
                      'profile, on the axis.')
      call group%take('axis_direction', p%axis_direction, '1', &
                      'In 3D, direction of the axis; heights count along it.', required=.true.)
      call group%take('first_direction', p%first_direction, '1', &
                      'In 3D, direction of x of an extruded profile; y is at right angles '// &
                      'to it and the axis, right-handed.')
      p%revolved = sweep == 'revolved'
      if (p%revolved .and. group%given('first_direction')) then
        call group%refuse('first_direction', 'has no effect on a profile that is revolved')
      end if
    case ('axisymmetric')
      p%revolved = .true.
      p%axis_direction = [0.0_wp, 1.0_wp, 0.0_wp]
    case default
      p%axis_direction = [0.0_wp, 0.0_wp, 1.0_wp]
    end select
    if (group%explaining .or. group%status%failed()) return

    if (modulo(size(points), 2) /= 0) then
      call group%refuse('points', 'must be pairs of two coordinates')
      return
    end if
    allocate (p%points, source=reshape(points, [2, size(points) / 2]))
    p%material_left = side == 'left'
    call profile_create('profile', p, profile, key, status)
    if (status%failed()) then
      call group%refuse(key, trim(status%message))
      return
    end if
    allocate (shape, source=profile)

  end subroutine profile_from_group

  !> See [[rigid_shape_t:project]].
  pure subroutine profile_project(self, x, penetration, normal, hessian)
    class(profile_t), intent(in) :: self
    real(wp), intent(in) :: x(3)
    real(wp), intent(out) :: penetration
    real(wp), intent(out) :: normal(3)
    real(wp), intent(out) :: hessian(3, 3)

    real(wp) :: along(3), around(3), bend, curvature(2, 2), direction(2), from(3), outward(3), &
      place(2)

    from = x - self%point
    if (self%revolved) then
      along = self%axis
      place(2) = dot_product(from, along)
      from = from - place(2) * along
      place(1) = norm2(from)
      outward = self%first
      if (place(1) > self%smallest) outward = from / place(1)
    else
      outward = self%first
      along = self%second
      place = [dot_product(from, outward), dot_product(from, along)]
    end if
    call self%curve%project(place, penetration, direction, curvature)
    normal = direction(1) * outward + direction(2) * along
    hessian = curvature(1, 1) * dyadic(outward, outward) &
      + curvature(2, 2) * dyadic(along, along) &
      + curvature(1, 2) * (dyadic(outward, along) + dyadic(along, outward))
    if (.not. self%revolved) return

    ! Around the axis; on it both principal curvatures across it are one
    bend = curvature(1, 1)
    if (place(1) > self%smallest) bend = -direction(1) / place(1)
    around = cross_product(along, outward)
    hessian = hessian + bend * dyadic(around, around)

  end subroutine profile_project

  !> See [[rigid_shape_t:draw]].
  subroutine profile_draw(self, view, picture)
    class(profile_t), intent(in) :: self
    type(shape_view_t), intent(in) :: view
    type(shape_picture_t), intent(out) :: picture

    !> Points around the axis, and pieces along it.
    integer, parameter :: N_AROUND = 48, N_ALONG = 6
    real(wp), parameter :: TURN = 2.0_wp * acos(-1.0_wp)

    integer :: i, j, n, n_point, n_second, place
    real(wp) :: angle, direction(3), middle, shift(3)
    real(wp), allocatable :: outline(:, :)

    call fine_outline(self, view, outline)
    n_point = size(outline, 2)
    n_second = 0
    if (view%n_dim == 3) n_second = merge(N_AROUND, N_ALONG, self%revolved)
    allocate (picture%points(3, n_point * (n_second + 1)))
    middle = dot_product(view%centre - self%point, self%axis)
    do j = 0, n_second
      direction = self%first
      shift = self%point
      if (view%n_dim == 3 .and. self%revolved) then
        angle = TURN * j / N_AROUND
        direction = cos(angle) * self%first + sin(angle) * self%second
      else if (view%n_dim == 3) then
        shift = shift + (middle + view%extent * 1.5_wp * (2.0_wp * j / N_ALONG - 1.0_wp)) &
          * self%axis
      end if
      do i = 1, n_point
        picture%points(:, i + n_point * j) = shift + outline(1, i) * direction &
          + outline(2, i) * merge(self%axis, self%second, self%revolved)
      end do
    end do

    allocate (picture%cells(view%n_dim, (n_point - 1) * max(1, 2 * n_second)))
    n = 0
    do j = 0, max(n_second - 1, 0)
      do i = 1, n_point - 1
        place = i + n_point * j
        if (view%n_dim == 2) then
          picture%cells(:, n + 1) = [place, place + 1]
          n = n + 1
        else
          picture%cells(:, n + 1) = [place + n_point + 1, place, place + 1]
          picture%cells(:, n + 2) = [place, place + n_point + 1, place + n_point]
          n = n + 2
        end if
      end do
    end do
    call picture%crop(view)

  end subroutine profile_draw

  !> The outline in pieces short enough to be cropped.
  subroutine fine_outline(self, view, outline)
    type(profile_t), intent(in) :: self
    type(shape_view_t), intent(in) :: view
    real(wp), allocatable, intent(out) :: outline(:, :)

    integer :: i, j, n, n_piece
    real(wp) :: longest
    real(wp), allocatable :: coarse(:, :)

    longest = view%extent / 6.0_wp
    ! As far as the view may reach
    call self%curve%get_outline(norm2(view%centre - self%anchor) + 3.0_wp * view%extent, coarse)
    n = 1
    do i = 2, size(coarse, 2)
      n = n + max(1, ceiling(norm2(coarse(:, i) - coarse(:, i - 1)) / longest))
    end do
    allocate (outline(2, n))
    outline(:, 1) = coarse(:, 1)
    n = 1
    do i = 2, size(coarse, 2)
      n_piece = max(1, ceiling(norm2(coarse(:, i) - coarse(:, i - 1)) / longest))
      do j = 1, n_piece
        outline(:, n + j) = coarse(:, i - 1) + (coarse(:, i) - coarse(:, i - 1)) * j / n_piece
      end do
      n = n + n_piece
    end do

  end subroutine fine_outline

end module swage_profile
