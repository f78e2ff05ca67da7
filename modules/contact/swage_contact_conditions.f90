!> Conditions of contact at single points of a surface: nodes or quadrature points, each with its
!> foot on the other surface.
module swage_contact_conditions
  use swage_contact_foot, only: contact_foot_t
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_surface, only: contact_surface_t
  use swage_facet_quadrature, only: facet_quadrature
  use swage_kinds, only: wp
  use swage_rotation, only: dyadic
  implicit none(type, external)
  private

  public :: contact_condition_t, condition_list_t
  public :: node_conditions, point_conditions, point_owners

  !> A point of the slave, its area and its foot on the master.
  type :: contact_condition_t
    !> Node and number of the condition, as of [[contact_rows_t]].
    integer :: slave = 0
    integer :: key = 0
    !> Nodes whose weighted mean the point is.
    integer :: n = 0
    integer :: node(3) = 0
    real(wp) :: weight(3) = 0.0_wp
    !> [length^2]
    real(wp) :: area = 0.0_wp
    type(contact_foot_t) :: foot
  contains
    !> Make it a row.
    procedure :: put => contact_condition_put
    !> Add its forces to the present row.
    procedure :: add_forces => contact_condition_add_forces
    !> Add a multiple of the derivative of its penetration to `slope` of the present row.
    procedure :: add_slope => contact_condition_add_slope
    !> Add the derivative of its forces.
    procedure :: stiffen => contact_condition_stiffen
  end type contact_condition_t

  !> A growing list; `item(:n)` count.
  type :: condition_list_t
    integer :: n = 0
    type(contact_condition_t), allocatable :: item(:)
  contains
    !> Add one.
    procedure :: append => condition_list_append
    !> Add the derivatives of the forces of rows that are those of the list, in its order.
    procedure :: stiffen => condition_list_stiffen
  end type condition_list_t

