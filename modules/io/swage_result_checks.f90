!> What may not enter a result file: meshes that contradict themselves, numbers that are none.
module swage_result_checks
  use, intrinsic :: iso_fortran_env, only: real32
  use swage_finite, only: is_finite
  use swage_kinds, only: wp
  use swage_status, only: status_t, EXIT_FILE, STATUS_ERROR
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: check_mesh, check_values

contains

  !> Refuse a mesh that VTK would stumble over.
  subroutine check_mesh(points, connectivity, offsets, types, path, status)
    !> Positions [length]; shape (3, n_point).
    real(wp), contiguous, intent(in) :: points(:, :)
    !> Points of the cells, counted from 0.
    integer, contiguous, intent(in) :: connectivity(:)
    !> Where each cell starts in `connectivity`, from 0; shape (n_cell + 1).
    integer, contiguous, intent(in) :: offsets(:)
    !> Shape (n_cell).
    integer, contiguous, intent(in) :: types(:)
    !> Of the file, for the message.
    character(len=*), intent(in) :: path
    !> `STATUS_ERROR` with `EXIT_FILE` on this rank.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: fault
    integer :: i, n_cell

    n_cell = size(types)
    fault = ''
    if (size(points, 1) /= 3) fault = 'a point has '//text(size(points, 1))//' coordinates, not 3'
    if (size(offsets) /= n_cell + 1) then
      fault = text(size(offsets))//' offsets for '//text(n_cell)//' cells: one more is needed'
    else if (offsets(1) /= 0 .or. offsets(n_cell + 1) /= size(connectivity)) then
      fault = 'the offsets do not span the connectivity'
    else if (any(offsets(2:) < offsets(:n_cell))) then
      fault = 'the offsets of the cells decrease'
    end if
    if (any(connectivity < 0) .or. any(connectivity >= size(points, 2))) then
      fault = 'a cell names a point its part does not have'
    end if
    do i = 1, size(points, 2)
      if (all(is_finite(points(:, i)))) cycle
      fault = 'point '//text(i)//' of this rank has a coordinate that is not a finite number'
      exit
    end do
    if (fault /= '') then
      call status%raise(STATUS_ERROR, 'vtkhdf_begin_step', path//': '//fault, EXIT_FILE)
    end if

  end subroutine check_mesh

  !> Refuse numbers a picture could not show.
  subroutine check_values(name, values, is_single, rank, status)
    !> Of the field.
    character(len=*), intent(in) :: name
    !> Shape (n_component, n_item).
    real(wp), contiguous, intent(in) :: values(:, :)
    !> Whether single precision must hold them.
    logical, intent(in) :: is_single
    !> For the message.
    integer, intent(in) :: rank
    !> `STATUS_ERROR` with `EXIT_FILE` on this rank, naming the first such number.
    type(status_t), intent(inout) :: status

    real(wp), parameter :: LARGEST_SINGLE = real(huge(1.0_real32), wp)
    character(len=:), allocatable :: fault
    integer :: i, j

    do j = 1, size(values, 2)
      do i = 1, size(values, 1)
        if (.not. is_finite(values(i, j))) then
          fault = 'is not a finite number'
        else if (is_single .and. abs(values(i, j)) > LARGEST_SINGLE) then
          fault = '('//text(values(i, j))//') is too large for single precision'
        else
          cycle
        end if
        call status%raise(STATUS_ERROR, 'vtkhdf_field', 'field '//trim(name)//': component '// &
                          text(i)//' of item '//text(j)//' on rank '//text(rank)//' '//fault, &
                          EXIT_FILE)
        return
      end do
    end do

  end subroutine check_values

end module swage_result_checks
