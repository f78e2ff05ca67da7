!> Quasi-symmetric contact at nodes: cheap, without integrals over surfaces, and variational.
!>
!> \(A_k g_k = \frac12 A_k p_k + \frac12 \sum_j A_j S_{jk} p_j\) with the penetration of the slave
!> node k into the master, those of the master nodes j into the slave, and the weight \(S_{jk}\) of
!> node k at the foot of j, times what the foot's facet counts for k
!> ([[contact_surface_t:face_share]]): what sees a gaping side must not lift its edge off. Forces
!> are the gradient of the energy, with the motion of the feet in it. A vertex that touches with
!> none of its facets ([[swage_contact_vertices]]) has its own distance alone, as far as it counts.
!> The second derivatives of the weights are left out of the stiffness.
!> Source: L. Fourment, S. Popa, J. Barboza, AIP Conf. Proc. 712 (2004), doi 10.1063/1.1766868.
module swage_quasi_symmetric_nodal
  use swage_averaged_gap, only: averaged_gap_t
  use swage_contact_conditions, only: contact_condition_t
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_vertices, only: contact_vertices_t
  use swage_kinds, only: wp
  use swage_relation, only: relation_t
  use swage_rotation, only: dyadic
  implicit none(type, external)
  private

  public :: quasi_symmetric_nodal_t, quasi_symmetric_nodal_create

  type, extends(contact_formulation_t) :: quasi_symmetric_nodal_t
    private
    type(averaged_gap_t) :: distances
    type(contact_vertices_t) :: vertices
    !> Conditions of master nodes whose feet lie on facets of a slave node.
    type(relation_t) :: seen_by
  contains
    procedure :: evaluate => quasi_symmetric_nodal_evaluate
    procedure :: stiffness => quasi_symmetric_nodal_stiffness
  end type quasi_symmetric_nodal_t

