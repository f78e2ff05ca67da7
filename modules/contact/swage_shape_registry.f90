!> Names of the shapes of rigid tools. A new shape is one new file and one line in `registry`.
module swage_shape_registry
  use swage_cone, only: cone_from_group
  use swage_cylinder, only: cylinder_from_group
  use swage_faceted, only: faceted_from_group
  use swage_group, only: group_t
  use swage_plane, only: plane_from_group
  use swage_profile, only: profile_from_group
  use swage_rigid_shape, only: rigid_shape_t, shape_context_t
  use swage_sphere, only: sphere_from_group
  implicit none(type, external)
  private

  public :: shape_from_group, shape_names, SHAPE_NAME_LENGTH

  !> Longest name of a shape.
  integer, parameter :: SHAPE_NAME_LENGTH = 32

  abstract interface
    !> Collective. Make one kind of shape from its keys in a group `&tool`.
    subroutine from_group(group, context, shape)
      import :: group_t, rigid_shape_t, shape_context_t
      implicit none(type, external)
      type(group_t), intent(inout) :: group
      type(shape_context_t), intent(in) :: context
      class(rigid_shape_t), allocatable, intent(out) :: shape
    end subroutine from_group
  end interface

  type :: entry_t
    character(len=SHAPE_NAME_LENGTH) :: name = ''
    procedure(from_group), pointer, nopass :: make => null()
  end type entry_t

contains

  !> All shapes. The only place where a shape's name is written as a key.
  function registry() result(entries)
    type(entry_t), allocatable :: entries(:)

    entries = [ &
      entry_t('plane', plane_from_group), &
      entry_t('cylinder', cylinder_from_group), &
      entry_t('sphere', sphere_from_group), &
      entry_t('cone', cone_from_group), &
      entry_t('profile', profile_from_group), &
      entry_t('faceted', faceted_from_group)]

  end function registry

  !> What the key `shape` may be, in the order of the registry.
  function shape_names() result(names)
    character(len=SHAPE_NAME_LENGTH), allocatable :: names(:)

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    allocate (names(size(entries)))
    do i = 1, size(entries)
      names(i) = entries(i)%name
    end do

  end function shape_names

  !> Collective. Make the shape called `name` from its keys in a group `&tool`.
  subroutine shape_from_group(name, group, context, shape)
    !> One of [[shape_names]]; any other makes nothing.
    character(len=*), intent(in) :: name
    !> Keeps the faults of its keys.
    type(group_t), intent(inout) :: group
    type(shape_context_t), intent(in) :: context
    !> Not allocated when `group` has a fault or is being explained.
    class(rigid_shape_t), allocatable, intent(out) :: shape

    type(entry_t), allocatable :: entries(:)
    integer :: i

    allocate (entries, source=registry())
    do i = 1, size(entries)
      if (entries(i)%name == name) call entries(i)%make(group, context, shape)
    end do

  end subroutine shape_from_group

end module swage_shape_registry
