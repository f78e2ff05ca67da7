!> Gap of a slave node as the mean of the distances seen from both sides.
!>
!> \(g_k = \frac12 \left( p_k + \sum_j m_{jk} p_j / \sum_j m_{jk} \right)\) with the penetration of
!> the slave node into the master and those of master nodes into the slave: eq. 11 of the paper in
!> docs/theory to the letter, whose second integral is
!> \(\int h_{ba} \sum_j N_j^b S_{jk}\, dS = \sum_j (M_{bb} S)_{jk} \, p_j\). The caller's weights
!> \(m_{jk}\) are these; they are held in the derivative.
module swage_averaged_gap
  use swage_contact_conditions, only: condition_list_t, node_conditions
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_rows_t
  use swage_kinds, only: wp
  use swage_relation, only: pair_list_t, relation_from_pairs, relation_t
  implicit none(type, external)
  private

  public :: averaged_gap_t

  type :: averaged_gap_t
    !> Slave nodes on the master and master nodes on the slave.
    type(condition_list_t) :: slave, master
    !> Place in these lists of each node, 0 for none.
    integer, allocatable :: place(:)
    !> Distance of a node that sees nothing [length].
    real(wp) :: reach = 0.0_wp
  contains
    !> Find the distances.
    procedure :: prepare => averaged_gap_prepare
    !> Which master nodes have their feet on facets of each slave node.
    procedure :: find_seen => averaged_gap_find_seen
    !> Give the present row its gap and add its slope.
    procedure :: finish_row => averaged_gap_finish_row
  end type averaged_gap_t

contains

  subroutine averaged_gap_prepare(self, pair, mine, asked)
    class(averaged_gap_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    !> Slave nodes of this rank; shape (n_node).
    logical, intent(in) :: mine(:)
    !> Master nodes whose distances count; shape (n_node).
    logical, intent(in) :: asked(:)

    integer :: i

    self%reach = pair%reach
    self%slave%n = 0
    self%master%n = 0
    call node_conditions(pair, pair%slave, pair%master, mine, self%slave)
    call node_conditions(pair, pair%master, pair%slave, asked, self%master)
    if (allocated(self%place)) deallocate (self%place)
    allocate (self%place(pair%n_node), source=0)
    do i = 1, self%slave%n
      self%place(self%slave%item(i)%slave) = i
    end do
    do i = 1, self%master%n
      self%place(self%master%item(i)%slave) = i
    end do

  end subroutine averaged_gap_prepare

  subroutine averaged_gap_find_seen(self, n_node, seen_by)
    class(averaged_gap_t), intent(in) :: self
    integer, intent(in) :: n_node
    !> Places in the list of the master's conditions.
    type(relation_t), intent(out) :: seen_by

    integer :: a, i
    type(pair_list_t) :: list

    do i = 1, self%master%n
      do a = 1, 3
        if (self%master%item(i)%foot%node(a) > 0) then
          call list%append(self%master%item(i)%foot%node(a), i)
        end if
      end do
    end do
    if (list%n == 0) allocate (list%left(0), list%right(0))
    call relation_from_pairs(n_node, self%master%n, list%left(:list%n), list%right(:list%n), &
                             seen_by)

  end subroutine averaged_gap_find_seen

  !> The row keeps its forces.
  subroutine averaged_gap_finish_row(self, vertex_share, master_node, weight, rows)
    class(averaged_gap_t), intent(in) :: self
    !> How much of the gap is that of the slave node alone [1].
    real(wp), intent(in) :: vertex_share
    integer, intent(in) :: master_node(:)
    !> m of these nodes [length^2].
    real(wp), intent(in) :: weight(:)
    type(contact_rows_t), intent(inout) :: rows

    integer :: i
    real(wp) :: area, share, whole

    area = rows%area(rows%n_row)
    share = 0.5_wp * (1.0_wp + vertex_share)
    whole = 0.0_wp
    do i = 1, size(master_node)
      if (self%place(master_node(i)) > 0) whole = whole + weight(i)
    end do
    associate (node => rows%slave(rows%n_row), gap => rows%gap(rows%n_row))
      gap = 0.0_wp
      ! One side alone where the other sees nothing
      if (.not. whole > 0.0_wp) share = 1.0_wp
      if (self%place(node) == 0 .and. .not. whole > 0.0_wp) then
        gap = -self%reach
        return
      end if
      if (self%place(node) > 0) then
        gap = share * self%slave%item(self%place(node))%foot%penetration
        call self%slave%item(self%place(node))%add_slope(share * area, rows)
        share = 1.0_wp - share
      else
        share = 1.0_wp
      end if
      if (.not. whole > 0.0_wp) return
      do i = 1, size(master_node)
        if (self%place(master_node(i)) == 0) cycle
        associate (other => self%master%item(self%place(master_node(i))))
          gap = gap + share * weight(i) / whole * other%foot%penetration
          call other%add_slope(share * area * weight(i) / whole, rows)
        end associate
      end do
    end associate

  end subroutine averaged_gap_finish_row

end module swage_averaged_gap
