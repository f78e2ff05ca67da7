!> Rigid tools: an analytic shape that follows a motion.
module swage_rigid_tool
  use swage_comm, only: comm_t
  use swage_deck, only: deck_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_motion, only: FIXED, motion_from_group, motion_t
  use swage_rigid_shape, only: rigid_shape_t, shape_context_t, shape_picture_t, shape_view_t
  use swage_rotation, only: IDENTITY, rotated_matrix, rotation_matrix
  use swage_shape_registry, only: shape_from_group, shape_names
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: explain_tool, rigid_tool_create, rigid_tool_t, tool_from_group

  !> A tool and where it is during the current step.
  type :: rigid_tool_t
    !> What other groups and the history call it.
    character(len=:), allocatable :: name
    class(rigid_shape_t), allocatable :: shape
    type(motion_t) :: motion
    !> Translation since the drawing, at the end of the step [length].
    real(wp) :: position(3) = 0.0_wp
    !> Angle since the drawing, at the end of the step [angle]; not reduced to a turn.
    real(wp) :: angle = 0.0_wp
    !> Where the point that torques refer to is at the end of the step [length].
    real(wp) :: reference_point(3) = 0.0_wp
    !> Rotation of the tool from the start to the end of the step.
    real(wp) :: rotation_increment(3, 3) = IDENTITY
    real(wp), private :: reference_drawn(3) = 0.0_wp
    !> Pose at the end of the step.
    real(wp), private :: rotation(3, 3) = IDENTITY
    real(wp), private :: translation(3) = 0.0_wp
    !> Displacement of the axis point during the step, and where it was [length].
    real(wp), private :: increment(3) = 0.0_wp
    real(wp), private :: pivot_old(3) = 0.0_wp
  contains
    !> Move the tool to a step.
    procedure :: begin_step => rigid_tool_begin_step
    !> Penetration of a point at the end of the step.
    procedure :: project => rigid_tool_project
    !> Its surface at the end of the step, for pictures.
    procedure :: draw => rigid_tool_draw
    !> Where a point of the tool goes during the step.
    procedure :: carry => rigid_tool_carry
    !> Largest speed at a distance from the axis of rotation, over all times [length/time].
    procedure :: speed => rigid_tool_speed
  end type rigid_tool_t

