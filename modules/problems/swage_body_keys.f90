!> The groups `&body` and `&interface`: which cells a body consists of, and how two bodies meet.
module swage_body_keys
  use swage_deck, only: deck_t
  use swage_group, only: group_t
  use swage_mesh_interface, only: mesh_interface_t
  use swage_status, only: status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: take_body, explain_interface, interfaces_from_deck

  character(len=*), parameter :: TREATMENTS(*) = [character(len=7) :: 'bonded', 'contact']

contains

  !> The only place where the keys of `&body` are named.
  subroutine take_body(group, material, group_name)
    type(group_t), intent(inout) :: group
    character(len=:), allocatable, intent(out) :: material
    character(len=:), allocatable, intent(out) :: group_name

    material = ''
    group_name = ''
    call group%take('material', material, 'Name of its &material.', required=.true.)
    call group%take('group', group_name, 'Physical group of its cells, by name or number.', &
                    required=.true.)

  end subroutine take_body

  !> The only place where the keys of `&interface` are named.
  subroutine take_interface(group, bodies, separates)
    type(group_t), intent(inout) :: group
    character(len=64), allocatable, intent(out) :: bodies(:)
    logical, intent(out) :: separates

    character(len=:), allocatable :: treatment

    allocate (bodies(0))
    allocate (treatment, source=trim(TREATMENTS(1)))
    call group%take_list('bodies', bodies, 'Names of the two &body that meet.', required=.true.)
    call group%take('treatment', treatment, 'How they do: ''bonded'' makes one node of two at '// &
                    'the same place, ''contact'' gives each body nodes of its own where the '// &
                    'mesh shares them.', choices=TREATMENTS)
    separates = treatment /= TREATMENTS(1)
    if (group%explaining) return
    if (size(bodies) /= 2) then
      if (group%given('bodies')) call group%refuse('bodies', 'must be the names of two bodies')
    else if (bodies(1) == bodies(2)) then
      call group%refuse('bodies', 'are the same: name two')
    end if

  end subroutine take_interface

  !> Record the keys of `&interface` in a group made for explaining.
  subroutine explain_interface(group)
    type(group_t), intent(inout) :: group

    character(len=64), allocatable :: ignored(:)
    logical :: also_ignored

    call take_interface(group, ignored, also_ignored)

  end subroutine explain_interface

  !> What is to be done where bodies meet, by the physical groups of their cells.
  subroutine interfaces_from_deck(deck, interfaces, status)
    type(deck_t), intent(in) :: deck
    type(mesh_interface_t), allocatable, intent(out) :: interfaces(:)
    !> `STATUS_ERROR` when a body is not known, or a pair is named twice.
    type(status_t), intent(inout) :: status

    character(len=64), allocatable :: bodies(:)
    character(len=:), allocatable :: group_name, material
    type(group_t) :: body, group
    integer :: i, j, k

    allocate (interfaces(deck%count('interface')))
    do i = 1, size(interfaces)
      call deck%get('interface', i, group)
      call take_interface(group, bodies, interfaces(i)%separates)
      call group%finish(status)
      if (status%failed()) return
      interfaces(i)%title = group%describe('bodies')
      do k = 1, 2
        call deck%find('body', trim(bodies(k)), body, status, from=group, key='bodies')
        if (status%failed()) return
        call take_body(body, material, group_name)
        interfaces(i)%group(k) = group_name
      end do
      do j = 1, i - 1
        if (all(interfaces(i)%group /= interfaces(j)%group(1)) .or. &
            all(interfaces(i)%group /= interfaces(j)%group(2))) cycle
        call status%raise(STATUS_ERROR, 'interfaces_from_deck', group%describe('bodies')// &
                          ': the same two as in '//trim(interfaces(j)%title)//': leave one '// &
                          '&interface out')
        return
      end do
    end do

  end subroutine interfaces_from_deck

end module swage_body_keys
