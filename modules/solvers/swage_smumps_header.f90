!> MUMPS in single precision as it comes: its structure and its only procedure.
module swage_smumps_header
  implicit none(type, external)
  private

  public :: smumps_struc, smumps

  include 'smumps_struc.h'

  interface
    subroutine smumps(id)
      import :: smumps_struc
      implicit none(type, external)
      type(smumps_struc), intent(inout) :: id
    end subroutine smumps
  end interface

end module swage_smumps_header
