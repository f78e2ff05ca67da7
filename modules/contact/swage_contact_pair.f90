!> Two deformable surfaces that may touch, and how far around their contact is looked for.
!>
!> They may be one surface that folds onto itself: slave and master have the same facets. A point
!> then sees none of the facets around the nodes next to its own, nor the other side of its own
!> wall: what it lies under by more than half the thickness of the wall does not count. Both walls
!> have conditions, and each one half of the weight.
module swage_contact_pair
  use swage_contact_foot, only: contact_foot_t, FACING, find_foot, find_gap, is_beside, &
    is_within, SELF_FACING, thickness_below
  use swage_contact_surface, only: contact_surface_create, contact_surface_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: contact_pair_t, contact_pair_create

  !> Each rank holds both surfaces whole.
  type :: contact_pair_t
    type(contact_surface_t) :: slave
    type(contact_surface_t) :: master
    !> Surface nodes, of these and all other surfaces.
    integer :: n_node = 0
    !> Largest distance that still makes a condition, and largest penetration: what is deeper
    !> belongs to the other side of a body [length].
    real(wp) :: reach = 0.0_wp
    real(wp) :: depth = 0.0_wp
    !> One interpolated normal field for projection and force, instead of the facets' normals.
    logical :: smoothing = .false.
    !> Slave and master are the same surface.
    logical :: is_self = .false.
    !> Of the wall under each node of a surface that meets itself, at the start of the step, no more
    !> than matters; at first it follows from how the bodies are drawn, then from what it was
    !> [length]; shape (n_node), (0) otherwise.
    real(wp), allocatable :: thickness(:)
    !> Facets of the slave, then of the master, that are inside the other body at the start of the
    !> step, so deep that they have no conditions.
    logical, allocatable :: is_buried(:)
    !> Vertices that touch with none of their facets have conditions of their own.
    logical :: has_vertices = .true.
  contains
    !> Take new positions as those of the start of a step: areas, what of them counts, and what
    !> edges are sharp.
    procedure :: begin_step => contact_pair_begin_step
    !> Take new positions.
    procedure :: update => contact_pair_update
    !> The foot of a point of one of the surfaces on the other.
    procedure :: find_foot => contact_pair_find_foot
    !> Largest penetration that counts for a point.
    procedure :: depth_at => contact_pair_depth_at
    !> True when a facet of the master may oppose one of the slave.
    procedure :: may_meet => contact_pair_may_meet
    !> True when a point of a facet is out of the other body by a much shorter way than its foot.
    procedure :: is_beside => contact_pair_is_beside
    !> Where a surface has gone so deep into the other one in the step that it has no conditions.
    procedure :: find_lost => contact_pair_find_lost
  end type contact_pair_t

