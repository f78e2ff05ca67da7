!> Names of the formulations of contact between deformable bodies. A new one is one new file and its
!> lines in `registry`.
module swage_contact_formulation_registry
  use swage_contact_formulation, only: CHOICE_LENGTH, contact_choice_t, contact_formulation_t
  use swage_master_slave, only: master_slave_create
  use swage_quasi_symmetric_interpolation, only: quasi_symmetric_interpolation_create
  use swage_quasi_symmetric_l2, only: quasi_symmetric_l2_create
  use swage_quasi_symmetric_lumped, only: quasi_symmetric_lumped_create
  use swage_quasi_symmetric_nodal, only: quasi_symmetric_nodal_create
  use swage_two_pass, only: half_pass_create, symmetric_create
  implicit none(type, external)
  private

  public :: contact_formulation_create, contact_formulation_names

  abstract interface
    !> Make one kind of formulation.
    subroutine create(choice, formulation)
      import :: contact_choice_t, contact_formulation_t
      implicit none(type, external)
      type(contact_choice_t), intent(in) :: choice
      class(contact_formulation_t), allocatable, intent(out) :: formulation
    end subroutine create
  end interface

  type :: entry_t
    character(len=CHOICE_LENGTH) :: name = ''
    !> Of `projection`; blank where the formulation has none.
    character(len=CHOICE_LENGTH) :: projection = ''
    procedure(create), pointer, nopass :: make => null()
  end type entry_t

contains

  !> All formulations. The only place where their names are written as keys.
  function registry() result(entries)
    type(entry_t), allocatable :: entries(:)

    entries = [ &
      entry_t('master_slave', '', master_slave_create), &
      entry_t('symmetric', '', symmetric_create), &
      entry_t('half_pass', '', half_pass_create), &
      entry_t('quasi_symmetric', 'l2', quasi_symmetric_l2_create), &
      entry_t('quasi_symmetric', 'lumped', quasi_symmetric_lumped_create), &
      entry_t('quasi_symmetric', 'interpolation', quasi_symmetric_interpolation_create), &
      entry_t('quasi_symmetric', 'nodal', quasi_symmetric_nodal_create)]

  end function registry

  !> What the key `formulation` may be, in the order of the registry.
  function contact_formulation_names() result(names)
    character(len=CHOICE_LENGTH), allocatable :: names(:)

    type(entry_t), allocatable :: entries(:)
    integer :: i, n

    allocate (entries, source=registry())
    allocate (names(size(entries)))
    n = 0
    do i = 1, size(entries)
      if (any(names(:n) == entries(i)%name)) cycle
      n = n + 1
      names(n) = entries(i)%name
    end do
    names = names(:n)

  end function contact_formulation_names

  !> Make the formulation called `name`.
  subroutine contact_formulation_create(name, choice, formulation)
    !> One of [[contact_formulation_names]].
    character(len=*), intent(in) :: name
    type(contact_choice_t), intent(in) :: choice
    !> Not allocated when there is none of this name and projection.
    class(contact_formulation_t), allocatable, intent(out) :: formulation

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name /= name) cycle
      if (entries(i)%projection /= '' .and. entries(i)%projection /= choice%projection) cycle
      call entries(i)%make(choice, formulation)
    end do

  end subroutine contact_formulation_create

end module swage_contact_formulation_registry
