!> Two deformable surfaces that may touch, and how far around their contact is looked for.
module swage_contact_pair
  use swage_contact_foot, only: contact_foot_t, FACING, find_foot, find_gap
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
  contains
    !> Take new positions as those of the start of a step: areas, what of them counts, and what
    !> edges are sharp.
    procedure :: begin_step => contact_pair_begin_step
    !> Take new positions.
    procedure :: update => contact_pair_update
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

  end subroutine contact_pair_create

  subroutine contact_pair_begin_step(self, x)
    class(contact_pair_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    call self%slave%begin_step(x)
    call self%master%begin_step(x)
    call weigh_facets(self, self%master, self%slave)
    call weigh_facets(self, self%slave, self%master)

  end subroutine contact_pair_begin_step

  !> A facet counts when its middle sees the other surface, fully up to 60 degrees against it.
  subroutine weigh_facets(pair, other, surface)
    type(contact_pair_t), intent(in) :: pair
    type(contact_surface_t), intent(in) :: other
    type(contact_surface_t), intent(inout) :: surface

    real(wp), parameter :: FULL = -0.5_wp

    integer :: f
    real(wp) :: cosine, gap(surface%n_facet), middle(3), share(surface%n_facet), x(3)
    type(contact_foot_t) :: foot

    middle = 0.0_wp
    middle(:surface%n_dim) = 1.0_wp / surface%n_dim
    share = 0.0_wp
    do f = 1, surface%n_facet
      x = surface%point(f, middle)
      call find_foot(other, x, surface%normal(:, f:f), pair%reach, pair%depth, .false., foot)
      if (foot%facet == 0) then
        call find_gap(other, x, surface%normal(:, f:f), max(pair%reach, pair%depth), gap(f))
        cycle
      end if
      gap(f) = -foot%penetration
      if (pair%smoothing) then
        gap(f) = gap(f) - surface%rise(f, middle) - other%rise(foot%facet, foot%weight)
      end if
      cosine = dot_product(surface%normal(:, f), other%normal(:, foot%facet))
      share(f) = min(max((cosine - FACING) / (FULL - FACING), 0.0_wp), 1.0_wp)
    end do
    call surface%take_shares(share, gap)

  end subroutine weigh_facets

  pure subroutine contact_pair_update(self, x)
    class(contact_pair_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    call self%slave%update(x)
    call self%master%update(x)

  end subroutine contact_pair_update

end module swage_contact_pair
