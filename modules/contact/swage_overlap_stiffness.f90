!> Derivative of the forces of quadrature points of an overlap, by the corners of both facets.
!>
!> A point with the load L (pressure times area) and the normal n out of the slave puts the force
!> \(-L N_a n\) on corners of its slave facet and \(L N_j n\) on those of its master facet. It is
!> fixed on the slave; smoothed normals count as fixed.
module swage_overlap_stiffness
  use swage_contact_overlap, only: contact_overlap_t, overlap_point_t
  use swage_contact_pair, only: contact_pair_t
  use swage_kinds, only: wp
  use swage_rotation, only: dyadic
  implicit none(type, external)
  private

  public :: pair_stiffness_t, next_pair_stiffness, master_pull

  !> Sums over the points that one slave facet has with one master facet.
  type :: pair_stiffness_t
    integer :: slave_facet = 0
    integer :: master_facet = 0
    !> Forces on the slave by positions of the slave, forces on the master by positions of either;
    !> corners of the forces, then of the positions [stress*length]; shape (3, 3, 3, 3).
    real(wp) :: slave_by_slave(3, 3, 3, 3) = 0.0_wp
    real(wp) :: master_by_slave(3, 3, 3, 3) = 0.0_wp
    real(wp) :: master_by_master(3, 3, 3, 3) = 0.0_wp
  end type pair_stiffness_t

contains

  !> The stiffness of the next pair of facets with a load.
  subroutine next_pair_stiffness(pair, overlap, pressure, point, stiffness)
    type(contact_pair_t), intent(in) :: pair
    type(contact_overlap_t), intent(in) :: overlap
    !> Of the slave nodes [stress]; shape (n_node).
    real(wp), intent(in) :: pressure(:)
    !> First point that has not been looked at; 1 at the start. On return beyond those of the pair.
    integer, intent(inout) :: point
    !> Its facets are 0 when there is no further pair.
    type(pair_stiffness_t), intent(out) :: stiffness

    integer :: a, n
    real(wp) :: load

    n = pair%slave%n_dim
    do while (point <= overlap%n)
      associate (here => overlap%point(point))
        if (stiffness%slave_facet > 0 .and. (here%slave_facet /= stiffness%slave_facet .or. &
                                             here%master_facet /= stiffness%master_facet)) return
        load = 0.0_wp
        do a = 1, n
          load = load + pair%slave%near_share(here%slave_facet, a) * here%slave_weight(a) &
            * pressure(pair%slave%facet(a, here%slave_facet))
        end do
        load = here%area * load
        if (abs(load) > 0.0_wp) then
          stiffness%slave_facet = here%slave_facet
          stiffness%master_facet = here%master_facet
          call add_point(pair, here, load, stiffness)
        end if
      end associate
      point = point + 1
    end do

  end subroutine next_pair_stiffness

  subroutine add_point(pair, point, load, stiffness)
    type(contact_pair_t), intent(in) :: pair
    type(overlap_point_t), intent(in) :: point
    !> [force]
    real(wp), intent(in) :: load
    type(pair_stiffness_t), intent(inout) :: stiffness

    integer :: a, b
    real(wp) :: along(3, 3, 3), block(3, 3), gradient(3, 3), pull(3, 3), straight(3, 3)

    call master_pull(pair, point, pull)
    gradient = 0.0_wp
    if (.not. pair%smoothing) gradient = pair%slave%gradients(point%slave_facet)
    straight = load * point%penetration * dyadic(point%normal, point%normal)
    do a = 1, pair%slave%n_dim
      along(:, :, a) = load * dyadic(point%normal, pull(:, a))
    end do
    associate (slave => point%slave_weight, master => point%master_weight)
      do b = 1, pair%slave%n_dim
        block = load * dyadic(gradient(:, b), point%normal)
        do a = 1, pair%slave%n_dim
          stiffness%slave_by_slave(:, :, a, b) = stiffness%slave_by_slave(:, :, a, b) &
            + slave(a) * block
          stiffness%master_by_slave(:, :, a, b) = stiffness%master_by_slave(:, :, a, b) &
            + slave(b) * along(:, :, a) - master(a) * block &
            + dot_product(pull(:, a), gradient(:, b)) * straight
          stiffness%master_by_master(:, :, a, b) = stiffness%master_by_master(:, :, a, b) &
            - master(b) * along(:, :, a)
        end do
      end do
    end associate

  end subroutine add_point

  !> How the weights on the master change when the point moves across the normal.
  pure subroutine master_pull(pair, point, pull)
    type(contact_pair_t), intent(in) :: pair
    type(overlap_point_t), intent(in) :: point
    !> Of each corner [1/length].
    real(wp), intent(out) :: pull(3, 3)

    integer :: a

    pull = pair%master%gradients(point%master_facet)
    do a = 1, pair%master%n_dim
      pull(:, a) = pull(:, a) - dot_product(pull(:, a), point%normal) * point%climb
    end do

  end subroutine master_pull

end module swage_overlap_stiffness
