!> MUMPS in double precision as it comes: its structure and its only procedure.
module swage_dmumps_header
  implicit none(type, external)
  private

  public :: dmumps_struc, dmumps

  include 'dmumps_struc.h'

  interface
    subroutine dmumps(id)
      import :: dmumps_struc
      implicit none(type, external)
      type(dmumps_struc), intent(inout) :: id
    end subroutine dmumps
  end interface

end module swage_dmumps_header
