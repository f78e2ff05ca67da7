!> Rows of a verification program, read by tools/verify.
module swage_test_rows
  use, intrinsic :: iso_fortran_env, only: output_unit
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: print_row

contains

  !> Print `row;name;computed;reference;error;tolerance`.
  subroutine print_row(name, computed, reference, error, tolerance)
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: computed
    real(wp), intent(in) :: reference
    !> At most the tolerance when all is well.
    real(wp), intent(in) :: error
    real(wp), intent(in) :: tolerance

    write (output_unit, '(*(g0, :, '';''))') 'row', name, computed, reference, error, tolerance

  end subroutine print_row

end module swage_test_rows
