!> Rigid tools: an analytic shape that follows a motion, or forces, or both.
module swage_rigid_tool
  use swage_comm, only: comm_t
  use swage_deck, only: deck_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_motion, only: FIXED, motion_from_group, motion_t
  use swage_rigid_shape, only: rigid_shape_t, shape_context_t, shape_picture_t, shape_view_t
  use swage_rotation, only: cross_product, IDENTITY, normalised, rotated_matrix, rotation_matrix
  use swage_shape_registry, only: shape_from_group, shape_names
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t
  use swage_tool_control, only: control_from_group, tool_control_t
  implicit none(type, external)
  private

  public :: explain_tool, rigid_tool_create, rigid_tool_t, tool_from_group

  integer, parameter :: NAME_LENGTH = 64
  !> Directions that differ by less than this angle count as one.
  real(wp), parameter :: INDEPENDENT = 1.0e-6_wp

  !> A tool and where it is during the current step.
  type :: rigid_tool_t
    !> What other groups and the history call it.
    character(len=:), allocatable :: name
    class(rigid_shape_t), allocatable :: shape
    type(motion_t) :: motion
    !> Coordinates that follow from forces, on top of the motion; shape (n_control).
    type(tool_control_t), allocatable :: controls(:)
    !> Their values at the end of the step, and at its start, and their increments of the last
    !> step [length] or [angle]; shape (n_control).
    real(wp), allocatable :: offset(:), offset_old(:), offset_change(:)
    !> Direction of the axis of rotation, a unit vector; zero where the tool cannot turn.
    real(wp) :: axis(3) = 0.0_wp
    !> Translation since the drawing, at the end of the step [length].
    real(wp) :: position(3) = 0.0_wp
    !> Angle since the drawing, at the end of the step [angle]; not reduced to a turn.
    real(wp) :: angle = 0.0_wp
    !> Where the point that torques refer to is at the end of the step [length].
    real(wp) :: reference_point(3) = 0.0_wp
    !> Rotation of the tool from the start to the end of the step.
    real(wp) :: rotation_increment(3, 3) = IDENTITY
    real(wp), private :: reference_drawn(3) = 0.0_wp
    !> The tool can turn, and a point of its axis as drawn [length].
    logical, private :: rotates = .false.
    real(wp), private :: axis_point(3) = 0.0_wp
    !> Ends of the step [time].
    real(wp), private :: time_old = 0.0_wp
    real(wp), private :: time_new = 0.0_wp
    !> Pose at the end of the step.
    real(wp), private :: rotation(3, 3) = IDENTITY
    real(wp), private :: translation(3) = 0.0_wp
    !> Displacement of the axis point during the step, and where it was [length].
    real(wp), private :: increment(3) = 0.0_wp
    real(wp), private :: pivot_old(3) = 0.0_wp
  contains
    !> Move the tool to a step.
    procedure :: begin_step => rigid_tool_begin_step
    !> Move the controlled coordinates to given values at the end of the step.
    procedure :: set_offset => rigid_tool_set_offset
    !> Velocity of a point by the rate of a controlled coordinate.
    procedure :: lever => rigid_tool_lever
    !> The first kink of the motion or of a load after a time.
    procedure :: next_event => rigid_tool_next_event
    !> Make the end of the step the start of the next one.
    procedure :: accept => rigid_tool_accept
    !> Put the state after the last accepted step into a snapshot, and take it back.
    procedure :: save => rigid_tool_save
    procedure :: load => rigid_tool_load
    !> Penetration of a point at the end of the step.
    procedure :: project => rigid_tool_project
    !> Its surface at the end of the step, for pictures.
    procedure :: draw => rigid_tool_draw
    !> Where a point of the tool goes during the step.
    procedure :: carry => rigid_tool_carry
    !> Largest speed of the motion at a distance from the axis of rotation, over all times
    !> [length/time].
    procedure :: speed => rigid_tool_speed
  end type rigid_tool_t

