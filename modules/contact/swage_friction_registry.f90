!> Names of the friction laws. A new law is one new file and one line in `registry`.
module swage_friction_registry
  use swage_coulomb, only: coulomb_from_group
  use swage_coulomb_tresca, only: coulomb_tresca_from_group
  use swage_friction, only: friction_law_t
  use swage_generalized_coulomb, only: generalized_coulomb_from_group
  use swage_group, only: group_t
  use swage_no_friction, only: no_friction_from_group
  use swage_norton_friction, only: norton_friction_from_group
  use swage_status, only: status_t
  use swage_sticking, only: sticking_from_group
  use swage_tresca, only: tresca_from_group
  implicit none(type, external)
  private

  public :: explain_friction, friction_from_group, friction_names, FRICTION_NAME_LENGTH

  !> Longest name of a law.
  integer, parameter :: FRICTION_NAME_LENGTH = 32

  abstract interface
    !> Make one kind of law from its keys in a group `&friction`.
    subroutine from_group(group, law)
      import :: friction_law_t, group_t
      implicit none(type, external)
      type(group_t), intent(inout) :: group
      class(friction_law_t), allocatable, intent(out) :: law
    end subroutine from_group
  end interface

  type :: entry_t
    character(len=FRICTION_NAME_LENGTH) :: name = ''
    procedure(from_group), pointer, nopass :: make => null()
  end type entry_t

contains

  !> All laws. The only place where a law's name is written as a key.
  function registry() result(entries)
    type(entry_t), allocatable :: entries(:)

    entries = [ &
      entry_t('none', no_friction_from_group), &
      entry_t('coulomb', coulomb_from_group), &
      entry_t('coulomb_tresca', coulomb_tresca_from_group), &
      entry_t('tresca', tresca_from_group), &
      entry_t('generalized_coulomb', generalized_coulomb_from_group), &
      entry_t('norton', norton_friction_from_group), &
      entry_t('sticking', sticking_from_group)]

  end function registry

  !> What the key `kind` may be, in the order of the registry.
  function friction_names() result(names)
    character(len=FRICTION_NAME_LENGTH), allocatable :: names(:)

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    allocate (names(size(entries)))
    do i = 1, size(entries)
      names(i) = entries(i)%name
    end do

  end function friction_names

  !> Make the law of a group `&friction`.
  subroutine friction_from_group(group, law, status)
    type(group_t), intent(inout) :: group
    !> Allocated unless `status` failed.
    class(friction_law_t), allocatable, intent(out) :: law
    !> `STATUS_ERROR` when the kind is unknown, or a key unknown, missing or out of range.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: kind
    type(entry_t), allocatable :: entries(:)
    integer :: i

    call take_kind(group, kind)
    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name == kind) call entries(i)%make(group, law)
    end do
    call group%finish(status)

  end subroutine friction_from_group

  !> Record in `group`, made for explaining, the keys that a kind of law takes.
  subroutine explain_friction(kind, group)
    !> One of [[friction_names]]; any other explains the key `kind` alone.
    character(len=*), intent(in) :: kind
    type(group_t), intent(inout) :: group

    character(len=:), allocatable :: ignored
    class(friction_law_t), allocatable :: law
    type(entry_t), allocatable :: entries(:)
    integer :: i

    call take_kind(group, ignored)
    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name == kind) call entries(i)%make(group, law)
    end do

  end subroutine explain_friction

  !> The key that all kinds share.
  subroutine take_kind(group, kind)
    type(group_t), intent(inout) :: group
    character(len=:), allocatable, intent(out) :: kind

    kind = ''
    call group%take('kind', kind, 'Friction law.', choices=friction_names(), required=.true.)

  end subroutine take_kind

end module swage_friction_registry
