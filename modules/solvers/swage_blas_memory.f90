!> The working memory of the BLAS, taken before a solver needs it.
!>
!> OpenBLAS takes a buffer of 128 MB at its first call and, where the system refuses it, asks again
!> for ever. So the room is looked for first, and the buffer is taken while it is there.
module swage_blas_memory
  use swage_kinds, only: wp
  use swage_status, only: EXIT_SOLVER, status_t, STATUS_ERROR
  implicit none(type, external)
  private

  public :: claim_blas_memory

  !> Room that is looked for [bytes]: the buffer of OpenBLAS, and a margin for its bookkeeping.
  integer, parameter :: ROOM = 144 * 1024 * 1024
  !> Order of a product that is too large for the kernels that need no buffer.
  integer, parameter :: LARGE = 128

  interface
    subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
      import :: wp
      implicit none(type, external)
      character(len=1), intent(in) :: transa, transb
      integer, intent(in) :: m, n, k, lda, ldb, ldc
      real(wp), intent(in) :: alpha, beta
      real(wp), intent(in) :: a(lda, k), b(ldb, n)
      real(wp), intent(inout) :: c(ldc, n)
    end subroutine dgemm
  end interface

contains

  !> Make the BLAS take its memory. Harmless when called again.
  subroutine claim_blas_memory(status)
    !> `STATUS_ERROR` when there is none.
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: a(:, :), b(:, :), room_for_it(:)
    integer :: problem

    allocate (room_for_it(ROOM / (storage_size(1.0_wp) / 8)), stat=problem)
    if (problem /= 0) then
      call status%raise(STATUS_ERROR, 'claim_blas_memory', 'memory is short: no room for the '// &
                        'buffer of 128 MB that the linear algebra library takes. Give the run '// &
                        'more memory', EXIT_SOLVER)
      return
    end if
    deallocate (room_for_it)
    allocate (a(LARGE, LARGE), b(LARGE, LARGE), source=1.0_wp)
    call dgemm('n', 'n', LARGE, LARGE, LARGE, 1.0_wp, a, LARGE, a, LARGE, 0.0_wp, b, LARGE)

  end subroutine claim_blas_memory

end module swage_blas_memory