contains

  subroutine contact_condition_put(self, factor, reacts, rows)
    class(contact_condition_t), intent(in) :: self
    !> On the area.
    real(wp), intent(in) :: factor
    !> True when the master gets the opposite force.
    logical, intent(in) :: reacts
    type(contact_rows_t), intent(inout) :: rows

    real(wp) :: area

    area = factor * self%area
    call rows%begin_row(self%slave, self%key, -self%foot%normal, self%foot%penetration, area)
    call self%add_forces(area, reacts, .true., rows)

  end subroutine contact_condition_put

  subroutine contact_condition_add_forces(self, area, reacts, has_slope, rows)
    class(contact_condition_t), intent(in) :: self
    !> [length^2]
    real(wp), intent(in) :: area
    !> True when the master gets the opposite force.
    logical, intent(in) :: reacts
    !> False when the gap of the row is another one.
    logical, intent(in) :: has_slope
    type(contact_rows_t), intent(inout) :: rows

    integer :: a
    real(wp) :: share, slope

    associate (foot => self%foot)
      do a = 1, self%n
        share = area * self%weight(a)
        slope = merge(share, 0.0_wp, has_slope)
        call rows%add(self%node(a), share * foot%normal, -slope * foot%climb, share)
      end do
      do a = 1, 3
        if (foot%node(a) == 0 .or. .not. abs(foot%weight(a)) > 0.0_wp) cycle
        share = area * foot%weight(a)
        slope = merge(share, 0.0_wp, has_slope)
        call rows%add(foot%node(a), merge(-share, 0.0_wp, reacts) * foot%normal, &
                      slope * foot%climb, -share)
      end do
    end associate

  end subroutine contact_condition_add_forces

  subroutine contact_condition_add_slope(self, factor, rows)
    class(contact_condition_t), intent(in) :: self
    !> [length^2]
    real(wp), intent(in) :: factor
    type(contact_rows_t), intent(inout) :: rows

    real(wp), parameter :: NO_FORCE(3) = 0.0_wp

    integer :: a

    associate (foot => self%foot)
      do a = 1, self%n
        call rows%add(self%node(a), NO_FORCE, -factor * self%weight(a) * foot%climb, 0.0_wp)
      end do
      do a = 1, 3
        if (foot%node(a) == 0 .or. .not. abs(foot%weight(a)) > 0.0_wp) cycle
        call rows%add(foot%node(a), NO_FORCE, factor * foot%weight(a) * foot%climb, 0.0_wp)
      end do
    end associate

  end subroutine contact_condition_add_slope

  !> See [[swage_contact_foot]] for the derivatives.
  subroutine contact_condition_stiffen(self, load, reacts, blocks)
    class(contact_condition_t), intent(in) :: self
    !> Pressure times area [force].
    real(wp), intent(in) :: load
    logical, intent(in) :: reacts
    type(contact_blocks_t), intent(inout) :: blocks

    integer :: a, b, j
    real(wp) :: moved(3, 3), pulled(3, 3), turned(3, 3)

    associate (foot => self%foot)
      do a = 1, self%n
        do b = 1, self%n
          call blocks%add(self%node(a), self%node(b), &
                          load * self%weight(a) * self%weight(b) * foot%turn)
        end do
        do j = 1, 3
          if (foot%node(j) == 0) cycle
          call blocks%add(self%node(a), foot%node(j), load * self%weight(a) * normal_by(j))
        end do
      end do
      if (.not. reacts) return
      do a = 1, 3
        if (foot%node(a) == 0) cycle
        pulled = dyadic(foot%normal, foot%pull(:, a))
        moved = -load * (pulled + foot%weight(a) * foot%turn)
        do b = 1, self%n
          call blocks%add(foot%node(a), self%node(b), self%weight(b) * moved)
        end do
        do j = 1, 3
          if (foot%node(j) == 0) cycle
          turned = foot%penetration * dot_product(foot%gradient(:, a), foot%gradient(:, j)) &
            * dyadic(foot%normal, foot%normal)
          call blocks%add(foot%node(a), foot%node(j), &
                          load * (foot%weight(j) * pulled + turned &
                                  - foot%weight(a) * normal_by(j)))
        end do
      end do
    end associate

  contains

    !> Derivative of the normal by the position of a corner of the foot's facet.
    pure function normal_by(corner) result(derivative)
      integer, intent(in) :: corner
      real(wp) :: derivative(3, 3)

      derivative = -self%foot%weight(corner) * self%foot%turn &
        - dyadic(self%foot%gradient(:, corner), self%foot%normal)

    end function normal_by

  end subroutine contact_condition_stiffen

  !> Conditions at the nodes of one surface against another.
  subroutine node_conditions(pair, slave, master, mine, list)
    !> How far conditions are looked for.
    type(contact_pair_t), intent(in) :: pair
    type(contact_surface_t), intent(in) :: slave
    type(contact_surface_t), intent(in) :: master
    !> Shape (n_node).
    logical, intent(in) :: mine(:)
    !> Appended to.
    type(condition_list_t), intent(inout) :: list

    integer, parameter :: MOST = 32

    integer :: k, n, node
    real(wp) :: towards(3, MOST)
    type(contact_condition_t) :: condition

    do k = 1, size(slave%node)
      node = slave%node(k)
      if (.not. mine(node)) cycle
      call slave%normals_at(node, n, towards)
      call pair%find_foot(master, [node], slave%x(:, node), towards(:, :n), pair%smoothing, &
                          condition%foot)
      if (condition%foot%facet == 0) cycle
      condition%slave = node
      condition%key = node
      condition%n = 1
      condition%node(1) = node
      condition%weight(1) = 1.0_wp
      condition%area = slave%pressed_area(node)
      call list%append(condition)
    end do

  end subroutine node_conditions

  !> Conditions at the quadrature points of the facets of one surface against another.
  !>
  !> A condition belongs to the corner that has the greatest weight there, of several that have it
  !> the first.
  subroutine point_conditions(pair, slave, master, n_point, key_offset, mine, list)
    !> How far conditions are looked for.
    type(contact_pair_t), intent(in) :: pair
    type(contact_surface_t), intent(in) :: slave
    type(contact_surface_t), intent(in) :: master
    integer, intent(in) :: n_point
    !> Key before the first one's.
    integer, intent(in) :: key_offset
    !> Shape (n_node).
    logical, intent(in) :: mine(:)
    !> Appended to.
    type(condition_list_t), intent(inout) :: list

    !> A point this far outside a facet, by weight, still meets it.
    real(wp), parameter :: ON_SIDE = 1.0e-9_wp

    integer :: f, n, owner, q
    real(wp) :: x(3)
    real(wp), allocatable :: barycentric(:, :), weight(:)
    type(contact_condition_t) :: condition

    n = slave%n_dim
    call facet_quadrature(n, n_point, barycentric, weight)
    condition%n = n
    do f = 1, slave%n_facet
      associate (node => slave%facet(:, f))
        if (.not. any(mine(node))) cycle
        do q = 1, n_point
          owner = owner_of(node, barycentric(:n, q))
          if (.not. mine(owner)) cycle
          x = slave%point(f, barycentric(:, q))
          if (pair%smoothing) x = x + slave%rise(f, barycentric(:, q)) * slave%normal(:, f)
          call pair%find_foot(master, node, x, slave%normal(:, f:f), pair%smoothing, condition%foot)
          if (condition%foot%facet == 0) cycle
          ! Beyond a rim: unlike a node, a point has never been on it
          if (minval(condition%foot%weight(:n)) < -ON_SIDE) cycle
          if (pair%is_beside(slave, master, f, x, condition%foot%penetration)) cycle
          condition%slave = owner
          condition%key = key_offset + (f - 1) * n_point + q
          condition%node(:n) = node
          condition%weight = barycentric(:, q)
          condition%area = weight(q) * slave%measure(f, barycentric(:, q))
          call list%append(condition)
        end do
      end associate
    end do

  end subroutine point_conditions

  !> The nearest corner of a facet, of equals the one with the lowest number.
  pure function owner_of(node, barycentric) result(owner)
    !> Corners; shape (n_dim).
    integer, intent(in) :: node(:)
    !> Their weights; shape of `node`.
    real(wp), intent(in) :: barycentric(:)
    integer :: owner

    !> Weights that differ by less are the same.
    real(wp), parameter :: SAME = 1.0e-6_wp

    owner = minval(node, mask=barycentric > maxval(barycentric) - SAME)

  end function owner_of

  !> Slave nodes of the conditions of [[point_conditions]].
  subroutine point_owners(slave, n_point, key_offset, owner)
    type(contact_surface_t), intent(in) :: slave
    integer, intent(in) :: n_point
    !> Key before the first one's.
    integer, intent(in) :: key_offset
    !> Set at the keys of these conditions.
    integer, intent(inout) :: owner(:)

    integer :: f, n, q
    real(wp), allocatable :: barycentric(:, :), weight(:)

    n = slave%n_dim
    call facet_quadrature(n, n_point, barycentric, weight)
    do f = 1, slave%n_facet
      do q = 1, n_point
        owner(key_offset + (f - 1) * n_point + q) = owner_of(slave%facet(:, f), barycentric(:n, q))
      end do
    end do

  end subroutine point_owners

  pure subroutine condition_list_append(self, condition)
    class(condition_list_t), intent(inout) :: self
    type(contact_condition_t), intent(in) :: condition

    integer, parameter :: ROOM = 64

    type(contact_condition_t), allocatable :: longer(:)

    if (.not. allocated(self%item)) allocate (self%item(ROOM))
    if (self%n == size(self%item)) then
      allocate (longer(2 * self%n))
      longer(:self%n) = self%item
      call move_alloc(longer, self%item)
    end if
    self%n = self%n + 1
    self%item(self%n) = condition

  end subroutine condition_list_append

  subroutine condition_list_stiffen(self, rows, lambda, reacts, blocks)
    class(condition_list_t), intent(in) :: self
    type(contact_rows_t), intent(in) :: rows
    !> Pressures [stress]; shape (n_row).
    real(wp), intent(in) :: lambda(:)
    !> True when the master gets the opposite force.
    logical, intent(in) :: reacts
    type(contact_blocks_t), intent(inout) :: blocks

    integer :: i

    do i = 1, self%n
      if (abs(lambda(i)) > 0.0_wp) then
        call self%item(i)%stiffen(lambda(i) * rows%area(i), reacts, blocks)
      end if
    end do

  end subroutine condition_list_stiffen

end module swage_contact_conditions
