!> Rigid motions: where a tool is at any time.
module swage_motion
  use swage_deck, only: deck_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_motion_table, only: motion_table_create, motion_table_t
  use swage_rigid_shape, only: DIRECTION_TOLERANCE, is_along, vector_text
  use swage_rotation, only: normalised, rotation_matrix
  use swage_status, only: status_t, STATUS_ERROR
  use swage_table_file, only: COLUMN_NAME_LENGTH, table_file_read
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: motion_t, motion_parameters_t, motion_create, motion_from_group, explain_motion, FIXED
  public :: fault_of_axis, fault_of_translation

  !> What the key `motion` of a tool calls the absence of one; no group may have this name.
  character(len=*), parameter :: FIXED = 'fixed'

  character(len=*), parameter :: RESERVED = 'is the name for tools that stay where they are, '// &
    'which need no group: choose another'

  !> Parameters; the initial values are those of a tool that stays where it is.
  type :: motion_parameters_t
    !> Constant velocity [length/time].
    real(wp) :: velocity(3) = 0.0_wp
    !> Direction of the displacement table; its length does not matter.
    real(wp) :: direction(3) = 0.0_wp
    !> A point of the axis of rotation, at time 0 [length]; it translates with the tool.
    real(wp) :: axis_point(3) = 0.0_wp
    !> Direction of the axis of rotation, which stays the same; its length does not matter.
    real(wp) :: axis_direction(3) = 0.0_wp
    !> Constant angular velocity, right-handed [angle/time].
    real(wp) :: angular_velocity = 0.0_wp
    !> Times of the tables [time], strictly increasing.
    real(wp), allocatable :: time(:)
    !> Displacement at these times [length].
    real(wp), allocatable :: displacement(:)
    !> Angle at these times [angle], radian.
    real(wp), allocatable :: angle(:)
  end type motion_parameters_t

  !> A rigid motion; immutable once created. One that was not created is that of a fixed tool.
  !>
  !> A point drawn at X is at time t at \(x = R(\theta)(X - a) + a + u\), with the axis point a,
  !> the translation \(u = v\,t + d\,f(t)\) and the angle \(\theta = \omega\,t + g(t)\), where f
  !> and g are the tables of displacement and angle, constant outside their times.
  type :: motion_t
    private
    real(wp) :: velocity(3) = 0.0_wp
    real(wp) :: direction(3) = 0.0_wp
    real(wp) :: axis_point(3) = 0.0_wp
    real(wp) :: axis(3) = 0.0_wp
    real(wp) :: angular_velocity = 0.0_wp
    logical :: rotates = .false.
    type(motion_table_t) :: displacement
    type(motion_table_t) :: angle
  contains
    !> Rotation matrix and translation that carry drawn positions to a time.
    procedure, public :: pose_at => motion_pose_at
    !> Translation since the drawing [length].
    procedure, public :: translation_at => motion_translation_at
    !> Angle since the drawing [angle]: not reduced to a turn.
    procedure, public :: angle_at => motion_angle_at
    !> Velocity of the axis point and angular velocity, just after a time.
    procedure, public :: velocity_at => motion_velocity_at
    !> The first time after this one at which the velocity jumps; `huge` when there is none.
    procedure, public :: next_event => motion_next_event
    !> Largest speed at a distance from the axis, over all times [length/time].
    procedure, public :: largest_speed => motion_largest_speed
    !> Direction of the axis of rotation, a unit vector; zero when there is none.
    procedure, public :: get_axis => motion_get_axis
    !> A point of the axis of rotation as drawn [length].
    procedure, public :: get_axis_point => motion_get_axis_point
    !> True when the tool turns at any time.
    procedure, public :: is_rotating => motion_is_rotating
  end type motion_t

