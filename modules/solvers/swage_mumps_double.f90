!> Factors of a matrix in double precision, by MUMPS; see [[mumps_factor_t]].
module swage_mumps_double
  use swage_block_matrix, only: block_matrix_t
  use swage_coupling_matrix, only: coupling_matrix_t
  use swage_dmumps_header, only: mumps => dmumps, mumps_struc => dmumps_struc
  use swage_factor_layout, only: factor_layout_t, return_plan_t, UNSYMMETRIC, WITHOUT_PIVOTING
  use swage_kinds, only: gp, rp => wp, wp
  use swage_status, only: EXIT_SOLVER, status_t, STATUS_ERROR, STATUS_RETRY
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: mumps_factor_t

  include 'swage_mumps_factor.inc'

end module swage_mumps_double
