!> Named fields, as a problem hands them to whoever writes, plots or exchanges them.
module swage_field_list
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: field_t, field_list_t, FIELD_NODAL, FIELD_CELL

  !> One column of values for each local node of the mesh.
  integer, parameter :: FIELD_NODAL = 1
  !> One column of values for each local cell.
  integer, parameter :: FIELD_CELL = 2

  !> A field, copied at the moment of the request.
  type :: field_t
    character(len=64) :: name = ''
    !> As `length/time`.
    character(len=64) :: dimension = '1'
    !> One line for a reader who has only the file.
    character(len=128) :: description = ''
    !> `FIELD_NODAL` or `FIELD_CELL`.
    integer :: location = FIELD_NODAL
    !> True for symmetric tensors in Mandel notation (six rows).
    logical :: is_tensor = .false.
    !> Shape (n_component, n_node or n_cell).
    real(wp), allocatable :: values(:, :)
  end type field_t

  type :: field_list_t
    !> Fields in use: `fields(:n_field)`.
    integer :: n_field = 0
    type(field_t), allocatable :: fields(:)
  contains
    !> Append a copy of a field.
    procedure :: add => field_list_add
    !> All names, in order.
    procedure :: names => field_list_names
    !> Place of a field, 0 when there is none of this name.
    procedure :: find => field_list_find
  end type field_list_t

contains

  pure subroutine field_list_add(self, name, dimension, description, location, values, is_tensor)
    class(field_list_t), intent(inout) :: self
    character(len=*), intent(in) :: name
    character(len=*), intent(in) :: dimension
    character(len=*), intent(in) :: description
    !> `FIELD_NODAL` or `FIELD_CELL`.
    integer, intent(in) :: location
    !> Shape (n_component, n_node or n_cell).
    real(wp), intent(in) :: values(:, :)
    !> False when absent.
    logical, intent(in), optional :: is_tensor

    type(field_t), allocatable :: grown(:)
    integer :: i

    if (.not. allocated(self%fields)) allocate (self%fields(16))
    if (self%n_field == size(self%fields)) then
      allocate (grown(2 * self%n_field))
      do i = 1, self%n_field
        grown(i) = self%fields(i)
      end do
      call move_alloc(grown, self%fields)
    end if
    self%n_field = self%n_field + 1
    associate (field => self%fields(self%n_field))
      field%name = name
      field%dimension = dimension
      field%description = description
      field%location = location
      if (present(is_tensor)) field%is_tensor = is_tensor
      allocate (field%values, source=values)
    end associate

  end subroutine field_list_add

  pure function field_list_names(self) result(names)
    class(field_list_t), intent(in) :: self
    character(len=64) :: names(self%n_field)

    integer :: i

    do i = 1, self%n_field
      names(i) = self%fields(i)%name
    end do

  end function field_list_names

  pure function field_list_find(self, name) result(place)
    class(field_list_t), intent(in) :: self
    character(len=*), intent(in) :: name
    integer :: place

    do place = self%n_field, 1, -1
      if (self%fields(place)%name == name) exit
    end do

  end function field_list_find

end module swage_field_list
