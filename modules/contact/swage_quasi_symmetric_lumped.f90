!> Quasi-symmetric contact with the lumped projection: the slave's pressure acts on the master as
!> \(M_{bb}\, S \lambda\) with \(S = \mathrm{diag}(A_b)^{-1} M_{ba}\), where
!> \((M_{ba})_{jk} = \int N_j^b N_k\, dS\) over the slave, \(M_{bb}\) is the mass matrix of the
!> master and \(A_b\) the sums of its rows. It spreads forces one facet further than the consistent
!> projection.
!>
!> The dual gap distributes positions as forces are,
!> \(g_k = \frac{1}{A_k} \int N_k\, n \cdot (x - \sum_j N_j^b \tilde x_j)\, dS\) with
!> \(\tilde x = \mathrm{diag}(A_b)^{-1} M_{bb}\, x\); `averaged` is that of [[swage_averaged_gap]].
!> On smoothed surfaces it is that of the points themselves, \(\frac{1}{A_k} \int N_k\, p\, dS\):
!> \(\tilde x\) lies \(h^2 / 6R\) under a curved surface, and beside x, at a rim by \(h / 3\), so
!> that a turn of the normal, which is not in the derivatives, would change the gap by as much as
!> what the bodies do. The tangent is not symmetric then.
!> Derivatives are those for fixed points on the slave; smoothed normals count as fixed in them.
!> Source: eq. 11 of the paper in docs/theory.
module swage_quasi_symmetric_lumped
  use swage_averaged_gap, only: averaged_gap_t
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_overlap, only: contact_overlap_t, find_overlap, overlap_point_t
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_vertices, only: contact_vertices_t
  use swage_kinds, only: wp
  use swage_overlap_stiffness, only: master_pull, next_pair_stiffness, pair_stiffness_t
  use swage_rotation, only: normalised
  implicit none(type, external)
  private

  public :: quasi_symmetric_lumped_t, quasi_symmetric_lumped_create

  !> Least share of a node's area that makes a condition.
  real(wp), parameter :: SMALLEST_SHARE = 1.0e-6_wp

  real(wp), parameter :: NO_SLOPE(3) = 0.0_wp
  !> Nodes around a master node, itself among them.
  integer, parameter :: MOST_NEAR = 64

  type, extends(contact_formulation_t) :: quasi_symmetric_lumped_t
    private
    logical :: averaged = .false.
    type(contact_overlap_t) :: overlap
    type(averaged_gap_t) :: distances
    type(contact_vertices_t) :: vertices
  contains
    procedure :: evaluate => quasi_symmetric_lumped_evaluate
    procedure :: stiffness => quasi_symmetric_lumped_stiffness
  end type quasi_symmetric_lumped_t

