!> Quasi-symmetric contact with interpolation: the slave's pressure is read at the feet of the
!> master nodes, \(\hat\lambda_j = \sum_k S_{jk} \lambda_k\), and acts there as
!> \(\sum_j M_{bb,ij} \hat\lambda_j n_j\). The forces on both sides then differ a little: the master
!> integrates what is interpolated between its nodes, and kinks of the slave's pressure between
!> them make it too much (section 6.2 of docs/theory). The gap is [[swage_averaged_gap]] with the
!> weights \(A_j S_{jk}\). The stiffness is left out. Vertices are those of
!> [[swage_contact_vertices]]. For comparison.
!> Source: eq. 11 of the paper in docs/theory.
module swage_quasi_symmetric_interpolation
  use swage_averaged_gap, only: averaged_gap_t
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_vertices, only: contact_vertices_t
  use swage_kinds, only: wp
  use swage_relation, only: relation_t
  implicit none(type, external)
  private

  public :: quasi_symmetric_interpolation_t, quasi_symmetric_interpolation_create

  real(wp), parameter :: NO_SLOPE(3) = 0.0_wp

  !> Share by which a facet counts for a slave node below which it gapes apart: a master node that
  !> sees it sees nothing of that node. Greater shares are taken whole, for a pressure that jumps at
  !> the side of a facet is read worse than one with a kink: the master's force under a roller was
  !> 2e-3 off, however small the cells.
  real(wp), parameter :: SEES_A_GAP = 1.0e-3_wp

  type, extends(contact_formulation_t) :: quasi_symmetric_interpolation_t
    private
    type(averaged_gap_t) :: distances
    type(contact_vertices_t) :: vertices
    !> Conditions of master nodes whose feet lie on facets of a slave node.
    type(relation_t) :: seen_by
  contains
    procedure :: evaluate => quasi_symmetric_interpolation_evaluate
    procedure :: stiffness => quasi_symmetric_interpolation_stiffness
    procedure :: balances => quasi_symmetric_interpolation_balances
  end type quasi_symmetric_interpolation_t

contains

  subroutine quasi_symmetric_interpolation_create(choice, formulation)
    !> Nothing of it counts.
    type(contact_choice_t), intent(in) :: choice
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    type(quasi_symmetric_interpolation_t), allocatable :: made

    associate (unused => choice)
    end associate
    allocate (made)
    call move_alloc(made, formulation)

  end subroutine quasi_symmetric_interpolation_create

  !> See [[contact_formulation_t:evaluate]].
  subroutine quasi_symmetric_interpolation_evaluate(self, pair, mine, rows)
    class(quasi_symmetric_interpolation_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    logical, intent(in) :: mine(:)
    type(contact_rows_t), intent(inout) :: rows

    integer :: corner, i, k, n_seen, seen
    integer, allocatable :: master_node(:)
    logical :: all_nodes(pair%n_node)
    real(wp) :: own_share, seen_by_all, vertex
    real(wp), allocatable :: weight(:)

    all_nodes = .true.
    call self%distances%prepare(pair, mine, all_nodes)
    call self%distances%find_seen(pair%n_node, self%seen_by)
    allocate (master_node(self%distances%master%n), weight(self%distances%master%n))
    call self%vertices%find(pair, mine)
    call rows%start(pair%n_node)
    do i = 1, self%distances%slave%n
      associate (own => self%distances%slave%item(i))
        k = own%slave
        vertex = pair%slave%vertex_share(k)
        call rows%begin_row(k, k, -own%foot%normal, 0.0_wp, own%area)
        if (vertex > 0.0_wp) call own%add_forces(vertex * own%area, .true., .false., rows)
      end associate
      call add_slave_side(pair, k, 1.0_wp - vertex, rows)
      n_seen = 0
      seen_by_all = 0.0_wp
      do seen = self%seen_by%first(k), self%seen_by%first(k + 1) - 1
        associate (other => self%distances%master%item(self%seen_by%item(seen)))
          n_seen = n_seen + 1
          master_node(n_seen) = other%slave
          corner = findloc(other%foot%node, k, dim=1)
          seen_by_all = seen_by_all + other%foot%weight(corner) * other%area
          weight(n_seen) = other%foot%weight(corner)
          if (pair%slave%face_share(other%foot%facet, corner) < SEES_A_GAP) weight(n_seen) = 0.0_wp
          call add_master_side(pair, other%slave, (1.0_wp - vertex) * weight(n_seen), &
                               other%foot%normal, rows)
          weight(n_seen) = weight(n_seen) * other%area
        end associate
      end do
      own_share = 1.0_wp
      if (seen_by_all > 0.0_wp) then
        own_share = 1.0_wp - (1.0_wp - vertex) * sum(weight(:n_seen)) / seen_by_all
      end if
      call self%distances%finish_row(own_share, master_node(:n_seen), weight(:n_seen), rows)
    end do
    call self%vertices%put(rows)

  end subroutine quasi_symmetric_interpolation_evaluate

  subroutine add_slave_side(pair, node, factor, rows)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: node
    !> On the areas [1].
    real(wp), intent(in) :: factor
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, i
    real(wp) :: column(3), normal(3), share

    associate (slave => pair%slave)
      do i = slave%first(node), slave%first(node + 1) - 1
        column = slave%pressed_mass(slave%around(i), slave%around_corner(i))
        normal = slave%normal(:, slave%around(i))
        do a = 1, slave%n_dim
          if (pair%smoothing) normal = slave%sector_normal(:, slave%sector(a, slave%around(i)))
          share = factor * column(a)
          call rows%add(slave%facet(a, slave%around(i)), -share * normal, NO_SLOPE, share)
        end do
      end do
    end associate

  end subroutine add_slave_side

  !> The column of the master's mass matrix that belongs to one of its nodes.
  subroutine add_master_side(pair, node, weight, normal, rows)
    type(contact_pair_t), intent(in) :: pair
    integer, intent(in) :: node
    real(wp), intent(in) :: weight
    !> Out of the slave.
    real(wp), intent(in) :: normal(3)
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, i
    real(wp) :: column(3), share

    associate (master => pair%master)
      do i = master%first(node), master%first(node + 1) - 1
        column = master%pressed_mass(master%around(i), master%around_corner(i))
        do a = 1, master%n_dim
          share = weight * column(a)
          call rows%add(master%facet(a, master%around(i)), share * normal, NO_SLOPE, -share)
        end do
      end do
    end associate

  end subroutine add_master_side

  !> See [[contact_formulation_t:stiffness]]: none.
  subroutine quasi_symmetric_interpolation_stiffness(self, pair, rows, lambda, blocks)
    class(quasi_symmetric_interpolation_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    type(contact_rows_t), intent(in) :: rows
    real(wp), intent(in) :: lambda(:)
    type(contact_blocks_t), intent(inout) :: blocks

    associate (unused_1 => self, unused_2 => pair, unused_3 => rows, unused_4 => lambda)
    end associate
    call blocks%start()

  end subroutine quasi_symmetric_interpolation_stiffness

  pure function quasi_symmetric_interpolation_balances(self) result(balances)
    class(quasi_symmetric_interpolation_t), intent(in) :: self
    logical :: balances

    associate (unused => self)
    end associate
    balances = .false.

  end function quasi_symmetric_interpolation_balances

end module swage_quasi_symmetric_interpolation