contains

  subroutine quasi_symmetric_nodal_create(choice, formulation)
    !> Nothing of it counts.
    type(contact_choice_t), intent(in) :: choice
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    type(quasi_symmetric_nodal_t), allocatable :: made

    associate (unused => choice)
    end associate
    allocate (made)
    call move_alloc(made, formulation)

  end subroutine quasi_symmetric_nodal_create

  !> See [[contact_formulation_t:evaluate]].
  subroutine quasi_symmetric_nodal_evaluate(self, pair, mine, rows)
    class(quasi_symmetric_nodal_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    logical, intent(in) :: mine(:)
    type(contact_rows_t), intent(inout) :: rows

    integer :: i, k, seen
    logical :: all_nodes(pair%n_node)
    real(wp) :: share

    all_nodes = .true.
    call self%distances%prepare(pair, mine, all_nodes)
    call self%distances%find_seen(pair%n_node, self%seen_by)
    call self%vertices%find(pair, mine)
    call rows%start(pair%n_node)
    do i = 1, self%distances%slave%n
      associate (own => self%distances%slave%item(i))
        k = own%slave
        share = 0.5_wp * (1.0_wp + pair%slave%vertex_share(k))
        call rows%begin_row(k, k, -own%foot%normal, share * own%foot%penetration, own%area)
        call add_penetration(own, share * own%area, 1.0_wp, rows)
        do seen = self%seen_by%first(k), self%seen_by%first(k + 1) - 1
          associate (other => self%distances%master%item(self%seen_by%item(seen)))
            call add_seen(pair, other, k, 1.0_wp - share, rows)
          end associate
        end do
      end associate
    end do
    call self%vertices%put(rows)

  end subroutine quasi_symmetric_nodal_evaluate

  !> Add a multiple of the gradient of a penetration.
  subroutine add_penetration(condition, factor, sense, rows)
    type(contact_condition_t), intent(in) :: condition
    !> [length^2]
    real(wp), intent(in) :: factor
    !> 1 when the point is the slave's, -1 when it is the master's.
    real(wp), intent(in) :: sense
    type(contact_rows_t), intent(inout) :: rows

    integer :: a
    real(wp) :: share

    associate (foot => condition%foot)
      call rows%add(condition%slave, factor * foot%climb, -factor * foot%climb, sense * factor)
      do a = 1, 3
        if (foot%node(a) == 0) cycle
        share = factor * foot%weight(a)
        call rows%add(foot%node(a), -share * foot%climb, share * foot%climb, -sense * share)
      end do
    end associate

  end subroutine add_penetration

  !> Add what a master node gives to a slave node, in gap and gradient.
  subroutine add_seen(pair, condition, slave_node, share, rows)
    type(contact_pair_t), intent(in) :: pair
    type(contact_condition_t), intent(in) :: condition
    integer, intent(in) :: slave_node
    !> Of this side in the gap [1].
    real(wp), intent(in) :: share
    type(contact_rows_t), intent(inout) :: rows

    integer :: a, corner
    real(wp) :: factor, gradient(3)

    corner = findloc(condition%foot%node, slave_node, dim=1)
    factor = share * condition%area * pair%slave%face_share(condition%foot%facet, corner)
    associate (foot => condition%foot, row => rows%n_row)
      rows%gap(row) = rows%gap(row) &
        + factor * foot%weight(corner) * foot%penetration / rows%area(row)
      call add_penetration(condition, factor * foot%weight(corner), -1.0_wp, rows)
      factor = factor * foot%penetration
      gradient = factor * foot%pull(:, corner)
      call rows%add(condition%slave, -gradient, gradient, 0.0_wp)
      do a = 1, 3
        if (foot%node(a) == 0) cycle
        gradient = factor * weight_by_corner(condition, corner, a)
        call rows%add(foot%node(a), -gradient, gradient, 0.0_wp)
      end do
    end associate

  end subroutine add_seen

  !> Derivative of the weight of one corner at a foot by the position of another.
  pure function weight_by_corner(condition, corner, moved) result(derivative)
    type(contact_condition_t), intent(in) :: condition
    integer, intent(in) :: corner
    integer, intent(in) :: moved
    real(wp) :: derivative(3)

    associate (foot => condition%foot)
      derivative = -foot%weight(moved) * foot%pull(:, corner) - foot%penetration &
        * dot_product(foot%gradient(:, corner), foot%gradient(:, moved)) * foot%normal
    end associate

  end function weight_by_corner

  !> See [[contact_formulation_t:stiffness]].
  subroutine quasi_symmetric_nodal_stiffness(self, pair, rows, lambda, blocks)
    class(quasi_symmetric_nodal_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    type(contact_rows_t), intent(in) :: rows
    real(wp), intent(in) :: lambda(:)
    type(contact_blocks_t), intent(inout) :: blocks

    integer :: a, b, i, n, node(4)
    real(wp) :: climb(3, 4), mean, on_face(3), pressure(pair%n_node), turn(3, 4), vertex

    call blocks%start()
    pressure = 0.0_wp
    do i = 1, self%distances%slave%n
      vertex = pair%slave%vertex_share(rows%slave(i))
      call self%distances%slave%item(i)%stiffen( &
        0.5_wp * (1.0_wp + vertex) * lambda(i) * rows%area(i), .true., blocks)
      ! What is left for the distances of the master's nodes
      pressure(rows%slave(i)) = (1.0_wp - vertex) * lambda(i)
    end do
    n = pair%slave%n_dim
    do i = 1, self%distances%master%n
      associate (condition => self%distances%master%item(i), &
                 foot => self%distances%master%item(i)%foot)
        if (.not. any(abs(pressure(foot%node(:n))) > 0.0_wp)) cycle
        do b = 1, n
          on_face(b) = pair%slave%face_share(foot%facet, b) * pressure(foot%node(b))
        end do
        mean = dot_product(foot%weight(:n), on_face(:n))
        call condition%stiffen(0.5_wp * condition%area * mean, .true., blocks)
        ! Gradients of the penetration and of the mean pressure
        node(1) = condition%slave
        node(2:n + 1) = foot%node(:n)
        climb(:, 1) = -foot%climb
        turn = 0.0_wp
        do b = 1, n
          climb(:, b + 1) = foot%weight(b) * foot%climb
          turn(:, 1) = turn(:, 1) + on_face(b) * foot%pull(:, b)
          do a = 1, n
            turn(:, a + 1) = turn(:, a + 1) + on_face(b) * weight_by_corner(condition, b, a)
          end do
        end do
        do a = 1, n + 1
          do b = 1, n + 1
            call blocks%add(node(a), node(b), -0.5_wp * condition%area &
                            * (dyadic(climb(:, a), turn(:, b)) + dyadic(turn(:, a), climb(:, b))))
          end do
        end do
      end associate
    end do
    ! Those of the slave are among its conditions
    pressure = 0.0_wp
    do i = self%distances%slave%n + 1, rows%n_row
      pressure(rows%slave(i)) = lambda(i)
    end do
    call self%vertices%stiffen(pressure, blocks)

  end subroutine quasi_symmetric_nodal_stiffness

end module swage_quasi_symmetric_nodal
