!> The serial part of pFUnit's interface, as far as `.pf` files of Swage use it.
module funit
  use swage_test_assert, only: assertEqual, assertFalse, assertGreaterThan, &
                               assertGreaterThanOrEqual, assertLessThan, assertLessThanOrEqual, &
                               assertRelativelyEqual, assertTrue
  use swage_test_failures, only: anyExceptions, SourceLocation
  use swage_test_value, only: test_value
  implicit none(type, external)
  public

end module funit
