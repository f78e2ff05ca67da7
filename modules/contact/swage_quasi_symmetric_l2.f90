!> Quasi-symmetric contact with the projection of least squares: a mortar method.
!>
!> The pressure \(\lambda = \sum_k N_k \lambda_k\) lives on the slave; its consistent projection
!> acts on the master:
!> \(f_j = -\sum_k \lambda_k \int N_k N_j n\, dS\) on slave nodes,
!> \(f_j = \sum_k \lambda_k \int N_k N_j^b n\, dS\) on master nodes,
!> both integrated with the same points, so that the forces of each point balance. The gap is the
!> dual one, \(g_k = \frac{1}{A_k} \int N_k\, p\, dS\) with \(A_k = \int N_k\, dS\). Integrals are
!> over that part of the slave that meets the master; facets that gape where others at the node
!> touch count for little in them ([[contact_surface_t:near_share]]). A vertex that
!> touches with none of its facets has a condition at the node ([[swage_contact_vertices]]).
!>
!> `slope` is the derivative of the gap for fixed points on the slave. Facets' normals turn in it,
!> smoothed ones count as fixed. Where the facets of both sides are parallel it is the opposite of
!> `force`. The gap `averaged` is that of [[swage_averaged_gap]].
!> Source: eq. 11 of the paper in docs/theory.
module swage_quasi_symmetric_l2
  use swage_averaged_gap, only: averaged_gap_t
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_overlap, only: contact_overlap_t, find_overlap
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_vertices, only: contact_vertices_t
  use swage_kinds, only: wp
  use swage_overlap_stiffness, only: next_pair_stiffness, pair_stiffness_t
  use swage_rotation, only: normalised
  implicit none(type, external)
  private

  public :: quasi_symmetric_l2_t, quasi_symmetric_l2_create

  !> Least share of a node's area that makes a condition.
  real(wp), parameter :: SMALLEST_SHARE = 1.0e-6_wp

  type, extends(contact_formulation_t) :: quasi_symmetric_l2_t
    private
    logical :: averaged = .false.
    type(contact_overlap_t) :: overlap
    type(averaged_gap_t) :: distances
    type(contact_vertices_t) :: vertices
  contains
    procedure :: evaluate => quasi_symmetric_l2_evaluate
    procedure :: stiffness => quasi_symmetric_l2_stiffness
    procedure :: admits_self => quasi_symmetric_l2_admits_self
  end type quasi_symmetric_l2_t

