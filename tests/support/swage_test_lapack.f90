!> Interfaces of the LAPACK and BLAS procedures that tests call.
module swage_test_lapack
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: dgbsv, dgemm, dgesv, dpotrf, dpotrs, dsygv

  interface

    !> Solve a banded system; the factors need `kl` rows above the band.
    subroutine dgbsv(n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
      import :: wp
      implicit none(type, external)
      integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
      real(wp), intent(inout) :: ab(ldab, n), b(ldb, nrhs)
      integer, intent(out) :: ipiv(n), info
    end subroutine dgbsv

    !> C = alpha op(A) op(B) + beta C
    subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
      import :: wp
      implicit none(type, external)
      character(len=1), intent(in) :: transa, transb
      integer, intent(in) :: m, n, k, lda, ldb, ldc
      real(wp), intent(in) :: alpha, beta
      real(wp), intent(in) :: a(lda, merge(k, m, transa == 'N')), b(ldb, merge(n, k, transb == 'N'))
      real(wp), intent(inout) :: c(ldc, n)
    end subroutine dgemm

    !> Solve a dense system.
    subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
      import :: wp
      implicit none(type, external)
      integer, intent(in) :: n, nrhs, lda, ldb
      real(wp), intent(inout) :: a(lda, n), b(ldb, nrhs)
      integer, intent(out) :: ipiv(n), info
    end subroutine dgesv

    !> Cholesky factor.
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      implicit none(type, external)
      character(len=1), intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, n)
      integer, intent(out) :: info
    end subroutine dpotrf

    !> Solve with a Cholesky factor.
    subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
      import :: wp
      implicit none(type, external)
      character(len=1), intent(in) :: uplo
      integer, intent(in) :: n, nrhs, lda, ldb
      real(wp), intent(in) :: a(lda, n)
      real(wp), intent(inout) :: b(ldb, nrhs)
      integer, intent(out) :: info
    end subroutine dpotrs

    !> Eigenvalues of A x = λ B x, B positive definite.
    subroutine dsygv(itype, jobz, uplo, n, a, lda, b, ldb, w, work, lwork, info)
      import :: wp
      implicit none(type, external)
      integer, intent(in) :: itype, n, lda, ldb, lwork
      character(len=1), intent(in) :: jobz, uplo
      real(wp), intent(inout) :: a(lda, n), b(ldb, n)
      real(wp), intent(out) :: w(n), work(max(1, lwork))
      integer, intent(out) :: info
    end subroutine dsygv

  end interface

end module swage_test_lapack
