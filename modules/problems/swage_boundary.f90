!> Boundary conditions on groups of the mesh: prescribed motion, symmetry, traction, pressure.
module swage_boundary
  use swage_group, only: group_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: boundary_t, boundary_from_group, explain_boundary
  public :: BOUNDARY_MOTION, BOUNDARY_SYMMETRY, BOUNDARY_TRACTION, BOUNDARY_PRESSURE

  !> Components of the displacement follow a given history; 'fixed', 'velocity', 'displacement'.
  integer, parameter :: BOUNDARY_MOTION = 1
  !> No displacement across the mean plane of the group.
  integer, parameter :: BOUNDARY_SYMMETRY = 2
  !> Force per area of the undeformed surface, of fixed direction.
  integer, parameter :: BOUNDARY_TRACTION = 3
  !> Force per present area, against the outward normal.
  integer, parameter :: BOUNDARY_PRESSURE = 4

  character(len=1), parameter :: AXIS_NAMES(3) = ['x', 'y', 'z']
  character(len=12), parameter :: KINDS(*) = [character(len=12) :: &
    'fixed', 'symmetry', 'velocity', 'displacement', 'traction', 'pressure']

  type :: boundary_t
    character(len=:), allocatable :: name
    !> One of `BOUNDARY_*`.
    integer :: kind = 0
    !> Names of groups of the mesh.
    character(len=64), allocatable :: groups(:)
    !> Components that follow the motion.
    logical :: prescribed(3) = .false.
    !> Velocity [length/time]: the part of the motion that is linear in time.
    real(wp) :: velocity(3) = 0.0_wp
    !> Displacement [length] or traction [stress] where the factor is 1.
    real(wp) :: value(3) = 0.0_wp
    !> Pressure where the factor is 1 [stress].
    real(wp) :: pressure = 0.0_wp
    !> The factor [1] as a polygon in time, constant beyond its ends; empty: it is 1 throughout,
    !> and 0 before the start for a displacement.
    real(wp), allocatable :: time(:), factor(:)
  contains
    !> Displacement since the start.
    procedure :: displacement_at => boundary_displacement_at
    !> Factor of the load.
    procedure :: factor_at => boundary_factor_at
    !> Next kink of the factor.
    procedure :: next_event => boundary_next_event
  end type boundary_t