contains

  !> Make a tool; it stands at time 0.
  pure subroutine rigid_tool_create(name, shape, motion, reference_point, tool)
    character(len=*), intent(in) :: name
    class(rigid_shape_t), intent(in) :: shape
    type(motion_t), intent(in) :: motion
    !> Point of the tool that torques refer to, as drawn [length].
    real(wp), intent(in) :: reference_point(3)
    type(rigid_tool_t), intent(out) :: tool

    tool%name = name
    allocate (tool%shape, source=shape)
    tool%motion = motion
    tool%reference_drawn = reference_point
    call tool%begin_step(0.0_wp, 0.0_wp)

  end subroutine rigid_tool_create

  !> Collective. Make the tool of a group `&tool`, with its `&motion` from the same deck.
  subroutine tool_from_group(group, deck, comm, dimension, tool, status)
    type(group_t), intent(inout) :: group
    type(deck_t), intent(in) :: deck
    type(comm_t), intent(in) :: comm
    !> `plane_strain`, `axisymmetric` or `3d`.
    character(len=*), intent(in) :: dimension
    type(rigid_tool_t), intent(out) :: tool
    !> `STATUS_ERROR` when a key is unknown or faulty, the motion does not exist, or shape or
    !> motion do not fit the dimension.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: motion_name, shape_name
    class(rigid_shape_t), allocatable :: shape
    real(wp) :: reference_point(3)
    type(group_t) :: motion_group
    type(motion_t) :: motion
    type(shape_context_t) :: context

    call take_common_keys(group, shape_name, motion_name, reference_point)
    context%dimension = dimension
    context%folder = deck%folder
    context%comm = comm
    call shape_from_group(shape_name, group, context, shape)
    call group%finish(status)
    if (status%failed()) return

    ! A &motion that takes the reserved name is read too: that refuses it
    if (motion_name /= FIXED .or. has_motion(deck, FIXED)) then
      call deck%find('motion', motion_name, motion_group, status, from=group, key='motion')
      if (status%failed()) return
      call motion_from_group(motion_group, deck, dimension, motion, status)
      if (status%failed()) return
    end if

    if (.not. group%given('reference_point')) then
      reference_point = shape%anchor
      if (motion%is_rotating()) reference_point = motion%get_axis_point()
    end if
    call rigid_tool_create(group%name, shape, motion, reference_point, tool)

  end subroutine tool_from_group

  !> True when a deck has a `&motion` of that name.
  function has_motion(deck, name) result(has)
    type(deck_t), intent(in) :: deck
    character(len=*), intent(in) :: name
    logical :: has

    type(group_t) :: group
    integer :: i

    has = .false.
    do i = 1, deck%count('motion')
      call deck%get('motion', i, group)
      has = has .or. group%name == name
    end do

  end function has_motion

  !> Record in `group`, made for explaining, the keys of `&tool` with one kind of shape.
  subroutine explain_tool(shape_name, group)
    !> One of `shape_names()`; any other explains the keys that all share.
    character(len=*), intent(in) :: shape_name
    type(group_t), intent(inout) :: group

    character(len=:), allocatable :: motion_name, ignored
    class(rigid_shape_t), allocatable :: shape
    real(wp) :: reference_point(3)
    type(shape_context_t) :: context

    call take_common_keys(group, ignored, motion_name, reference_point)
    context%dimension = '3d'
    call shape_from_group(shape_name, group, context, shape)

  end subroutine explain_tool

  !> The keys that tools of all shapes share.
  subroutine take_common_keys(group, shape_name, motion_name, reference_point)
    type(group_t), intent(inout) :: group
    character(len=:), allocatable, intent(out) :: shape_name
    character(len=:), allocatable, intent(out) :: motion_name
    real(wp), intent(out) :: reference_point(3)

    shape_name = ''
    motion_name = FIXED
    reference_point = 0.0_wp
    call group%take('shape', shape_name, 'Surface of the tool.', choices=shape_names(), &
                    required=.true.)
    call group%take('motion', motion_name, 'Name of the &motion the tool follows; ''fixed'': none.')
    call group%take('reference_point', reference_point, 'length', &
                    'Point of the tool that torques refer to, at time 0; by default on the '// &
                    'axis of rotation, else a point of the shape.')

  end subroutine take_common_keys

  !> Afterwards [[rigid_tool_t:project]] answers for `time_new`, and [[rigid_tool_t:carry]] goes
  !> from `time_old` to `time_new`. A step that is cut begins again with another `time_new`.
  pure subroutine rigid_tool_begin_step(self, time_old, time_new)
    class(rigid_tool_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: time_old
    real(wp), intent(in) :: time_new

    real(wp) :: translation_old(3)

    call self%motion%pose_at(time_new, self%rotation, self%translation)
    self%position = self%motion%translation_at(time_new)
    self%angle = self%motion%angle_at(time_new)
    self%reference_point = matmul(self%rotation, self%reference_drawn) + self%translation

    translation_old = self%motion%translation_at(time_old)
    self%increment = self%position - translation_old
    self%pivot_old = self%motion%get_axis_point() + translation_old
    self%rotation_increment = rotation_matrix(self%motion%get_axis(), &
                                              self%angle - self%motion%angle_at(time_old))

  end subroutine rigid_tool_begin_step

  !> As [[rigid_shape_t:project]], in the frame of the problem.
  pure subroutine rigid_tool_project(self, x, penetration, normal, hessian)
    class(rigid_tool_t), intent(in) :: self
    !> Position [length]; (x, y, 0) in plane strain, (r, z, 0) in an axisymmetric problem.
    real(wp), intent(in) :: x(3)
    !> [length], positive inside the tool.
    real(wp), intent(out) :: penetration
    !> Unit vector out of the tool: -∂penetration/∂x.
    real(wp), intent(out) :: normal(3)
    !> ∂²penetration/∂x² [1/length].
    real(wp), intent(out) :: hessian(3, 3)

    real(wp) :: in_tool(3)

    if (.not. self%motion%is_rotating()) then
      call self%shape%project(x - self%translation, penetration, normal, hessian)
      return
    end if
    in_tool = matmul(x - self%translation, self%rotation)
    call self%shape%project(in_tool, penetration, normal, hessian)
    normal = matmul(self%rotation, normal)
    hessian = rotated_matrix(hessian, self%rotation)

  end subroutine rigid_tool_project

  !> As [[rigid_shape_t:draw]], in the frame of the problem.
  subroutine rigid_tool_draw(self, view, picture)
    class(rigid_tool_t), intent(in) :: self
    type(shape_view_t), intent(in) :: view
    type(shape_picture_t), intent(out) :: picture

    integer :: i
    type(shape_view_t) :: in_tool

    in_tool = view
    in_tool%centre = matmul(view%centre - self%translation, self%rotation)
    call self%shape%draw(in_tool, picture)
    do i = 1, size(picture%points, 2)
      picture%points(:, i) = matmul(self%rotation, picture%points(:, i)) + self%translation
    end do

  end subroutine rigid_tool_draw

  !> Where the point of the tool that is at `x_old` at the start of the step is at its end. Exact
  !> for any angle; a tool that only translates adds its displacement, without rounding.
  pure function rigid_tool_carry(self, x_old) result(x_new)
    class(rigid_tool_t), intent(in) :: self
    !> [length]
    real(wp), intent(in) :: x_old(3)
    real(wp) :: x_new(3)

    x_new = x_old + self%increment
    if (self%motion%is_rotating()) then
      x_new = x_new + matmul(self%rotation_increment - IDENTITY, x_old - self%pivot_old)
    end if

  end function rigid_tool_carry

  pure function rigid_tool_speed(self, distance) result(speed)
    class(rigid_tool_t), intent(in) :: self
    !> From the axis of rotation [length]: the size of what the tool touches.
    real(wp), intent(in) :: distance
    real(wp) :: speed

    speed = self%motion%largest_speed(distance)

  end function rigid_tool_speed

end module swage_rigid_tool
