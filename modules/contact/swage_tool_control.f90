!> Degrees of freedom of a tool whose position follows from forces: a translation or a rotation.
module swage_tool_control
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_motion, only: fault_of_axis, fault_of_translation
  use swage_motion_table, only: motion_table_create, motion_table_t
  use swage_rotation, only: normalised
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: tool_control_t, control_from_group, control_kinds, explain_control
  public :: CONTROL_KIND_LENGTH

  integer, parameter :: CONTROL_KIND_LENGTH = 32

  !> What the key `kind` may be.
  character(len=CONTROL_KIND_LENGTH), parameter :: KINDS(*) = &
    [character(len=CONTROL_KIND_LENGTH) :: 'force', 'spring', 'free', &
     'torque', 'torsion_spring', 'free_rotation']
  !> The first so many translate, the others rotate.
  integer, parameter :: N_TRANSLATION = 3

  !> One unknown coordinate q of a tool, which comes on top of its motion; immutable once created.
  !>
  !> It is in equilibrium when F(t) - k q and the action of the bodies along it add up to zero.
  type :: tool_control_t
    !> What `controls` of the tool calls it.
    character(len=:), allocatable :: name
    !> q is an angle about `axis`; else a length along it.
    logical :: rotates = .false.
    !> Unit vector of the translation or rotation.
    real(wp) :: axis(3) = 0.0_wp
    !> A point of the axis of rotation as drawn [length], and whether it was given.
    real(wp) :: axis_point(3) = 0.0_wp
    logical :: has_axis = .false.
    !> k [force/length], or [torque/angle].
    real(wp) :: stiffness = 0.0_wp
    !> F where there is no table [force], or [torque].
    real(wp), private :: constant_load = 0.0_wp
    type(motion_table_t), private :: load
  contains
    !> F at a time [force], or [torque].
    procedure :: load_at => tool_control_load_at
    !> The first kink of F after a time; `huge` when there is none.
    procedure :: next_event => tool_control_next_event
  end type tool_control_t