contains

  !> Read a group `&boundary`. Faults stay in `group`, whose `finish` reports them.
  subroutine boundary_from_group(group, n_dim, boundary)
    type(group_t), intent(inout) :: group
    !> Space dimension of the mesh.
    integer, intent(in) :: n_dim
    type(boundary_t), intent(out) :: boundary

    character(len=64), allocatable :: components(:)
    character(len=:), allocatable :: kind
    real(wp), allocatable :: displacement(:), traction(:), velocity(:)
    integer :: i, place

    boundary%name = group%name
    kind = ''
    allocate (boundary%groups(0), components(0), displacement(0), traction(0), velocity(0))
    allocate (boundary%time(0), boundary%factor(0))
    call group%take('kind', kind, 'What is imposed.', choices=KINDS, required=.true.)
    call group%take_list('group', boundary%groups, 'Physical groups of the mesh, by name or '// &
                         'number.', required=.true.)
    call group%take_list('components', components, 'Components of the displacement that '// &
                         'are prescribed, of ''x'', ''y'', ''z''; all by default. x is the '// &
                         'radius and y the axis in an axisymmetric problem.')
    call group%take_list('velocity', velocity, 'length/time', 'Velocity, for kind ''velocity''.')
    call group%take_list('displacement', displacement, 'length', 'Displacement where the '// &
                         'factor is 1, for kind ''displacement''.')
    call group%take_list('traction', traction, 'stress', 'Force per undeformed area where the '// &
                         'factor is 1, for kind ''traction''.')
    call group%take('pressure', boundary%pressure, 'stress', 'Pressure on the present area '// &
                    'where the factor is 1, for kind ''pressure''.')
    call group%take_list('time', boundary%time, 'time', 'Times of the factor, ascending.')
    call group%take_list('factor', boundary%factor, '1', 'Factor of the displacement, traction '// &
                         'or pressure at each time, linear in between; 1 throughout by default.')
    if (group%explaining) return

    call refuse_idle_keys(group, kind)
    boundary%prescribed(:n_dim) = .true.
    if (size(components) > 0) then
      boundary%prescribed = .false.
      do i = 1, size(components)
        place = findloc(AXIS_NAMES(:n_dim), trim(components(i)), dim=1)
        if (place == 0) then
          call group%refuse('components', 'must be of '//merge('x, y, z', 'x, y   ', n_dim == 3))
        else
          boundary%prescribed(place) = .true.
        end if
      end do
    end if
    call check_polygon(group, boundary)

    select case (kind)
    case ('symmetry')
      boundary%kind = BOUNDARY_SYMMETRY
    case ('velocity')
      boundary%kind = BOUNDARY_MOTION
      call take_vector(group, 'velocity', velocity, n_dim, boundary%velocity)
    case ('displacement')
      boundary%kind = BOUNDARY_MOTION
      call take_vector(group, 'displacement', displacement, n_dim, boundary%value)
      if (size(boundary%time) == 0) then
        call group%refuse('displacement', 'needs `time` and `factor`, which say how it is reached')
      end if
    case ('traction')
      boundary%kind = BOUNDARY_TRACTION
      call take_vector(group, 'traction', traction, n_dim, boundary%value)
    case ('pressure')
      boundary%kind = BOUNDARY_PRESSURE
      if (.not. group%given('pressure')) call group%refuse('pressure', 'must be given')
    case default
      boundary%kind = BOUNDARY_MOTION
    end select

  end subroutine boundary_from_group

  !> Record the keys in a group made for explaining.
  subroutine explain_boundary(group)
    type(group_t), intent(inout) :: group

    type(boundary_t) :: ignored

    call boundary_from_group(group, 3, ignored)

  end subroutine explain_boundary

  pure function boundary_displacement_at(self, time) result(displacement)
    class(boundary_t), intent(in) :: self
    !> [time]
    real(wp), intent(in) :: time
    !> [length]
    real(wp) :: displacement(3)

    displacement = self%velocity * time + self%value * self%factor_at(time)

  end function boundary_displacement_at

  pure function boundary_factor_at(self, time) result(factor)
    class(boundary_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: factor

    integer :: i, n

    factor = 1.0_wp
    n = size(self%time)
    if (n == 0) return
    if (time <= self%time(1)) then
      factor = self%factor(1)
    else if (time >= self%time(n)) then
      factor = self%factor(n)
    else
      do i = 2, n - 1
        if (time < self%time(i)) exit
      end do
      factor = self%factor(i - 1) + (self%factor(i) - self%factor(i - 1)) &
        * (time - self%time(i - 1)) / (self%time(i) - self%time(i - 1))
    end if

  end function boundary_factor_at

  !> Huge when there is none.
  pure function boundary_next_event(self, time) result(event)
    class(boundary_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: event

    event = minval(self%time, mask=self%time > time)

  end function boundary_next_event

  !> A vector of the space dimension, or of three components whose idle ones are zero.
  subroutine take_vector(group, key, list, n_dim, vector)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: list(:)
    integer, intent(in) :: n_dim
    real(wp), intent(inout) :: vector(3)

    if (size(list) == 0) then
      call group%refuse(key, 'must be given')
    else if (size(list) /= n_dim .and. size(list) /= 3) then
      call group%refuse(key, merge('must have 2 components', 'must have 3 components', n_dim == 2))
    else if (any(abs(list(n_dim + 1:)) > 0.0_wp)) then
      call group%refuse(key, 'must have no third component in two dimensions')
    else
      vector(:size(list)) = list
    end if

  end subroutine take_vector

  !> What a kind does not use must not be given.
  subroutine refuse_idle_keys(group, kind)
    type(group_t), intent(inout) :: group
    character(len=*), intent(in) :: kind

    character(len=12), parameter :: KEYS(*) = [character(len=12) :: &
      'velocity', 'displacement', 'traction', 'pressure']
    logical :: loads
    integer :: i

    do i = 1, size(KEYS)
      if (KEYS(i) == kind) cycle
      if (group%given(trim(KEYS(i)))) then
        call group%refuse(trim(KEYS(i)), 'means nothing to kind '''//kind//'''')
      end if
    end do
    loads = kind == 'displacement' .or. kind == 'traction' .or. kind == 'pressure'
    if (group%given('factor') .and. .not. loads) then
      call group%refuse('factor', 'means nothing to kind '''//kind//'''')
    end if
    if (group%given('time') .and. .not. loads) then
      call group%refuse('time', 'means nothing to kind '''//kind//'''')
    end if
    if (group%given('components') .and. &
        .not. any(kind == [character(len=12) :: 'fixed', 'velocity', 'displacement'])) then
      call group%refuse('components', 'means nothing to kind '''//kind//'''')
    end if

  end subroutine refuse_idle_keys

  !> Times ascend, and each has a factor.
  subroutine check_polygon(group, boundary)
    type(group_t), intent(inout) :: group
    type(boundary_t), intent(in) :: boundary

    integer :: n

    n = size(boundary%time)
    if (size(boundary%factor) /= n) then
      call group%refuse('factor', 'must have as many values as `time`')
    else if (n > 1) then
      if (any(boundary%time(2:) <= boundary%time(:n - 1))) then
        call group%refuse('time', 'must ascend')
      end if
    end if

  end subroutine check_polygon

end module swage_boundary
