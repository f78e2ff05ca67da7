!> Contact of a slave with a master: conditions at points of the slave alone.
!>
!> At its nodes (`nodal`), at the middle of its facets (`one_point`: reduced integration) or at
!> quadrature points of them (`full`). The master gets the reaction. The forces are the gradient of
!> the energy of the penalty, save that smoothed normals count as fixed in it.
!> Source: eq. 10 of the paper in docs/theory.
module swage_master_slave
  use swage_contact_conditions, only: condition_list_t, node_conditions, point_conditions, &
    point_owners
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: master_slave_t, master_slave_create

  type, extends(contact_formulation_t) :: master_slave_t
    private
    !> Quadrature points of a facet; 0 for conditions at the nodes.
    integer :: n_point = 0
    type(condition_list_t) :: list
  contains
    procedure :: count_conditions => master_slave_count_conditions
    procedure :: list_owners => master_slave_list_owners
    procedure :: evaluate => master_slave_evaluate
    procedure :: stiffness => master_slave_stiffness
  end type master_slave_t

contains

  subroutine master_slave_create(choice, formulation)
    !> `variant` and `n_point` count.
    type(contact_choice_t), intent(in) :: choice
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    type(master_slave_t), allocatable :: made

    allocate (made)
    made%n_point = choice%points_on_facet()
    call move_alloc(made, formulation)

  end subroutine master_slave_create

  pure function master_slave_count_conditions(self, pair) result(n_condition)
    class(master_slave_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    integer :: n_condition

    n_condition = pair%n_node
    if (self%n_point > 0) n_condition = self%n_point * pair%slave%n_facet

  end function master_slave_count_conditions

  !> See [[contact_formulation_t:list_owners]].
  subroutine master_slave_list_owners(self, pair, owner)
    class(master_slave_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    integer, allocatable, intent(out) :: owner(:)

    allocate (owner(self%count_conditions(pair)), source=0)
    if (self%n_point == 0) then
      owner(pair%slave%node) = pair%slave%node
    else
      call point_owners(pair%slave, self%n_point, 0, owner)
    end if

  end subroutine master_slave_list_owners

  !> See [[contact_formulation_t:evaluate]].
  subroutine master_slave_evaluate(self, pair, mine, rows)
    class(master_slave_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    logical, intent(in) :: mine(:)
    type(contact_rows_t), intent(inout) :: rows

    integer :: i

    self%list%n = 0
    if (self%n_point == 0) then
      call node_conditions(pair, pair%slave, pair%master, mine, self%list)
    else
      call point_conditions(pair, pair%slave, pair%master, self%n_point, 0, mine, self%list)
    end if
    call rows%start(pair%n_node)
    do i = 1, self%list%n
      call self%list%item(i)%put(1.0_wp, .true., rows)
    end do

  end subroutine master_slave_evaluate

  !> See [[contact_formulation_t:stiffness]].
  subroutine master_slave_stiffness(self, pair, rows, lambda, blocks)
    class(master_slave_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    type(contact_rows_t), intent(in) :: rows
    real(wp), intent(in) :: lambda(:)
    type(contact_blocks_t), intent(inout) :: blocks

    associate (unused => pair)
    end associate
    call blocks%start()
    call self%list%stiffen(rows, lambda, .true., blocks)

  end subroutine master_slave_stiffness

end module swage_master_slave