contains

  function control_kinds() result(names)
    character(len=CONTROL_KIND_LENGTH), allocatable :: names(:)

    allocate (names, source=KINDS)

  end function control_kinds

  !> Make the control of a group `&control`; faults of the keys stay in `group`.
  subroutine control_from_group(group, dimension, control)
    type(group_t), intent(inout) :: group
    !> `plane_strain`, `axisymmetric` or `3d`.
    character(len=*), intent(in) :: dimension
    type(tool_control_t), intent(out) :: control

    character(len=:), allocatable :: kind

    call take_kind(group, kind)
    call take_keys(group, kind, dimension, control)
    if (group%status%failed()) return
    control%name = group%name

  end subroutine control_from_group

  !> Record in `group`, made for explaining, the keys of one kind; of any other, the key `kind`.
  subroutine explain_control(kind, group)
    character(len=*), intent(in) :: kind
    type(group_t), intent(inout) :: group

    character(len=:), allocatable :: ignored
    type(tool_control_t) :: control

    call take_kind(group, ignored)
    call take_keys(group, kind, '3d', control)

  end subroutine explain_control

  subroutine take_kind(group, kind)
    type(group_t), intent(inout) :: group
    character(len=:), allocatable, intent(out) :: kind

    kind = ''
    call group%take('kind', kind, 'What moves the tool in place of its motion, or with it.', &
                    choices=KINDS, required=.true.)

  end subroutine take_kind

  !> The keys of one kind.
  subroutine take_keys(group, kind, dimension, control)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: kind
    character(len=*), intent(in) :: dimension
    type(tool_control_t), intent(inout) :: control

    integer :: place

    place = findloc(KINDS == kind, .true., dim=1)
    if (place == 0) return
    control%rotates = place > N_TRANSLATION
    if (control%rotates) then
      call take_rotation(group, dimension, control)
    else
      call take_direction(group, dimension, control)
    end if
    select case (kind)
    case ('force')
      call take_load(group, 'force', 'Force on the tool along direction', control)
    case ('torque')
      call take_load(group, 'torque', 'Torque on the tool about the axis', control)
    case ('spring')
      call group%take('stiffness', control%stiffness, 'force/length', 'Force that pulls the '// &
                      'tool back to the place of its motion, by the distance.', above=0.0_wp, &
                      required=.true.)
    case ('torsion_spring')
      call group%take('stiffness', control%stiffness, 'torque/angle', 'Torque that turns the '// &
                      'tool back to the angle of its motion, by the angle between.', &
                      above=0.0_wp, required=.true.)
    case default
      ! Free: nothing acts but the bodies
    end select

  end subroutine take_keys

  subroutine take_direction(group, dimension, control)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: dimension
    type(tool_control_t), intent(inout) :: control

    character(len=:), allocatable :: why
    real(wp) :: direction(3)

    direction = 0.0_wp
    call group%take('direction', direction, '1', 'Direction in which the tool can move; its '// &
                    'length does not matter.', required=.true.)
    if (group%explaining .or. group%status%failed()) return
    control%axis = normalised(direction)
    why = fault_of_translation(direction, dimension)
    if (norm2(control%axis) < 0.5_wp) why = 'must not be the zero vector'
    if (why /= '') call group%refuse('direction', why)

  end subroutine take_direction

  subroutine take_rotation(group, dimension, control)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: dimension
    type(tool_control_t), intent(inout) :: control

    character(len=:), allocatable :: why
    real(wp) :: direction(3)

    direction = 0.0_wp
    if (dimension == 'plane_strain') direction = [0.0_wp, 0.0_wp, 1.0_wp]
    call group%take('axis_point', control%axis_point, 'length', 'A point of the axis of '// &
                    'rotation at time 0; it moves with the tool. By default that of the motion.')
    call group%take('axis_direction', direction, '1', 'Direction of the axis of rotation, '// &
                    'right-handed; by default that of the motion, z in plane strain.')
    if (group%explaining .or. group%status%failed()) return
    control%has_axis = group%given('axis_point') .or. group%given('axis_direction')
    control%axis = normalised(direction)
    if (.not. control%has_axis .and. dimension == '3d') return
    why = fault_of_axis(direction, dimension)
    if (why /= '') call group%refuse('axis_direction', why)

  end subroutine take_rotation

  !> One value, or one for each time.
  subroutine take_load(group, key, meaning, control)
    type(group_t), intent(inout) :: group
    !> The key, which is the dimension too.
    character(len=*), intent(in) :: key
    character(len=*), intent(in) :: meaning
    type(tool_control_t), intent(inout) :: control

    real(wp), allocatable :: load(:), time(:)
    integer :: i

    call group%take_list(key, load, key, meaning//': one value, or one at each time, linear '// &
                         'between them.', required=.true.)
    call group%take_list('time', time, 'time', 'Times of the '//key//', ascending.')
    if (group%explaining .or. group%status%failed()) return
    if (size(load) /= max(size(time), 1)) then
      call group%refuse(key, 'must have one value for each of time: '//text(size(load))// &
                        ' for '//text(size(time)))
    else if (size(time) == 1) then
      call group%refuse('time', 'must have at least two values; a '//key//' that stays needs none')
    end if
    do i = 2, size(time)
      if (time(i) > time(i - 1)) cycle
      call group%refuse('time', 'must increase strictly, but '//text(time(i))//' follows '// &
                        text(time(i - 1)))
      exit
    end do
    if (group%status%failed()) return
    if (size(time) == 0) then
      control%constant_load = load(1)
    else
      call motion_table_create(time, load, control%load)
    end if

  end subroutine take_load

  pure function tool_control_load_at(self, time) result(load)
    class(tool_control_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: load

    load = self%constant_load + self%load%value_at(time)

  end function tool_control_load_at

  pure function tool_control_next_event(self, time) result(event)
    class(tool_control_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: event

    event = self%load%next_kink(time)

  end function tool_control_next_event

end module swage_tool_control
