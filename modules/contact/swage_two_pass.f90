!> Contact with conditions on both sides, each surface against the other.
!>
!> `symmetric`: both passes of master/slave contact with half the weight, each with its reaction; it
!> holds twice the conditions that the surfaces can follow and locks when they are strict.
!> `half_pass`: each surface is pushed by its own distance with the full weight and without
!> reactions: eq. 9 of the paper in docs/theory to the letter, which does not balance.
!>
!> Where both surfaces are one there is a single pass, over all of it.
module swage_two_pass
  use swage_contact_conditions, only: condition_list_t, node_conditions, point_conditions, &
    point_owners
  use swage_contact_formulation, only: contact_choice_t, contact_formulation_t
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: two_pass_t, half_pass_create, symmetric_create

  type, extends(contact_formulation_t) :: two_pass_t
    private
    !> Quadrature points of a facet; 0 for conditions at the nodes.
    integer :: n_point = 0
    !> Weight of each pass.
    real(wp) :: factor = 0.5_wp
    logical :: reacts = .true.
    type(condition_list_t) :: list
  contains
    procedure :: count_conditions => two_pass_count_conditions
    procedure :: list_owners => two_pass_list_owners
    procedure :: evaluate => two_pass_evaluate
    procedure :: stiffness => two_pass_stiffness
    procedure :: admits_self => two_pass_admits_self
    procedure :: balances => two_pass_balances
    procedure :: admits_multipliers => two_pass_admits_multipliers
  end type two_pass_t

contains

  subroutine symmetric_create(choice, formulation)
    !> `variant` and `n_point` count.
    type(contact_choice_t), intent(in) :: choice
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    call two_pass_create(choice, 0.5_wp, .true., formulation)

  end subroutine symmetric_create

  subroutine half_pass_create(choice, formulation)
    !> `variant` and `n_point` count.
    type(contact_choice_t), intent(in) :: choice
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    call two_pass_create(choice, 1.0_wp, .false., formulation)

  end subroutine half_pass_create

  subroutine two_pass_create(choice, factor, reacts, formulation)
    type(contact_choice_t), intent(in) :: choice
    real(wp), intent(in) :: factor
    logical, intent(in) :: reacts
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    type(two_pass_t), allocatable :: made

    allocate (made)
    made%n_point = choice%points_on_facet()
    made%factor = factor
    made%reacts = reacts
    call move_alloc(made, formulation)

  end subroutine two_pass_create

  pure function two_pass_count_conditions(self, pair) result(n_condition)
    class(two_pass_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    integer :: n_condition

    n_condition = pair%n_node
    if (self%n_point > 0) then
      n_condition = self%n_point * (pair%slave%n_facet + pair%master%n_facet)
    end if

  end function two_pass_count_conditions

  !> See [[contact_formulation_t:list_owners]].
  subroutine two_pass_list_owners(self, pair, owner)
    class(two_pass_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    integer, allocatable, intent(out) :: owner(:)

    allocate (owner(self%count_conditions(pair)), source=0)
    if (self%n_point == 0) then
      owner(pair%slave%node) = pair%slave%node
      owner(pair%master%node) = pair%master%node
    else
      call point_owners(pair%slave, self%n_point, 0, owner)
      if (pair%is_self) return
      call point_owners(pair%master, self%n_point, self%n_point * pair%slave%n_facet, owner)
    end if

  end subroutine two_pass_list_owners

  !> See [[contact_formulation_t:evaluate]]; the nodes of both surfaces are asked for.
  subroutine two_pass_evaluate(self, pair, mine, rows)
    class(two_pass_t), intent(inout) :: self
    type(contact_pair_t), intent(in) :: pair
    logical, intent(in) :: mine(:)
    type(contact_rows_t), intent(inout) :: rows

    integer :: i
    real(wp) :: factor

    ! The rows of a surface that meets itself are halved once they are made
    factor = self%factor
    if (pair%is_self) factor = 2.0_wp * factor
    self%list%n = 0
    if (self%n_point == 0) then
      call node_conditions(pair, pair%slave, pair%master, mine, self%list)
      if (.not. pair%is_self) then
        call node_conditions(pair, pair%master, pair%slave, mine, self%list)
      end if
    else
      call point_conditions(pair, pair%slave, pair%master, self%n_point, 0, mine, self%list)
      if (.not. pair%is_self) then
        call point_conditions(pair, pair%master, pair%slave, self%n_point, &
                              self%n_point * pair%slave%n_facet, mine, self%list)
      end if
    end if
    call rows%start(pair%n_node)
    do i = 1, self%list%n
      call self%list%item(i)%put(factor, self%reacts, rows)
    end do

  end subroutine two_pass_evaluate

  !> See [[contact_formulation_t:stiffness]].
  subroutine two_pass_stiffness(self, pair, rows, lambda, blocks)
    class(two_pass_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    type(contact_rows_t), intent(in) :: rows
    real(wp), intent(in) :: lambda(:)
    type(contact_blocks_t), intent(inout) :: blocks

    associate (unused => pair)
    end associate
    call blocks%start()
    call self%list%stiffen(rows, lambda, self%reacts, blocks)

  end subroutine two_pass_stiffness

  pure function two_pass_balances(self) result(balances)
    class(two_pass_t), intent(in) :: self
    logical :: balances

    balances = self%reacts

  end function two_pass_balances

  pure function two_pass_admits_multipliers(self) result(admits)
    class(two_pass_t), intent(in) :: self
    logical :: admits

    associate (unused => self)
    end associate
    admits = .false.

  end function two_pass_admits_multipliers

  !> What one surface does to itself must balance.
  pure function two_pass_admits_self(self) result(admits)
    class(two_pass_t), intent(in) :: self
    logical :: admits

    admits = self%reacts

  end function two_pass_admits_self

end module swage_two_pass
