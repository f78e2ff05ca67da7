!> Names of the kinds of flow stress, and how a material refers to one. A new kind is one new file
!> and one line in `registry`.
module swage_flow_stress_registry
  use swage_flow_stress, only: flow_stress_t
  use swage_grid_flow_stress, only: grid_flow_stress_from_group
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_linear_flow_stress, only: linear_flow_stress_from_group, linear_flow_stress_t
  use swage_material_sources, only: material_sources_t
  use swage_status, only: status_t
  use swage_swift_flow_stress, only: swift_flow_stress_from_group
  use swage_table_flow_stress, only: table_flow_stress_from_group
  use swage_voce_flow_stress, only: voce_flow_stress_from_group
  implicit none(type, external)
  private

  public :: explain_flow_stress, flow_stress_from_group, flow_stress_names
  public :: take_flow_stress, take_threshold, FLOW_STRESS_NAME_LENGTH

  !> Longest name of a kind.
  integer, parameter :: FLOW_STRESS_NAME_LENGTH = 32

  abstract interface
    !> Make one kind of flow stress from its keys in a group `&flow_stress`; not made when the
    !> group has a fault.
    subroutine from_group(group, sources, flow_stress)
      import :: flow_stress_t, group_t, material_sources_t
      implicit none(type, external)
      type(group_t), intent(inout) :: group
      type(material_sources_t), intent(in) :: sources
      class(flow_stress_t), allocatable, intent(out) :: flow_stress
    end subroutine from_group
  end interface

  type :: entry_t
    character(len=FLOW_STRESS_NAME_LENGTH) :: name = ''
    procedure(from_group), pointer, nopass :: make => null()
  end type entry_t

contains

  !> All kinds. The only place where a kind's name is written.
  function registry() result(entries)
    type(entry_t), allocatable :: entries(:)

    entries = [ &
      entry_t('linear', linear_flow_stress_from_group), &
      entry_t('swift', swift_flow_stress_from_group), &
      entry_t('voce', voce_flow_stress_from_group), &
      entry_t('table', table_flow_stress_from_group), &
      entry_t('grid', grid_flow_stress_from_group)]

  end function registry

  !> What the key `kind` may be, in the order of the registry.
  function flow_stress_names() result(names)
    character(len=FLOW_STRESS_NAME_LENGTH), allocatable :: names(:)

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    allocate (names(size(entries)))
    do i = 1, size(entries)
      names(i) = entries(i)%name
    end do

  end function flow_stress_names

  !> Make the flow stress of a group `&flow_stress`.
  subroutine flow_stress_from_group(group, sources, flow_stress, status)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    !> Allocated unless `status` failed.
    class(flow_stress_t), allocatable, intent(out) :: flow_stress
    !> `STATUS_ERROR` when the kind is unknown, or a key unknown, missing or out of range.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: kind

    call take_kind(group, kind)
    call make_kind(kind, group, sources, flow_stress)
    call group%finish(status)

  end subroutine flow_stress_from_group

  !> Record in `group`, made for explaining, the keys that a kind of flow stress takes.
  subroutine explain_flow_stress(kind, group)
    !> One of [[flow_stress_names]]; any other explains the key `kind` alone.
    character(len=*), intent(in) :: kind
    type(group_t), intent(inout) :: group

    character(len=:), allocatable :: ignored
    class(flow_stress_t), allocatable :: flow_stress
    type(material_sources_t) :: sources

    call take_kind(group, ignored)
    call make_kind(kind, group, sources, flow_stress)

  end subroutine explain_flow_stress

  !> The key that all kinds share.
  subroutine take_kind(group, kind)
    type(group_t), intent(inout) :: group
    character(len=:), allocatable, intent(out) :: kind

    kind = ''
    call group%take('kind', kind, 'Kind of flow stress.', choices=flow_stress_names(), &
                    required=.true.)

  end subroutine take_kind

  !> Call the maker of a kind; nothing happens when there is none.
  subroutine make_kind(kind, group, sources, flow_stress)
    character(len=*), intent(in) :: kind
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(flow_stress_t), allocatable, intent(out) :: flow_stress

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name == kind) call entries(i)%make(group, sources, flow_stress)
    end do

  end subroutine make_kind

  !> The flow stress that a `&material` names in its key `flow_stress`.
  subroutine take_flow_stress(group, sources, required, flow_stress, status)
    !> The `&material`.
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    !> Whether the key must be given.
    logical, intent(in) :: required
    !> Not allocated when the key is absent, `group` has a fault or is being explained.
    class(flow_stress_t), allocatable, intent(out) :: flow_stress
    !> `STATUS_ERROR` when there is no such flow stress or it has a fault.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: name
    type(group_t) :: named

    call group%take('flow_stress', name, 'Name of the &flow_stress.', required=required)
    if (group%explaining .or. group%status%failed() .or. name == '') return
    call sources%deck%find('flow_stress', name, named, status, group, 'flow_stress')
    if (status%failed()) return
    call flow_stress_from_group(named, sources, flow_stress, status)

  end subroutine take_flow_stress

  !> The threshold of a viscoplastic `&material`: a flow stress, or a constant.
  subroutine take_threshold(group, sources, threshold, status)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    !> Not allocated when there is a fault or `group` is being explained.
    class(flow_stress_t), allocatable, intent(out) :: threshold
    !> As [[take_flow_stress]].
    type(status_t), intent(inout) :: status

    real(wp) :: constant

    call take_flow_stress(group, sources, .false., threshold, status)
    constant = 0.0_wp
    call group%take('threshold', constant, 'stress', &
                    'Constant R below which nothing flows, instead of a flow_stress.', &
                    lower=0.0_wp)
    call sources%check_stress(group, 'threshold', constant, 1.0e4_wp)
    if (group%given('threshold') .and. group%given('flow_stress')) then
      call group%refuse('threshold', 'give either threshold or flow_stress')
    end if
    if (allocated(threshold) .or. group%explaining) return
    allocate (threshold, source=linear_flow_stress_t(yield_stress=constant))

  end subroutine take_threshold

end module swage_flow_stress_registry