contains

  subroutine quasi_symmetric_l2_create(choice, formulation)
    !> `gap`, `quadrature` and `n_point` count.
    type(contact_choice_t), intent(in) :: choice
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    type(quasi_symmetric_l2_t), allocatable :: made

    allocate (made)
    made%averaged = choice%gap == 'averaged'
    made%overlap%clipped = choice%quadrature == 'clipped'
    made%overlap%n_point = choice%n_point
    call move_alloc(made, formulation)

  end subroutine quasi_symmetric_l2_create

  !> See [[contact_formulation_t:evaluate]].
  subroutine quasi_symmetric_l2_evaluate(self, pair, mine, rows)
    class(quasi_symmetric_l2_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    logical, intent(in) :: mine(:)
    type(contact_rows_t), intent(inout) :: rows

    integer :: i, k, node, q
    logical :: asked(pair%n_node)
    real(wp) :: area, gap, near, normal(3), share

    call find_overlap(pair, mine, self%overlap)
    if (self%averaged) then
      asked = .false.
      do q = 1, self%overlap%n
        asked(pair%master%facet(:, self%overlap%point(q)%master_facet)) = .true.
      end do
      call self%distances%prepare(pair, mine, asked)
    end if
    call self%vertices%find(pair, mine)
    call rows%start(pair%n_node)
    do k = 1, size(pair%slave%node)
      node = pair%slave%node(k)
      if (.not. mine(node)) cycle
      area = 0.0_wp
      gap = 0.0_wp
      normal = 0.0_wp
      do i = pair%slave%first(node), pair%slave%first(node + 1) - 1
        associate (f => pair%slave%around(i), a => pair%slave%around_corner(i), &
                   point => self%overlap%point)
          near = pair%slave%face_share(f, a)
          do q = self%overlap%first(f), self%overlap%first(f + 1) - 1
            share = near * point(q)%area * point(q)%slave_weight(a)
            area = area + share
            gap = gap + share * point(q)%penetration
            normal = normal + share * point(q)%normal
          end do
        end associate
      end do
      call self%vertices%weigh(node, area, gap, normal)
      if (area <= SMALLEST_SHARE * pair%slave%area(node)) cycle
      call rows%begin_row(node, node, normalised(normal), gap / area, area)
      do i = pair%slave%first(node), pair%slave%first(node + 1) - 1
        associate (f => pair%slave%around(i), a => pair%slave%around_corner(i))
          q = self%overlap%first(f)
          do while (q < self%overlap%first(f + 1))
            call add_points_of_pair(pair, self%overlap, a, self%averaged, q, rows)
          end do
        end associate
      end do
      call self%vertices%add_forces(node, .not. self%averaged, rows)
      if (self%averaged) call average_gap(self, pair, node, rows)
    end do
    call self%vertices%put(rows)

  end subroutine quasi_symmetric_l2_evaluate

  !> Weights of the master nodes are the integrals of products of shape functions.
  subroutine average_gap(self, pair, node, rows)
    type(quasi_symmetric_l2_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: node
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, i, j, n_met, place, q
    integer, allocatable :: met(:)
    real(wp) :: near
    real(wp), allocatable :: weight(:)

    ! No more than the entries of the row
    j = rows%first(rows%n_row + 1) - rows%first(rows%n_row)
    allocate (met(j), weight(j))
    n_met = 0
    do i = pair%slave%first(node), pair%slave%first(node + 1) - 1
      associate (f => pair%slave%around(i))
        near = pair%slave%face_share(f, pair%slave%around_corner(i))
        do q = self%overlap%first(f), self%overlap%first(f + 1) - 1
          associate (point => self%overlap%point(q))
            do a = 1, pair%master%n_dim
              j = pair%master%facet(a, point%master_facet)
              place = findloc(met(:n_met), j, dim=1)
              if (place == 0) then
                n_met = n_met + 1
                place = n_met
                met(place) = j
                weight(place) = 0.0_wp
              end if
              weight(place) = weight(place) + near * point%area &
                * point%slave_weight(pair%slave%around_corner(i)) * point%master_weight(a)
            end do
          end associate
        end do
      end associate
    end do
    call self%distances%finish_row(pair%slave%vertex_share(node), met(:n_met), weight(:n_met), rows)

  end subroutine average_gap

  !> Add what the points of a slave facet with one master facet give to the condition of a corner.
  subroutine add_points_of_pair(pair, overlap, corner, without_slope, q, rows)
    type(contact_pair_t), intent(in) :: pair
    type(contact_overlap_t), intent(in) :: overlap
    integer, intent(in) :: corner
    logical, intent(in) :: without_slope
    !> The first of these points; on return the one after them.
    integer, intent(inout) :: q
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, f, m, n
    !> Of the slave's corners, then the master's; `sway` is what turning normals add to the slope.
    real(wp) :: force(3, 6), gradient(3, 3), near, share(6), slope(3, 6), sway(3), whole

    n = pair%slave%n_dim
    f = overlap%point(q)%slave_facet
    m = overlap%point(q)%master_facet
    force = 0.0_wp
    slope = 0.0_wp
    share = 0.0_wp
    gradient = 0.0_wp
    if (.not. pair%smoothing) gradient = pair%slave%gradients(f)
    near = pair%slave%face_share(f, corner)
    do while (q < overlap%first(f + 1))
      if (overlap%point(q)%master_facet /= m) exit
      associate (point => overlap%point(q))
        whole = near * point%area * point%slave_weight(corner)
        sway = whole * point%penetration * point%normal
        do a = 1, n
          associate (on_slave => whole * point%slave_weight(a), &
                     on_master => whole * point%master_weight(a))
            share(a) = share(a) + on_slave
            share(3 + a) = share(3 + a) - on_master
            force(:, a) = force(:, a) - on_slave * point%normal
            force(:, 3 + a) = force(:, 3 + a) + on_master * point%normal
            slope(:, a) = slope(:, a) + on_slave * point%climb &
              + dot_product(point%climb, gradient(:, a)) * sway
            slope(:, 3 + a) = slope(:, 3 + a) - on_master * point%climb
          end associate
        end do
      end associate
      q = q + 1
    end do
    if (without_slope) slope = 0.0_wp
    do a = 1, n
      call rows%add(pair%slave%facet(a, f), force(:, a), slope(:, a), share(a))
      call rows%add(pair%master%facet(a, m), force(:, 3 + a), slope(:, 3 + a), share(3 + a))
    end do

  end subroutine add_points_of_pair

  !> See [[contact_formulation_t:stiffness]]: for fixed points on the slave.
  subroutine quasi_symmetric_l2_stiffness(self, pair, rows, lambda, blocks)
    class(quasi_symmetric_l2_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    type(contact_rows_t), intent(in) :: rows
    real(wp), intent(in) :: lambda(:)
    type(contact_blocks_t), intent(inout) :: blocks

    integer :: a, b, point, row
    real(wp) :: pressure(pair%n_node)
    type(pair_stiffness_t) :: part

    pressure = 0.0_wp
    do row = 1, rows%n_row
      pressure(rows%slave(row)) = lambda(row)
    end do
    call blocks%start()
    point = 1
    do
      call next_pair_stiffness(pair, self%overlap, pressure, point, part)
      if (part%slave_facet == 0) exit
      associate (slave_node => pair%slave%facet(:, part%slave_facet), &
                 master_node => pair%master%facet(:, part%master_facet))
        do b = 1, pair%slave%n_dim
          do a = 1, pair%slave%n_dim
            if (.not. pair%smoothing) then
              call blocks%add(slave_node(a), slave_node(b), part%slave_by_slave(:, :, a, b))
            end if
            call blocks%add(master_node(a), slave_node(b), part%master_by_slave(:, :, a, b))
            call blocks%add(master_node(a), master_node(b), part%master_by_master(:, :, a, b))
          end do
        end do
      end associate
    end do
    call self%vertices%stiffen(pressure, blocks)

  end subroutine quasi_symmetric_l2_stiffness

  !> The averaged gap tells the distances of both sides apart by their nodes.
  pure function quasi_symmetric_l2_admits_self(self) result(admits)
    class(quasi_symmetric_l2_t), intent(in) :: self
    logical :: admits

    admits = .not. self%averaged

  end function quasi_symmetric_l2_admits_self

end module swage_quasi_symmetric_l2