contains

  !> Make a motion. On failure `motion` must not be used.
  pure subroutine motion_create(parameters, dimension, motion, status)
    type(motion_parameters_t), intent(in) :: parameters
    !> `plane_strain`, `axisymmetric` or `3d`.
    character(len=*), intent(in) :: dimension
    type(motion_t), intent(out) :: motion
    !> `STATUS_ERROR` when the parameters contradict each other or leave the plane of the problem.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: key, why

    call find_fault(parameters, dimension, key, why)
    if (why /= '') then
      call status%raise(STATUS_ERROR, 'motion_create', key//': '//why)
      return
    end if

    motion%velocity = parameters%velocity
    motion%direction = normalised(parameters%direction)
    motion%angular_velocity = parameters%angular_velocity
    if (allocated(parameters%displacement)) then
      call motion_table_create(parameters%time, parameters%displacement, motion%displacement)
    end if
    if (allocated(parameters%angle)) then
      call motion_table_create(parameters%time, parameters%angle, motion%angle)
    end if
    motion%rotates = rotates(parameters)
    if (motion%rotates) then
      motion%axis_point = parameters%axis_point
      motion%axis = normalised(parameters%axis_direction)
    end if

  end subroutine motion_create

  !> True when the parameters ask for a rotation.
  pure function rotates(parameters) result(turns)
    type(motion_parameters_t), intent(in) :: parameters
    logical :: turns

    turns = abs(parameters%angular_velocity) > 0.0_wp .or. allocated(parameters%angle)

  end function rotates

  !> The first parameter that is wrong, and what is; `why` is empty when nothing is.
  pure subroutine find_fault(parameters, dimension, key, why)
    type(motion_parameters_t), intent(in) :: parameters
    character(len=*), intent(in) :: dimension
    character(len=:), allocatable, intent(out) :: key
    character(len=:), allocatable, intent(out) :: why

    call find_fault_of_tables(parameters, key, why)
    if (why /= '') return
    if (allocated(parameters%displacement)) then
      key = 'direction'
      why = fault_of_translation(parameters%direction, dimension)
      if (norm2(normalised(parameters%direction)) < 0.5_wp) why = 'must not be the zero vector'
      if (why /= '') return
    end if
    key = 'velocity'
    why = fault_of_translation(parameters%velocity, dimension)
    if (why /= '' .or. .not. rotates(parameters)) return
    key = 'axis_direction'
    why = fault_of_axis(parameters%axis_direction, dimension)

  end subroutine find_fault

  !> The same for the tables alone.
  pure subroutine find_fault_of_tables(parameters, key, why)
    type(motion_parameters_t), intent(in) :: parameters
    character(len=:), allocatable, intent(out) :: key
    character(len=:), allocatable, intent(out) :: why

    integer :: i, n

    n = 0
    if (allocated(parameters%time)) n = size(parameters%time)
    why = ''
    key = 'displacement'
    if (allocated(parameters%displacement)) why = fault_of_size(size(parameters%displacement), n)
    if (why /= '') return
    key = 'angle'
    if (allocated(parameters%angle)) why = fault_of_size(size(parameters%angle), n)
    if (why /= '') return
    key = 'time'
    do i = 2, n
      if (parameters%time(i) > parameters%time(i - 1)) cycle
      why = 'must increase strictly, but '//text(parameters%time(i))//' follows '// &
        text(parameters%time(i - 1))
      return
    end do

  end subroutine find_fault_of_tables

  !> What is wrong with the number of values of a table; empty when nothing is.
  pure function fault_of_size(n_value, n_time) result(why)
    integer, intent(in) :: n_value
    integer, intent(in) :: n_time
    character(len=:), allocatable :: why

    why = ''
    if (n_value /= n_time) then
      why = 'must have one value for each of time: '//text(n_value)//' for '//text(n_time)
    else if (n_time < 2) then
      why = 'must have at least two values, and time as many'
    end if

  end function fault_of_size

  !> What is wrong with the direction of a translation; empty when nothing is.
  pure function fault_of_translation(vector, dimension) result(why)
    real(wp), intent(in) :: vector(3)
    character(len=*), intent(in) :: dimension
    character(len=:), allocatable :: why

    real(wp) :: unit(3)

    why = ''
    unit = normalised(vector)
    if (norm2(unit) < 0.5_wp) return
    if (dimension == 'plane_strain' .and. abs(unit(3)) > DIRECTION_TOLERANCE) then
      why = vector_text(vector)//' must lie in the plane x-y in plane strain (third component 0)'
    else if (dimension == 'axisymmetric' .and. .not. is_along(unit, 2)) then
      why = vector_text(vector)//' must be along the axis of revolution y in an axisymmetric '// &
        'problem (first and third component 0)'
    end if

  end function fault_of_translation

  !> What is wrong with the axis of a rotation; empty when nothing is.
  pure function fault_of_axis(axis, dimension) result(why)
    real(wp), intent(in) :: axis(3)
    character(len=*), intent(in) :: dimension
    character(len=:), allocatable :: why

    real(wp) :: unit(3)

    why = ''
    unit = normalised(axis)
    if (dimension == 'axisymmetric') then
      why = 'a tool cannot turn in an axisymmetric problem, which has no circumferential velocity'
    else if (norm2(unit) < 0.5_wp) then
      why = 'must be given, not zero, for a tool that turns'
    else if (dimension == 'plane_strain' .and. .not. is_along(unit, 3)) then
      why = 'must be (0, 0, 1) in plane strain'
    end if

  end function fault_of_axis

  !> Make the motion of a group `&motion`.
  subroutine motion_from_group(group, deck, dimension, motion, status)
    type(group_t), intent(inout) :: group
    !> Where the group comes from: paths of tables are relative to its folder.
    type(deck_t), intent(in) :: deck
    !> As [[motion_create]].
    character(len=*), intent(in) :: dimension
    type(motion_t), intent(out) :: motion
    !> `STATUS_ERROR` when a key is unknown or faulty, a table cannot be read, or as
    !> [[motion_create]].
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: key, table, why
    type(motion_parameters_t) :: p

    call take_parameters(group, dimension, p, table)
    if (group%name == FIXED) call group%refuse('name', RESERVED)
    if (.not. group%status%failed()) then
      if (table /= '') call read_table(group, deck%resolve(table), p)
      call refuse_idle_keys(group, p)
      call find_fault(p, dimension, key, why)
      if (why /= '') call group%refuse(key, why)
    end if
    call group%finish(status)
    if (status%failed()) return
    call motion_create(p, dimension, motion, status)

  end subroutine motion_from_group

  !> Record the keys of `&motion` in a group made for explaining.
  subroutine explain_motion(group)
    type(group_t), intent(inout) :: group

    character(len=:), allocatable :: ignored
    type(motion_parameters_t) :: p

    call take_parameters(group, '3d', p, ignored)

  end subroutine explain_motion

  !> The only place where the keys are named.
  subroutine take_parameters(group, dimension, p, table)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: dimension
    type(motion_parameters_t), intent(out) :: p
    !> Path of a table; empty when there is none.
    character(len=:), allocatable, intent(out) :: table

    table = ''
    if (dimension == 'plane_strain') p%axis_direction = [0.0_wp, 0.0_wp, 1.0_wp]
    call group%take('velocity', p%velocity, 'length/time', 'Constant velocity of the tool.')
    call group%take('direction', p%direction, '1', &
                    'Direction in which displacement counts; its length does not matter.')
    call group%take_list('time', p%time, 'time', 'Times of displacement and angle.')
    call group%take_list('displacement', p%displacement, 'length', &
                         'Displacement along direction at each time, linear between them.')
    call group%take('axis_point', p%axis_point, 'length', &
                    'A point of the axis of rotation at time 0; it moves with the tool.')
    call group%take('axis_direction', p%axis_direction, '1', &
                    'Direction of the axis of rotation, right-handed; z in plane strain.')
    call group%take('angular_velocity', p%angular_velocity, 'angle/time', &
                    'Constant angular velocity, in radian.')
    call group%take_list('angle', p%angle, 'angle', &
                         'Angle at each time, in radian, linear between them.')
    call group%take('table', table, 'File of a table instead of these lists: columns named '// &
                    'time and displacement or angle or both, separated by commas.')
    call discard_if_empty(p%time)
    call discard_if_empty(p%displacement)
    call discard_if_empty(p%angle)

  end subroutine take_parameters

  !> Fill the lists from a file.
  subroutine read_table(group, path, p)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: path
    type(motion_parameters_t), intent(inout) :: p

    character(len=COLUMN_NAME_LENGTH), allocatable :: names(:)
    integer :: i
    real(wp), allocatable :: values(:, :)
    type(status_t) :: status

    if (allocated(p%time) .or. allocated(p%displacement) .or. allocated(p%angle)) then
      call group%refuse('table', 'stands instead of time, displacement and angle: give one or '// &
                        'the other')
      return
    end if
    call table_file_read(path, names, values, status)
    if (status%failed()) then
      call group%refuse('table', trim(status%message))
      return
    end if
    do i = 1, size(names)
      select case (names(i))
      case ('time')
        p%time = values(:, i)
      case ('displacement')
        p%displacement = values(:, i)
      case ('angle')
        p%angle = values(:, i)
      case default
        call group%refuse('table', path//' has a column '''//trim(names(i))// &
                          ''': known are ''time'', ''displacement'', ''angle''')
      end select
    end do
    if (.not. allocated(p%time)) then
      call group%refuse('table', path//' has no column ''time''')
    else if (.not. (allocated(p%displacement) .or. allocated(p%angle))) then
      call group%refuse('table', path//' has no column ''displacement'' and none ''angle''')
    end if

  end subroutine read_table

  !> A list that was not given is not allocated.
  pure subroutine discard_if_empty(list)
    real(wp), allocatable, intent(inout) :: list(:)

    if (.not. allocated(list)) return
    if (size(list) == 0) deallocate (list)

  end subroutine discard_if_empty

  !> Keys that would have no effect are mistakes.
  subroutine refuse_idle_keys(group, p)
    type(group_t), intent(inout) :: group
    type(motion_parameters_t), intent(in) :: p

    if (group%given('direction') .and. .not. allocated(p%displacement)) then
      call group%refuse('direction', 'has no effect without displacement')
    end if
    if (allocated(p%time) .and. .not. (allocated(p%displacement) .or. allocated(p%angle))) then
      call group%refuse('time', 'has no effect without displacement or angle')
    end if
    if (rotates(p) .or. group%given('angular_velocity')) return
    if (group%given('axis_point')) then
      call group%refuse('axis_point', 'has no effect without angular_velocity or angle')
    end if
    if (group%given('axis_direction')) then
      call group%refuse('axis_direction', 'has no effect without angular_velocity or angle')
    end if

  end subroutine refuse_idle_keys

  !> x = `rotation` X + `translation`, for X as drawn.
  pure subroutine motion_pose_at(self, time, rotation, translation)
    class(motion_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp), intent(out) :: rotation(3, 3)
    !> [length]
    real(wp), intent(out) :: translation(3)

    rotation = rotation_matrix(self%axis, self%angle_at(time))
    translation = self%translation_at(time)
    if (self%rotates) then
      translation = translation + self%axis_point - matmul(rotation, self%axis_point)
    end if

  end subroutine motion_pose_at

  pure function motion_translation_at(self, time) result(translation)
    class(motion_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: translation(3)

    translation = self%velocity * time + self%direction * self%displacement%value_at(time)

  end function motion_translation_at

  pure function motion_angle_at(self, time) result(angle)
    class(motion_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: angle

    angle = self%angular_velocity * time + self%angle%value_at(time)

  end function motion_angle_at

  !> A point at x moves with `velocity` + `angular_velocity` × (x − axis point at that time).
  pure subroutine motion_velocity_at(self, time, velocity, angular_velocity)
    class(motion_t), intent(in) :: self
    real(wp), intent(in) :: time
    !> Of the axis point [length/time].
    real(wp), intent(out) :: velocity(3)
    !> [angle/time]
    real(wp), intent(out) :: angular_velocity(3)

    velocity = self%velocity + self%direction * self%displacement%slope_after(time)
    angular_velocity = self%axis * (self%angular_velocity + self%angle%slope_after(time))

  end subroutine motion_velocity_at

  pure function motion_next_event(self, time) result(event)
    class(motion_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: event

    event = min(self%displacement%next_kink(time), self%angle%next_kink(time))

  end function motion_next_event

  pure function motion_largest_speed(self, distance) result(speed)
    class(motion_t), intent(in) :: self
    !> From the axis of rotation [length].
    real(wp), intent(in) :: distance
    real(wp) :: speed

    real(wp), allocatable :: slopes(:)
    integer :: i

    speed = 0.0_wp
    call self%displacement%get_slopes(slopes)
    do i = 1, size(slopes)
      speed = max(speed, norm2(self%velocity + slopes(i) * self%direction))
    end do
    call self%angle%get_slopes(slopes)
    speed = speed + distance * maxval(abs(self%angular_velocity + slopes))

  end function motion_largest_speed

  pure function motion_get_axis(self) result(axis)
    class(motion_t), intent(in) :: self
    real(wp) :: axis(3)

    axis = self%axis

  end function motion_get_axis

  pure function motion_get_axis_point(self) result(point)
    class(motion_t), intent(in) :: self
    real(wp) :: point(3)

    point = self%axis_point

  end function motion_get_axis_point

  pure function motion_is_rotating(self) result(rotating)
    class(motion_t), intent(in) :: self
    logical :: rotating

    rotating = self%rotates

  end function motion_is_rotating

end module swage_motion