contains

  !> Make a pair without positions; call `begin_step` next.
  pure subroutine contact_pair_create(n_dim, axisymmetric, slave_facet, master_facet, n_node, &
                                      reach, depth, smoothing, feature_angle, pair)
    integer, intent(in) :: n_dim
    logical, intent(in) :: axisymmetric
    !> Corners, places in the list of surface nodes, outward oriented as [[contact_surface_t]]
    !> wants them; shapes (n_dim, :).
    integer, intent(in) :: slave_facet(:, :)
    integer, intent(in) :: master_facet(:, :)
    integer, intent(in) :: n_node
    !> [length], positive.
    real(wp), intent(in) :: reach
    real(wp), intent(in) :: depth
    logical, intent(in) :: smoothing
    !> [radian]
    real(wp), intent(in) :: feature_angle
    type(contact_pair_t), intent(out) :: pair

    call contact_surface_create(n_dim, axisymmetric, slave_facet, n_node, feature_angle, pair%slave)
    call contact_surface_create(n_dim, axisymmetric, master_facet, n_node, feature_angle, &
                                pair%master)
    pair%n_node = n_node
    pair%reach = reach
    pair%depth = depth
    pair%smoothing = smoothing
    pair%is_self = size(slave_facet) == size(master_facet)
    if (pair%is_self) pair%is_self = all(slave_facet == master_facet)
    allocate (pair%thickness(merge(n_node, 0, pair%is_self)), source=0.0_wp)

  end subroutine contact_pair_create

  subroutine contact_pair_begin_step(self, x)
    class(contact_pair_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    call self%slave%begin_step(x)
    call self%master%begin_step(x)
    if (self%is_self) call measure_walls(self)
    call weigh_facets(self, self%master, self%slave)
    call weigh_facets(self, self%slave, self%master)
    call find_buried(self, self%is_buried)

  end subroutine contact_pair_begin_step

  !> Facets whose middle is inside the other body without a foot there. Walls of one surface are not
  !> looked at: inside of one of them is the body itself.
  subroutine find_buried(pair, is_buried)
    type(contact_pair_t), intent(in) :: pair
    !> Shape (facets of the slave and the master).
    logical, allocatable, intent(out) :: is_buried(:)

    allocate (is_buried(pair%slave%n_facet + pair%master%n_facet), source=.false.)
    if (pair%is_self) return
    call look(pair%slave, pair%master, is_buried(:pair%slave%n_facet))
    call look(pair%master, pair%slave, is_buried(pair%slave%n_facet + 1:))

  contains

    subroutine look(surface, other, inside)
      type(contact_surface_t), intent(in) :: surface
      type(contact_surface_t), intent(in) :: other
      logical, intent(inout) :: inside(:)

      !> Depth, by the largest that counts, which is no matter of rounding or of a rim; and distance
      !> of the nearest facet that is looked at.
      real(wp), parameter :: CLEARLY = 0.1_wp, FAR = 2.0_wp

      integer :: f
      real(wp) :: middle(3), x(3)
      type(contact_foot_t) :: foot

      middle = 0.0_wp
      middle(:surface%n_dim) = 1.0_wp / surface%n_dim
      do f = 1, surface%n_facet
        x = surface%point(f, middle)
        if (.not. is_within(other, x, CLEARLY * pair%depth, FAR * pair%depth)) cycle
        call pair%find_foot(other, surface%facet(:, f), x, surface%normal(:, f:f), .false., foot)
        inside(f) = foot%facet == 0
      end do

    end subroutine look

  end subroutine find_buried

  !> See [[swage_contact_foot:is_beside]].
  pure function contact_pair_is_beside(self, surface, other, f, x, penetration) result(beside)
    class(contact_pair_t), intent(in) :: self
    !> The point's surface, and the other one.
    type(contact_surface_t), intent(in) :: surface
    type(contact_surface_t), intent(in) :: other
    !> Facet of the point.
    integer, intent(in) :: f
    !> [length]
    real(wp), intent(in) :: x(3)
    !> [length]
    real(wp), intent(in) :: penetration
    logical :: beside

    integer, parameter :: MOST = 32

    integer :: a, n
    real(wp) :: towards(3, MOST)

    beside = .false.
    if (self%is_self .or. .not. penetration > 0.0_wp) return
    do a = 1, surface%n_dim
      call surface%normals_at(surface%facet(a, f), n, towards)
      beside = beside .or. is_beside(other, x, towards(:, :n), penetration, self%depth)
    end do

  end function contact_pair_is_beside

  !> With the positions of the last update.
  subroutine contact_pair_find_lost(self, found, middle)
    class(contact_pair_t), intent(in) :: self
    logical, intent(out) :: found
    !> Of the first such facet [length].
    real(wp), intent(out) :: middle(3)

    integer :: f
    logical, allocatable :: is_buried(:)

    middle = 0.0_wp
    call find_buried(self, is_buried)
    f = findloc(is_buried .and. .not. self%is_buried, .true., dim=1)
    found = f > 0
    if (.not. found) return
    if (f <= self%slave%n_facet) then
      middle = sum(self%slave%x(:, self%slave%facet(:, f)), dim=2) / self%slave%n_dim
    else
      f = f - self%slave%n_facet
      middle = sum(self%master%x(:, self%master%facet(:, f)), dim=2) / self%master%n_dim
    end if

  end subroutine contact_pair_find_lost

  !> A wall gets thinner by less than half in a step.
  pure subroutine measure_walls(pair)
    type(contact_pair_t), intent(inout) :: pair

    !> Overlap of the drawing, by the reach, that is none of a wall with itself.
    real(wp), parameter :: DRAWN = 0.05_wp

    integer :: k
    real(wp) :: least

    do k = 1, size(pair%slave%node)
      associate (node => pair%slave%node(k))
        least = max(0.5_wp * pair%thickness(node), DRAWN * pair%reach)
        pair%thickness(node) = thickness_below(pair%slave, node, least, 2.0_wp * pair%depth)
      end associate
    end do

  end subroutine measure_walls

  pure function contact_pair_depth_at(self, own) result(depth)
    class(contact_pair_t), intent(in) :: self
    !> Nodes that the point is a mean of.
    integer, intent(in) :: own(:)
    real(wp) :: depth

    depth = self%depth
    if (self%is_self) depth = min(depth, 0.5_wp * minval(self%thickness(own)))

  end function contact_pair_depth_at

  pure function contact_pair_may_meet(self, slave_facet, master_facet) result(may)
    class(contact_pair_t), intent(in) :: self
    integer, intent(in) :: slave_facet
    integer, intent(in) :: master_facet
    logical :: may

    if (self%is_self) then
      may = .not. self%master%is_near(self%slave%facet(:, slave_facet), master_facet)
      may = may .and. dot_product(self%slave%normal_old(:, slave_facet), &
                                  self%master%normal_old(:, master_facet)) <= SELF_FACING
    else
      may = dot_product(self%slave%normal(:, slave_facet), self%master%normal(:, master_facet)) &
        <= FACING
    end if

  end function contact_pair_may_meet

  subroutine contact_pair_find_foot(self, other, own, x, towards, smoothing, foot)
    class(contact_pair_t), intent(in) :: self
    !> The surface that the point is not of.
    type(contact_surface_t), intent(in) :: other
    !> As of [[contact_pair_t:depth_at]].
    integer, intent(in) :: own(:)
    !> The point, and the normals there; see [[swage_contact_foot:find_foot]].
    real(wp), intent(in) :: x(3)
    real(wp), intent(in) :: towards(:, :)
    logical, intent(in) :: smoothing
    type(contact_foot_t), intent(out) :: foot

    if (self%is_self) then
      call find_foot(other, x, towards, self%reach, self%depth_at(own), smoothing, foot, own)
    else
      call find_foot(other, x, towards, self%reach, self%depth, smoothing, foot)
    end if

  end subroutine contact_pair_find_foot

  !> A facet counts when its middle sees the other surface, fully up to 60 degrees against it.
  subroutine weigh_facets(pair, other, surface)
    type(contact_pair_t), intent(in) :: pair
    type(contact_surface_t), intent(in) :: other
    type(contact_surface_t), intent(inout) :: surface

    real(wp), parameter :: FULL = -0.5_wp

    integer :: f
    real(wp) :: cosine, gap(surface%n_facet), middle(3), share(surface%n_facet), &
      vertex_gap(pair%n_node), x(3)
    type(contact_foot_t) :: foot

    middle = 0.0_wp
    middle(:surface%n_dim) = 1.0_wp / surface%n_dim
    share = 0.0_wp
    do f = 1, surface%n_facet
      x = surface%point(f, middle)
      call pair%find_foot(other, surface%facet(:, f), x, surface%normal(:, f:f), .false., foot)
      if (foot%facet == 0) then
        gap(f) = max(pair%reach, pair%depth)
        if (.not. pair%is_self) then
          call find_gap(other, x, surface%normal(:, f:f), max(pair%reach, pair%depth), gap(f))
        end if
        cycle
      end if
      gap(f) = -foot%penetration
      if (pair%smoothing) then
        gap(f) = gap(f) - surface%rise(f, middle) - other%rise(foot%facet, foot%weight)
      end if
      cosine = dot_product(surface%normal(:, f), other%normal(:, foot%facet))
      share(f) = min(max((cosine - FACING) / (FULL - FACING), 0.0_wp), 1.0_wp)
    end do
    call find_vertex_gaps(pair, other, surface, vertex_gap)
    call surface%take_shares(share, gap, vertex_gap)

  end subroutine weigh_facets

  subroutine find_vertex_gaps(pair, other, surface, gap)
    type(contact_pair_t), intent(in) :: pair
    type(contact_surface_t), intent(in) :: other
    type(contact_surface_t), intent(in) :: surface
    !> Of no matter how far where there is nothing opposite [length]; shape (n_node).
    real(wp), intent(out) :: gap(:)

    integer, parameter :: MOST = 32

    integer :: k, n, node
    real(wp) :: towards(3, MOST)
    type(contact_foot_t) :: foot

    gap = huge(1.0_wp)
    if (.not. pair%has_vertices) return
    do k = 1, size(surface%node)
      node = surface%node(k)
      if (.not. surface%is_vertex(node)) cycle
      call surface%normals_at(node, n, towards)
      call pair%find_foot(other, [node], surface%x(:, node), towards(:, :n), pair%smoothing, foot)
      if (foot%facet > 0) gap(node) = -foot%penetration
    end do

  end subroutine find_vertex_gaps

  pure subroutine contact_pair_update(self, x)
    class(contact_pair_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    call self%slave%update(x)
    call self%master%update(x)

  end subroutine contact_pair_update

end module swage_contact_pair
