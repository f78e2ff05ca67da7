!> Checks of [[swage_mechanics]] that need the input as a whole, before the first step.
submodule(swage_mechanics) swage_mechanics_checks
  use swage_boundary, only: BOUNDARY_MOTION, BOUNDARY_SYMMETRY
  use swage_group, only: group_t
  use swage_cell_geometry, only: AXISYMMETRIC
  use swage_rotation, only: cross_product
  use swage_status, only: EXIT_MESH, STATUS_ERROR
  implicit none(type, external)

  !> Rigid motions of a body; rotations about the middle of what holds it.
  character(len=*), parameter :: RIGID_MOTIONS(6) = [character(len=19) :: &
    'translation along x', 'translation along y', 'translation along z', &
    'rotation about x', 'rotation about y', 'rotation about z']
  !> A motion is free when what holds it is below this share of what holds the best held one;
  !> shares are squares.
  real(wp), parameter :: UNHELD = 1.0e-12_wp

contains

  module procedure check_whole

    call check_axis(self, deck, status)
    if (status%failed()) return
    call check_motions(self, status)
    if (status%failed()) return
    call check_support(self, deck, status)

  end procedure check_whole

  !> Collective. The mesh lies on one side of the axis.
  subroutine check_axis(self, deck, status)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    type(group_t) :: group
    integer :: i

    if (self%settings%kind /= AXISYMMETRIC) return
    do i = 1, self%mesh%n_node
      if (self%mesh%coordinates(1, i) >= -1.0e-9_wp * self%cell_size) cycle
      call deck%get_only('job', group, status)
      call status%raise(STATUS_ERROR, 'check_axis', group%describe('dimension')//': node '// &
                        text(int(self%mesh%node_tag(i)))//' of the mesh lies at the negative '// &
                        'radius x = '//text(self%mesh%coordinates(1, i))//': draw the section '// &
                        'on the side of positive x', EXIT_MESH)
      exit
    end do
    call self%comm%agree(status)

  end subroutine check_axis

  !> Collective. Boundaries agree with each other, between all kinks of their motions.
  subroutine check_motions(self, status)
    type(mechanics_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    integer :: i
    logical :: is_last
    real(wp) :: event

    self%time_new = 0.0_wp
    do
      self%time = self%time_new
      event = huge(1.0_wp)
      do i = 1, size(self%boundaries)
        event = min(event, self%boundaries(i)%boundary%next_event(self%time))
      end do
      is_last = event >= huge(1.0_wp)
      self%time_new = event
      if (is_last) self%time_new = self%time + 1.0_wp
      call prescribe_motion(self, status)
      call self%comm%agree(status)
      if (is_last .or. status%failed()) exit
    end do
    self%time = 0.0_wp
    self%time_new = 0.0_wp

  end subroutine check_motions

  !> Collective. Boundaries hold all bodies taken together against rigid motions. Contacts may hold
  !> what boundaries do not: then only the run can tell.
  subroutine check_support(self, deck, status)
    type(mechanics_t), intent(in) :: self
    type(deck_t), intent(in) :: deck
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: free
    integer :: i

    if (size(self%contacts) + size(self%pairs) > 0) return
    associate (motions => free_motions(self))
      if (size(motions) == 0) return
      free = trim(RIGID_MOTIONS(motions(1)))
      do i = 2, size(motions)
        free = free//', '//trim(RIGID_MOTIONS(motions(i)))
      end do
    end associate
    call status%raise(STATUS_ERROR, 'check_support', deck%path//': nothing holds the bodies '// &
                      'against '//free//': add a &boundary (kind = ''fixed'' or ''symmetry'', '// &
                      '`components`) or a &contact')

  end subroutine check_support

  !> Collective. Rigid motions that the boundaries leave free, as numbers of `RIGID_MOTIONS`.
  function free_motions(self) result(motions)
    type(mechanics_t), intent(in) :: self
    integer, allocatable :: motions(:)

    real(wp) :: centre(4), gram(6, 6), largest, reach, row(6), x(3)
    logical :: is_left(6)
    integer :: i, j, k, n

    n = self%mesh%dimension
    centre = 0.0_wp
    do i = 1, self%constraints%n_constrained
      centre(:n) = centre(:n) &
        + self%mesh%coordinates(:, self%unknowns%mesh_node(self%constraints%node(i)))
      centre(4) = centre(4) + 1.0_wp
    end do
    call self%comm%sum(centre)
    centre(:3) = centre(:3) / max(centre(4), 1.0_wp)
    reach = self%cell_size
    do i = 1, self%mesh%n_node
      reach = max(reach, norm2(self%mesh%coordinates(:, i) - centre(:n)))
    end do
    call self%comm%max(reach)

    ! How boundaries hold the motions: the sum of r r^T over all constrained directions d at x, with
    ! r the part of each motion along d
    gram = 0.0_wp
    do i = 1, self%constraints%n_constrained
      x = 0.0_wp
      x(:n) = (self%mesh%coordinates(:, self%unknowns%mesh_node(self%constraints%node(i))) &
               - centre(:n)) / reach
      do k = 1, self%constraints%n_direction(i)
        row = 0.0_wp
        row(:n) = self%constraints%axes(:, k, i)
        row(4:) = cross_product(x, row(:3))
        do j = 1, 6
          gram(:, j) = gram(:, j) + row * row(j)
        end do
      end do
    end do
    do j = 1, 6
      call self%comm%sum(gram(:, j))
    end do

    ! Elimination with the largest pivot: what is left cannot be told from no support
    is_left = [.true., .true., n == 3, n == 3, n == 3, .true.]
    if (self%settings%kind == AXISYMMETRIC) is_left = [.false., .true., (.false., i=1, 4)]
    largest = 0.0_wp
    do while (any(is_left))
      j = maxloc([(gram(i, i), i=1, 6)], dim=1, mask=is_left)
      largest = max(largest, gram(j, j))
      if (gram(j, j) <= UNHELD * largest) exit
      is_left(j) = .false.
      row = gram(:, j) / gram(j, j)
      do i = 1, 6
        if (is_left(i)) gram(:, i) = gram(:, i) - row * gram(j, i)
      end do
    end do
    motions = pack([(i, i=1, 6)], is_left)

  end function free_motions

end submodule swage_mechanics_checks