contains

  !> Make a tool; it stands at time 0.
  pure subroutine rigid_tool_create(name, shape, motion, reference_point, tool, controls)
    character(len=*), intent(in) :: name
    class(rigid_shape_t), intent(in) :: shape
    type(motion_t), intent(in) :: motion
    !> Point of the tool that torques refer to, as drawn [length].
    real(wp), intent(in) :: reference_point(3)
    type(rigid_tool_t), intent(out) :: tool
    !> At most one of them rotates; about the axis of the motion where that rotates.
    type(tool_control_t), intent(in), optional :: controls(:)

    integer :: i

    tool%name = name
    allocate (tool%shape, source=shape)
    tool%motion = motion
    tool%reference_drawn = reference_point
    tool%rotates = motion%is_rotating()
    if (tool%rotates) then
      tool%axis = motion%get_axis()
      tool%axis_point = motion%get_axis_point()
    end if
    allocate (tool%controls(0))
    if (present(controls)) then
      deallocate (tool%controls)
      allocate (tool%controls, source=controls)
    end if
    do i = 1, size(tool%controls)
      associate (control => tool%controls(i))
        if (.not. control%rotates) cycle
        if (.not. tool%rotates) then
          tool%axis = control%axis
          tool%axis_point = control%axis_point
        end if
        tool%rotates = .true.
        control%axis = tool%axis
      end associate
    end do
    allocate (tool%offset(size(tool%controls)), tool%offset_old(size(tool%controls)), &
              tool%offset_change(size(tool%controls)), source=0.0_wp)
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

    character(len=NAME_LENGTH), allocatable :: control_names(:)
    character(len=:), allocatable :: motion_name, shape_name
    class(rigid_shape_t), allocatable :: shape
    real(wp) :: reference_point(3)
    type(group_t) :: motion_group
    type(motion_t) :: motion
    type(shape_context_t) :: context
    type(tool_control_t), allocatable :: controls(:)

    call take_common_keys(group, shape_name, motion_name, control_names, reference_point)
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

    call find_controls(group, deck, dimension, control_names, motion, controls, status)
    if (status%failed()) return
    call rigid_tool_create(group%name, shape, motion, reference_point, tool, controls)
    if (group%given('reference_point')) return
    reference_point = shape%anchor
    if (tool%rotates) reference_point = tool%axis_point
    call rigid_tool_create(group%name, shape, motion, reference_point, tool, controls)

  end subroutine tool_from_group

  !> The controls that a tool names, each a direction of its own.
  subroutine find_controls(group, deck, dimension, names, motion, controls, status)
    !> `&tool`.
    type(group_t), intent(inout) :: group
    type(deck_t), intent(in) :: deck
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: names(:)
    type(motion_t), intent(in) :: motion
    type(tool_control_t), allocatable, intent(out) :: controls(:)
    type(status_t), intent(inout) :: status

    type(group_t) :: control_group
    real(wp) :: basis(3, 3), free(3)
    integer :: i, j, n_direction, n_rotation

    allocate (controls(size(names)))
    n_direction = 0
    n_rotation = 0
    do i = 1, size(names)
      call deck%find('control', trim(names(i)), control_group, status, from=group, key='controls')
      if (status%failed()) return
      call control_from_group(control_group, dimension, controls(i))
      call check_axis(motion, controls(i), control_group)
      call control_group%finish(status)
      if (status%failed()) return

      if (controls(i)%rotates) then
        n_rotation = n_rotation + 1
        cycle
      end if
      ! What no combination of the directions before it can do
      free = controls(i)%axis
      do j = 1, n_direction
        free = free - dot_product(free, basis(:, j)) * basis(:, j)
      end do
      if (norm2(free) < INDEPENDENT) then
        call group%refuse('controls', 'the direction of '''//trim(names(i))//''' is that of '// &
                          'another control of the tool, or a combination of theirs')
      else
        n_direction = n_direction + 1
        basis(:, n_direction) = normalised(free)
      end if
    end do
    if (n_rotation > 1) then
      call group%refuse('controls', 'only one of them may be a rotation: a tool has one axis')
    end if
    call group%finish(status)

  end subroutine find_controls

  !> A tool that turns by its motion has an axis already; any other needs one from its control.
  subroutine check_axis(motion, control, group)
    type(motion_t), intent(in) :: motion
    type(tool_control_t), intent(in) :: control
    !> `&control`.
    type(group_t), intent(inout) :: group

    real(wp) :: between(3)

    if (.not. control%rotates .or. group%status%failed()) return
    if (.not. motion%is_rotating()) then
      if (.not. group%given('axis_point')) then
        call group%refuse('axis_point', 'must be given for a tool whose motion does not turn it')
      else if (norm2(control%axis) < 0.5_wp) then
        call group%refuse('axis_direction', 'must be given for a tool whose motion does not '// &
                          'turn it')
      end if
    else if (control%has_axis) then
      between = control%axis_point - motion%get_axis_point()
      if (norm2(cross_product(control%axis, motion%get_axis())) > INDEPENDENT .or. &
          norm2(cross_product(between, motion%get_axis())) > INDEPENDENT * norm2(between)) then
        call group%refuse('axis_direction', 'must be that of the motion, which turns the tool '// &
                          'already: leave axis_point and axis_direction out')
      end if
    end if

  end subroutine check_axis

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

    character(len=NAME_LENGTH), allocatable :: control_names(:)
    character(len=:), allocatable :: motion_name, ignored
    class(rigid_shape_t), allocatable :: shape
    real(wp) :: reference_point(3)
    type(shape_context_t) :: context

    call take_common_keys(group, ignored, motion_name, control_names, reference_point)
    context%dimension = '3d'
    call shape_from_group(shape_name, group, context, shape)

  end subroutine explain_tool

  !> The keys that tools of all shapes share.
  subroutine take_common_keys(group, shape_name, motion_name, control_names, reference_point)
    type(group_t), intent(inout) :: group
    character(len=:), allocatable, intent(out) :: shape_name
    character(len=:), allocatable, intent(out) :: motion_name
    character(len=NAME_LENGTH), allocatable, intent(out) :: control_names(:)
    real(wp), intent(out) :: reference_point(3)

    allocate (control_names(0))
    shape_name = ''
    motion_name = FIXED
    reference_point = 0.0_wp
    call group%take('shape', shape_name, 'Surface of the tool.', choices=shape_names(), &
                    required=.true.)
    call group%take('motion', motion_name, 'Name of the &motion the tool follows; ''fixed'': none.')
    call group%take_list('controls', control_names, 'Names of &controls: coordinates of the '// &
                         'tool that follow from forces, on top of the motion.')
    call group%take('reference_point', reference_point, 'length', &
                    'Point of the tool that torques refer to, at time 0; by default on the '// &
                    'axis of rotation, else a point of the shape.')

  end subroutine take_common_keys

  !> Afterwards [[rigid_tool_t:project]] answers for `time_new`, and [[rigid_tool_t:carry]] goes
  !> from `time_old` to `time_new`; controlled coordinates are those of the start. A step that is
  !> cut begins again with another `time_new`.
  pure subroutine rigid_tool_begin_step(self, time_old, time_new)
    class(rigid_tool_t), intent(inout) :: self
    !> [time]
    real(wp), intent(in) :: time_old
    real(wp), intent(in) :: time_new

    self%time_old = time_old
    self%time_new = time_new
    call self%set_offset(self%offset_old)

  end subroutine rigid_tool_begin_step

  pure subroutine rigid_tool_set_offset(self, offset)
    class(rigid_tool_t), intent(inout) :: self
    !> Values of the controlled coordinates at the end of the step [length] or [angle];
    !> shape (n_control).
    real(wp), intent(in) :: offset(:)

    real(wp) :: angle_old, translation_old(3)
    integer :: i

    self%offset = offset
    self%position = self%motion%translation_at(self%time_new)
    self%angle = self%motion%angle_at(self%time_new)
    translation_old = self%motion%translation_at(self%time_old)
    angle_old = self%motion%angle_at(self%time_old)
    do i = 1, size(self%controls)
      associate (control => self%controls(i))
        if (control%rotates) then
          self%angle = self%angle + offset(i)
          angle_old = angle_old + self%offset_old(i)
        else
          self%position = self%position + offset(i) * control%axis
          translation_old = translation_old + self%offset_old(i) * control%axis
        end if
      end associate
    end do

    self%rotation = rotation_matrix(self%axis, self%angle)
    self%translation = self%position
    if (self%rotates) then
      self%translation = self%translation + self%axis_point &
        - matmul(self%rotation, self%axis_point)
    end if
    self%reference_point = matmul(self%rotation, self%reference_drawn) + self%translation
    self%increment = self%position - translation_old
    self%pivot_old = self%axis_point + translation_old
    self%rotation_increment = rotation_matrix(self%axis, self%angle - angle_old)

  end subroutine rigid_tool_set_offset

  pure function rigid_tool_lever(self, i, x) result(lever)
    class(rigid_tool_t), intent(in) :: self
    !> Place of the control.
    integer, intent(in) :: i
    !> At the end of the step [length].
    real(wp), intent(in) :: x(3)
    !> [1], or [length/angle].
    real(wp) :: lever(3)

    lever = self%controls(i)%axis
    if (self%controls(i)%rotates) then
      lever = cross_product(lever, x - self%axis_point - self%position)
    end if

  end function rigid_tool_lever

  pure function rigid_tool_next_event(self, time) result(event)
    class(rigid_tool_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: event

    integer :: i

    event = self%motion%next_event(time)
    do i = 1, size(self%controls)
      event = min(event, self%controls(i)%next_event(time))
    end do

  end function rigid_tool_next_event

  pure subroutine rigid_tool_accept(self)
    class(rigid_tool_t), intent(inout) :: self

    self%offset_change = self%offset - self%offset_old
    self%offset_old = self%offset

  end subroutine rigid_tool_accept

  subroutine rigid_tool_save(self, snapshot)
    class(rigid_tool_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put('tool '//self%name//': offset', self%offset_old)
    call snapshot%put('tool '//self%name//': last offset', self%offset_change)

  end subroutine rigid_tool_save

  subroutine rigid_tool_load(self, snapshot, status)
    class(rigid_tool_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` on this rank when something is missing.
    type(status_t), intent(inout) :: status

    call snapshot%get('tool '//self%name//': offset', self%offset_old, status)
    call snapshot%get('tool '//self%name//': last offset', self%offset_change, status)

  end subroutine rigid_tool_load

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

    if (.not. self%rotates) then
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
    if (self%rotates) then
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
