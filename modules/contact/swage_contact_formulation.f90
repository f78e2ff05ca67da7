!> Formulations of contact between deformable bodies: what makes conditions of a pair of surfaces.
module swage_contact_formulation
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: contact_choice_t, contact_formulation_t, CHOICE_LENGTH

  !> Longest word of a choice.
  integer, parameter :: CHOICE_LENGTH = 32

  !> What the keys of a contact say about its formulation; each formulation takes what concerns it.
  type :: contact_choice_t
    !> `nodal`, `one_point` or `full`: where a master/slave pass has its conditions.
    character(len=CHOICE_LENGTH) :: variant = 'nodal'
    !> `l2`, `lumped`, `interpolation` or `nodal`: how the slave's pressure acts on the master.
    character(len=CHOICE_LENGTH) :: projection = 'l2'
    !> `dual`: as the forces are distributed; `averaged`: mean of the distances from both sides.
    character(len=CHOICE_LENGTH) :: gap = 'dual'
    !> `clipped`: on the pieces that facets have in common; `slave`: on whole slave facets.
    character(len=CHOICE_LENGTH) :: quadrature = 'clipped'
    !> Points on a slave facet of the variant `full` and the quadrature `slave`.
    integer :: n_point = 3
  contains
    !> Conditions on a facet by `variant`, 0 where they are at the nodes.
    procedure :: points_on_facet => contact_choice_points_on_facet
  end type contact_choice_t

  !> A formulation. It keeps what its last evaluation has found for the stiffness.
  type, abstract :: contact_formulation_t
  contains
    !> Largest key of a condition.
    procedure :: count_conditions => contact_formulation_count_conditions
    !> Slave node of the condition of each key.
    procedure :: list_owners => contact_formulation_list_owners
    !> The conditions of the present positions.
    procedure(evaluate), deferred :: evaluate
    !> Derivative of the forces of the last evaluation with the pressures held.
    procedure(stiffness), deferred :: stiffness
    !> True when the forces of a condition are in balance.
    procedure :: balances => contact_formulation_balances
    !> True when there are no more conditions than nodal multipliers can satisfy.
    procedure :: admits_multipliers => contact_formulation_admits_multipliers
    !> True when slave and master may be the same surface.
    procedure :: admits_self => contact_formulation_admits_self
  end type contact_formulation_t

  abstract interface
    !> A node without a partner within reach has no condition.
    subroutine evaluate(self, pair, mine, rows)
      import :: contact_formulation_t, contact_pair_t, contact_rows_t
      implicit none(type, external)
      class(contact_formulation_t), intent(inout) :: self
      type(contact_pair_t), intent(in) :: pair
      !> The slave nodes whose conditions are asked for; shape (n_node).
      logical, intent(in) :: mine(:)
      type(contact_rows_t), intent(inout) :: rows
    end subroutine evaluate

    !> Blocks: derivatives of \(\sum \lambda\) `force` by positions.
    subroutine stiffness(self, pair, rows, lambda, blocks)
      import :: contact_blocks_t, contact_formulation_t, contact_pair_t, contact_rows_t, wp
      implicit none(type, external)
      class(contact_formulation_t), intent(in) :: self
      !> As at the last evaluation.
      type(contact_pair_t), intent(in) :: pair
      !> Of the last evaluation.
      type(contact_rows_t), intent(in) :: rows
      !> Pressures of the conditions [stress]; shape (n_row).
      real(wp), intent(in) :: lambda(:)
      type(contact_blocks_t), intent(inout) :: blocks
    end subroutine stiffness
  end interface

contains

  pure function contact_choice_points_on_facet(self) result(n_point)
    class(contact_choice_t), intent(in) :: self
    integer :: n_point

    select case (self%variant)
    case ('one_point')
      n_point = 1
    case ('full')
      n_point = self%n_point
    case default
      n_point = 0
    end select

  end function contact_choice_points_on_facet

  !> Where conditions are those of nodes a key is the number of its node.
  pure function contact_formulation_count_conditions(self, pair) result(n_condition)
    class(contact_formulation_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    integer :: n_condition

    associate (unused => self)
    end associate
    n_condition = pair%n_node

  end function contact_formulation_count_conditions

  !> Nodes of the slave, and those of the master that may come to be vertices
  !> ([[swage_contact_vertices]]).
  subroutine contact_formulation_list_owners(self, pair, owner)
    class(contact_formulation_t), intent(in) :: self
    type(contact_pair_t), intent(in) :: pair
    !> 0 where no condition can have the key; shape (count_conditions).
    integer, allocatable, intent(out) :: owner(:)

    allocate (owner(self%count_conditions(pair)), source=0)
    owner(pair%slave%node) = pair%slave%node
    if (pair%has_vertices) owner(pair%master%node) = pair%master%node

  end subroutine contact_formulation_list_owners

  pure function contact_formulation_balances(self) result(balances)
    class(contact_formulation_t), intent(in) :: self
    logical :: balances

    associate (unused => self)
    end associate
    balances = .true.

  end function contact_formulation_balances

  pure function contact_formulation_admits_multipliers(self) result(admits)
    class(contact_formulation_t), intent(in) :: self
    logical :: admits

    associate (unused => self)
    end associate
    admits = .true.

  end function contact_formulation_admits_multipliers

  pure function contact_formulation_admits_self(self) result(admits)
    class(contact_formulation_t), intent(in) :: self
    logical :: admits

    associate (unused => self)
    end associate
    admits = .false.

  end function contact_formulation_admits_self

end module swage_contact_formulation
