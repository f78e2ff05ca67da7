!> Two deformable surfaces that may touch, and how far around their contact is looked for.
module swage_contact_pair
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
    !> Take new positions as those of the start of a step: areas, and what edges are sharp.
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

  pure subroutine contact_pair_begin_step(self, x)
    class(contact_pair_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    call self%slave%begin_step(x)
    call self%master%begin_step(x)

  end subroutine contact_pair_begin_step

  pure subroutine contact_pair_update(self, x)
    class(contact_pair_t), intent(inout) :: self
    !> [length]; shape (3, n_node).
    real(wp), intent(in) :: x(:, :)

    call self%slave%update(x)
    call self%master%update(x)

  end subroutine contact_pair_update

end module swage_contact_pair
