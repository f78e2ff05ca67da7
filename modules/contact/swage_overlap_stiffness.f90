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

  !> Sums of loads over points with one normal.
  type :: load_sums_t
    !> First of the points.
    integer :: first = 0
    !> Load times weights of the corners [force], and times penetration [force*length].
    real(wp) :: slave(3) = 0.0_wp
    real(wp) :: master(3) = 0.0_wp
    real(wp) :: penetration = 0.0_wp
  end type load_sums_t

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

    integer :: facet, n
    real(wp) :: load, node_load(3)
    type(load_sums_t) :: sums

    n = pair%slave%n_dim
    facet = 0
    node_load = 0.0_wp
    do while (point <= overlap%n)
      associate (here => overlap%point(point))
        if (stiffness%slave_facet > 0 .and. (here%slave_facet /= stiffness%slave_facet .or. &
                                             here%master_facet /= stiffness%master_facet)) exit
        if (here%slave_facet /= facet) then
          facet = here%slave_facet
          node_load(:n) = nodal_loads(pair, facet, pressure)
        end if
        load = here%area * dot_product(here%slave_weight(:n), node_load(:n))
        if (abs(load) > 0.0_wp) then
          if (stiffness%slave_facet == 0) sums%first = point
          stiffness%slave_facet = here%slave_facet
          stiffness%master_facet = here%master_facet
          if (pair%smoothing) then
            call start_sums(here, load, sums)
            call add_sums(pair, here, sums, stiffness)
          else
            call add_to_sums(here, load, sums)
          end if
        end if
      end associate
      point = point + 1
    end do
    if (stiffness%slave_facet == 0 .or. pair%smoothing) return
    call add_sums(pair, overlap%point(sums%first), sums, stiffness)

  end subroutine next_pair_stiffness

  !> Pressures of the corners of a slave facet as far as it counts for them.
  pure function nodal_loads(pair, facet, pressure) result(load)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: facet
    real(wp), intent(in) :: pressure(:)
    real(wp) :: load(pair%slave%n_dim)

    integer :: a

    do a = 1, pair%slave%n_dim
      load(a) = pair%slave%face_share(facet, a) * pressure(pair%slave%facet(a, facet))
    end do

  end function nodal_loads

  pure subroutine start_sums(point, load, sums)
    type(overlap_point_t), intent(in) :: point
    real(wp), intent(in) :: load
    type(load_sums_t), intent(inout) :: sums

    sums%slave = 0.0_wp
    sums%master = 0.0_wp
    sums%penetration = 0.0_wp
    call add_to_sums(point, load, sums)

  end subroutine start_sums

  pure subroutine add_to_sums(point, load, sums)
    type(overlap_point_t), intent(in) :: point
    !> [force]
    real(wp), intent(in) :: load
    type(load_sums_t), intent(inout) :: sums

    sums%slave = sums%slave + load * point%slave_weight
    sums%master = sums%master + load * point%master_weight
    sums%penetration = sums%penetration + load * point%penetration

  end subroutine add_to_sums

  !> Add what the points of some sums give, which have the normal of one of them.
  subroutine add_sums(pair, point, sums, stiffness)
    type(contact_pair_t), intent(in) :: pair
    type(overlap_point_t), intent(in) :: point
    type(load_sums_t), intent(in) :: sums
    type(pair_stiffness_t), intent(inout) :: stiffness

    integer :: a, b
    real(wp) :: across(3, 3), along(3, 3, 3), gradient(3, 3), pull(3, 3), straight(3, 3)

    call master_pull(pair, point, pull)
    gradient = 0.0_wp
    if (.not. pair%smoothing) gradient = pair%slave%gradients(point%slave_facet)
    straight = sums%penetration * dyadic(point%normal, point%normal)
    do a = 1, pair%slave%n_dim
      along(:, :, a) = dyadic(point%normal, pull(:, a))
    end do
    do b = 1, pair%slave%n_dim
      across = dyadic(gradient(:, b), point%normal)
      do a = 1, pair%slave%n_dim
        stiffness%slave_by_slave(:, :, a, b) = stiffness%slave_by_slave(:, :, a, b) &
          + sums%slave(a) * across
        stiffness%master_by_slave(:, :, a, b) = stiffness%master_by_slave(:, :, a, b) &
          + sums%slave(b) * along(:, :, a) - sums%master(a) * across &
          + dot_product(pull(:, a), gradient(:, b)) * straight
        stiffness%master_by_master(:, :, a, b) = stiffness%master_by_master(:, :, a, b) &
          - sums%master(b) * along(:, :, a)
      end do
    end do

  end subroutine add_sums

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
