!> Names of the constitutive laws. A new law is one new file and one line in `registry`.
module swage_material_registry
  use swage_chenot_eq3, only: chenot_eq3_from_group
  use swage_deck, only: deck_t
  use swage_group, only: group_t
  use swage_j2_plastic, only: j2_plastic_from_group
  use swage_linear_elastic, only: linear_elastic_from_group
  use swage_material_law, only: material_law_t
  use swage_material_sources, only: material_sources_t
  use swage_norton_hoff, only: norton_hoff_from_group
  use swage_perzyna, only: perzyna_from_group
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: explain_material, material_from_group, material_names, MATERIAL_NAME_LENGTH

  !> Longest name of a law.
  integer, parameter :: MATERIAL_NAME_LENGTH = 32

  abstract interface
    !> Make one kind of law from its keys in a group `&material`, and finish the group; not made
    !> when there is a fault or the group is being explained.
    subroutine from_group(group, sources, law, status)
      import :: group_t, material_law_t, material_sources_t, status_t
      implicit none(type, external)
      type(group_t), intent(inout) :: group
      type(material_sources_t), intent(in) :: sources
      class(material_law_t), allocatable, intent(out) :: law
      type(status_t), intent(inout) :: status
    end subroutine from_group
  end interface

  type :: entry_t
    character(len=MATERIAL_NAME_LENGTH) :: name = ''
    procedure(from_group), pointer, nopass :: make => null()
  end type entry_t

contains

  !> All laws. The only place where a law's name is written as a key.
  function registry() result(entries)
    type(entry_t), allocatable :: entries(:)

    entries = [ &
      entry_t('elastic', linear_elastic_from_group), &
      entry_t('j2', j2_plastic_from_group), &
      entry_t('perzyna', perzyna_from_group), &
      entry_t('chenot_eq3', chenot_eq3_from_group), &
      entry_t('norton_hoff', norton_hoff_from_group)]

  end function registry

  !> What the key `law` may be, in the order of the registry.
  function material_names() result(names)
    character(len=MATERIAL_NAME_LENGTH), allocatable :: names(:)

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    allocate (names(size(entries)))
    do i = 1, size(entries)
      names(i) = entries(i)%name
    end do

  end function material_names

  !> Make the law of a group `&material`, which is finished with it: whoever else owns keys in the
  !> group takes them before.
  subroutine material_from_group(group, deck, units, law, status)
    type(group_t), intent(inout) :: group
    !> The deck the group stands in, where its `&flow_stress` is found.
    type(deck_t), intent(in) :: deck
    !> Name of the unit system, `&job units`: moduli absurd in it are refused.
    character(len=*), intent(in) :: units
    !> Allocated unless `status` failed.
    class(material_law_t), allocatable, intent(out) :: law
    !> `STATUS_ERROR` when the law is unknown, a key unknown, missing or out of range, or when the
    !> `&flow_stress` it names is missing or faulty. A file of the flow stress is read by each
    !> rank, so the ranks must agree afterwards.
    type(status_t), intent(inout) :: status

    type(entry_t), allocatable :: entries(:)
    character(len=:), allocatable :: wanted
    type(material_sources_t) :: sources
    integer :: i

    call take_law(group, wanted)
    sources%deck = deck
    sources%units = units
    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name == wanted) call entries(i)%make(group, sources, law, status)
    end do
    call group%finish(status)

  end subroutine material_from_group

  !> Record in `group`, made for explaining, the keys that a law takes.
  subroutine explain_material(name, group)
    !> One of [[material_names]]; any other explains the key `law` alone.
    character(len=*), intent(in) :: name
    type(group_t), intent(inout) :: group

    type(entry_t), allocatable :: entries(:)
    character(len=:), allocatable :: ignored
    class(material_law_t), allocatable :: law
    type(material_sources_t) :: sources
    type(status_t) :: status
    integer :: i

    call take_law(group, ignored)
    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name == name) call entries(i)%make(group, sources, law, status)
    end do

  end subroutine explain_material

  !> The key that all laws share.
  subroutine take_law(group, name)
    type(group_t), intent(inout) :: group
    character(len=:), allocatable, intent(out) :: name

    name = ''
    call group%take('law', name, 'Constitutive law.', choices=material_names(), required=.true.)

  end subroutine take_law

end module swage_material_registry
