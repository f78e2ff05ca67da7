!> pFUnit's interface for tests on several ranks, as far as `.pf` files of Swage use it.
module pfunit
  use funit, only: anyExceptions, assertEqual, assertFalse, assertGreaterThan, &
                   assertGreaterThanOrEqual, assertLessThan, assertLessThanOrEqual, &
                   assertRelativelyEqual, assertTrue, SourceLocation, test_value
  use swage_test_runner, only: MpiTestMethod
  implicit none(type, external)
  public

end module pfunit