contains

  subroutine quasi_symmetric_lumped_create(choice, formulation)
    !> `gap`, `quadrature` and `n_point` count.
    type(contact_choice_t), intent(in) :: choice
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    type(quasi_symmetric_lumped_t), allocatable :: made

    allocate (made)
    made%averaged = choice%gap == 'averaged'
    made%overlap%clipped = choice%quadrature == 'clipped'
    made%overlap%n_point = choice%n_point
    call move_alloc(made, formulation)

  end subroutine quasi_symmetric_lumped_create

  !> See [[contact_formulation_t:evaluate]].
  subroutine quasi_symmetric_lumped_evaluate(self, pair, mine, rows)
    class(quasi_symmetric_lumped_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    logical, intent(in) :: mine(:)
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, i, j, k, n, n_met, node, q
    logical :: asked(pair%n_node)
    real(wp) :: area, gap, near, normal(3), share, spread(3, pair%n_node)
    !> Of a slave node with the master nodes it meets: the integrals of the products of their shape
    !> functions, without and with the normal, and which nodes these are.
    real(wp) :: meeting(pair%n_node), vector(3, pair%n_node)
    integer :: met(pair%n_node)

    n = pair%slave%n_dim
    call find_overlap(pair, mine, self%overlap)
    asked = .false.
    do q = 1, self%overlap%n
      asked(pair%master%facet(:, self%overlap%point(q)%master_facet)) = .true.
    end do
    if (self%averaged) then
      call self%distances%prepare(pair, mine, asked)
    else if (.not. pair%smoothing) then
      call spread_positions(pair, asked, spread)
    end if
    meeting = 0.0_wp
    vector = 0.0_wp
    call self%vertices%find(pair, mine)
    call rows%start(pair%n_node)
    do k = 1, size(pair%slave%node)
      node = pair%slave%node(k)
      if (.not. mine(node)) cycle
      area = 0.0_wp
      gap = 0.0_wp
      normal = 0.0_wp
      n_met = 0
      do i = pair%slave%first(node), pair%slave%first(node + 1) - 1
        near = pair%slave%face_share(pair%slave%around(i), pair%slave%around_corner(i))
        do q = self%overlap%first(pair%slave%around(i)), &
          self%overlap%first(pair%slave%around(i) + 1) - 1
          associate (point => self%overlap%point(q))
            share = near * point%area * point%slave_weight(pair%slave%around_corner(i))
            area = area + share
            normal = normal + share * point%normal
            do a = 1, n
              j = pair%master%facet(a, point%master_facet)
              if (.not. any(met(:n_met) == j)) then
                n_met = n_met + 1
                met(n_met) = j
                meeting(j) = 0.0_wp
                vector(:, j) = 0.0_wp
              end if
              meeting(j) = meeting(j) + share * point%master_weight(a)
              vector(:, j) = vector(:, j) + share * point%master_weight(a) * point%normal
            end do
          end associate
        end do
      end do
      call self%vertices%weigh(node, area, gap, normal)
      if (area <= SMALLEST_SHARE * pair%slave%area(node)) cycle
      call rows%begin_row(node, node, normalised(normal), 0.0_wp, area)
      call add_slave_side(self, pair, node, rows)
      do i = 1, n_met
        call add_master_side(pair, met(i), meeting(met(i)), vector(:, met(i)), rows)
      end do
      if (self%averaged) then
        call self%distances%finish_row(pair%slave%vertex_share(node), met(:n_met), &
                                       meeting(met(:n_met)), rows)
      else
        if (.not. pair%smoothing) then
          ! What the forces have is the derivative for fixed points and normals
          do i = rows%first(rows%n_row), rows%first(rows%n_row + 1) - 1
            rows%slope(:, i) = -rows%force(:, i)
          end do
        end if
        do i = pair%slave%first(node), pair%slave%first(node + 1) - 1
          do q = self%overlap%first(pair%slave%around(i)), &
            self%overlap%first(pair%slave%around(i) + 1) - 1
            if (pair%smoothing) then
              call add_own_gap(pair, self%overlap%point(q), pair%slave%around_corner(i), gap, rows)
            else
              call add_dual_gap(pair, self%overlap%point(q), pair%slave%around_corner(i), spread, &
                                gap, rows)
            end if
          end do
        end do
        rows%gap(rows%n_row) = gap / area
      end if
      call self%vertices%add_forces(node, .not. self%averaged, rows)
    end do
    call self%vertices%put(rows)

  end subroutine quasi_symmetric_lumped_evaluate

  !> Positions of master nodes as the projection spreads them.
  subroutine spread_positions(pair, asked, spread)
    type(contact_pair_t), intent(in) :: pair
    !> Shape (n_node).
    logical, intent(in) :: asked(:)
    !> [length]; shape (3, n_node).
    real(wp), intent(out) :: spread(:, :)

    integer :: a, i, j, k
    real(wp) :: column(3)

    spread = 0.0_wp
    associate (master => pair%master)
      do k = 1, size(master%node)
        j = master%node(k)
        if (.not. asked(j)) cycle
        do i = master%first(j), master%first(j + 1) - 1
          column = master%pressed_mass(master%around(i), master%around_corner(i))
          do a = 1, master%n_dim
            spread(:, j) = spread(:, j) + column(a) / master%pressed_area(j) &
              * master%x(:, master%facet(a, master%around(i)))
          end do
        end do
      end do
    end associate

  end subroutine spread_positions

  !> Add what a point gives to area times gap, and to its derivative by turning normals and moving
  !> weights.
  subroutine add_dual_gap(pair, point, corner, spread, gap, rows)
    type(contact_pair_t), intent(in) :: pair
    type(overlap_point_t), intent(in) :: point
    integer, intent(in) :: corner
    real(wp), intent(in) :: spread(:, :)
    real(wp), intent(inout) :: gap
    type(contact_rows_t), intent(inout) :: rows

    real(wp), parameter :: NO_FORCE(3) = 0.0_wp

    integer :: a, j
    real(wp) :: beside(3), gradient(3, 3), pull(3, 3), slope(3), turned(3), whole, x(3)

    whole = pair%slave%face_share(point%slave_facet, corner) &
      * point%area * point%slave_weight(corner)
    x = pair%slave%point(point%slave_facet, point%slave_weight)
    call master_pull(pair, point, pull)
    beside = 0.0_wp
    turned = 0.0_wp
    do a = 1, pair%master%n_dim
      j = pair%master%facet(a, point%master_facet)
      beside = beside + point%master_weight(a) * (x - spread(:, j))
      turned = turned + dot_product(point%normal, x - spread(:, j)) * pull(:, a)
    end do
    gap = gap + whole * dot_product(point%normal, beside)
    gradient = pair%slave%gradients(point%slave_facet)
    do a = 1, pair%slave%n_dim
      slope = point%slave_weight(a) * turned + (point%penetration &
        * dot_product(turned, gradient(:, a)) - dot_product(beside, gradient(:, a))) * point%normal
      call rows%add(pair%slave%facet(a, point%slave_facet), NO_FORCE, whole * slope, 0.0_wp)
      slope = -point%master_weight(a) * turned
      call rows%add(pair%master%facet(a, point%master_facet), NO_FORCE, whole * slope, 0.0_wp)
    end do

  end subroutine add_dual_gap

  !> Add what a point of smoothed surfaces gives to area times gap, and to its derivative.
  subroutine add_own_gap(pair, point, corner, gap, rows)
    type(contact_pair_t), intent(in) :: pair
    type(overlap_point_t), intent(in) :: point
    integer, intent(in) :: corner
    real(wp), intent(inout) :: gap
    type(contact_rows_t), intent(inout) :: rows

    real(wp), parameter :: NO_FORCE(3) = 0.0_wp

    integer :: a
    real(wp) :: slope(3), whole

    whole = pair%slave%face_share(point%slave_facet, corner) &
      * point%area * point%slave_weight(corner)
    gap = gap + whole * point%penetration
    do a = 1, pair%slave%n_dim
      slope = whole * point%slave_weight(a) * point%climb
      call rows%add(pair%slave%facet(a, point%slave_facet), NO_FORCE, slope, 0.0_wp)
      slope = -whole * point%master_weight(a) * point%climb
      call rows%add(pair%master%facet(a, point%master_facet), NO_FORCE, slope, 0.0_wp)
    end do

  end subroutine add_own_gap

  subroutine add_slave_side(self, pair, node, rows)
    type(quasi_symmetric_lumped_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: node
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, i, q
    real(wp) :: near, share

    do i = pair%slave%first(node), pair%slave%first(node + 1) - 1
      associate (f => pair%slave%around(i))
        near = pair%slave%face_share(f, pair%slave%around_corner(i))
        do q = self%overlap%first(f), self%overlap%first(f + 1) - 1
          associate (point => self%overlap%point(q))
            do a = 1, pair%slave%n_dim
              share = near * point%area * point%slave_weight(pair%slave%around_corner(i)) &
                * point%slave_weight(a)
              call rows%add(pair%slave%facet(a, f), -share * point%normal, NO_SLOPE, share)
            end do
          end associate
        end do
      end associate
    end do

  end subroutine add_slave_side

  !> The column of the master's mass matrix that belongs to one of its nodes.
  subroutine add_master_side(pair, node, meeting, vector, rows)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: node
    real(wp), intent(in) :: meeting
    real(wp), intent(in) :: vector(3)
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, i
    real(wp) :: column(3), share

    associate (master => pair%master)
      do i = master%first(node), master%first(node + 1) - 1
        column = master%pressed_mass(master%around(i), master%around_corner(i))
        do a = 1, master%n_dim
          share = column(a) / master%pressed_area(node)
          call rows%add(master%facet(a, master%around(i)), share * vector, NO_SLOPE, &
                        -share * meeting)
        end do
      end do
    end associate

  end subroutine add_master_side

  !> See [[contact_formulation_t:stiffness]]: for fixed points on the slave.
  subroutine quasi_symmetric_lumped_stiffness(self, pair, rows, lambda, blocks)
    class(quasi_symmetric_lumped_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    type(contact_rows_t), intent(in) :: rows
    real(wp), intent(in) :: lambda(:)
    type(contact_blocks_t), intent(inout) :: blocks

    integer :: a, b, i, n, n_near, near(MOST_NEAR), point, row
    real(wp) :: pressure(pair%n_node), share(MOST_NEAR)
    type(pair_stiffness_t) :: part

    n = pair%slave%n_dim
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
        do a = 1, n
          call find_near(pair, master_node(a), n_near, near, share)
          do b = 1, n
            if (.not. pair%smoothing) then
              call blocks%add(slave_node(a), slave_node(b), part%slave_by_slave(:, :, a, b))
            end if
            do i = 1, n_near
              call blocks%add(near(i), slave_node(b), share(i) * part%master_by_slave(:, :, a, b))
              call blocks%add(near(i), master_node(b), share(i) * part%master_by_master(:, :, a, b))
            end do
          end do
        end do
      end associate
    end do
    call self%vertices%stiffen(pressure, blocks)

  end subroutine quasi_symmetric_lumped_stiffness

  !> The nodes that share the force on a master node, and their shares.
  subroutine find_near(pair, node, n_near, near, share)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: node
    integer, intent(out) :: n_near
    integer, intent(out) :: near(MOST_NEAR)
    real(wp), intent(out) :: share(MOST_NEAR)

    integer :: a, i, place
    real(wp) :: column(3)

    n_near = 0
    near = 0
    share = 0.0_wp
    associate (master => pair%master)
      do i = master%first(node), master%first(node + 1) - 1
        column = master%pressed_mass(master%around(i), master%around_corner(i)) &
          / master%pressed_area(node)
        do a = 1, master%n_dim
          place = findloc(near(:n_near), master%facet(a, master%around(i)), dim=1)
          if (place == 0) then
            ! A node with more neighbours loses the last ones' derivatives, not their forces
            if (n_near == MOST_NEAR) cycle
            n_near = n_near + 1
            place = n_near
            near(place) = master%facet(a, master%around(i))
          end if
          share(place) = share(place) + column(a)
        end do
      end do
    end associate

  end subroutine find_near

end module swage_quasi_symmetric_lumped
