!> Benchmark A3: orders of convergence of the element on manufactured incompressible flows.
program verify_convergence
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t
  use swage_cell_geometry, only: THREE_DIMENSIONAL
  use swage_test_element_checks, only: KIND_NAMES, KINDS
  use swage_test_laws, only: make_elastic
  use swage_test_manufactured, only: flow_errors
  use swage_test_rows, only: print_row
  implicit none(type, external)

  integer :: i

  do i = 1, size(KINDS)
    call rows_of(i)
  end do

contains

  subroutine rows_of(i)
    integer, intent(in) :: i

    integer, parameter :: SIZES_2D(4) = [8, 16, 32, 64]
    integer, parameter :: SIZES_3D(3) = [6, 10, 14]
    class(material_law_t), allocatable :: law
    real(wp) :: shear_modulus, slope
    real(wp), allocatable :: errors(:, :)
    integer, allocatable :: sizes(:)
    character(len=:), allocatable :: name
    integer :: j, n

    ! Shear modulus 1
    call make_elastic(3.0_wp, 0.5_wp, law, shear_modulus)
    if (KINDS(i) == THREE_DIMENSIONAL) then
      allocate (sizes, source=SIZES_3D)
    else
      allocate (sizes, source=SIZES_2D)
    end if
    n = size(sizes)
    allocate (errors(3, n))
    do j = 1, n
      call flow_errors(KINDS(i), sizes(j), law, errors(1, j), errors(2, j), errors(3, j))
    end do
    name = 'A3 order, '//trim(KIND_NAMES(i))//': '
    print '(a, 3(/, *(es12.4)))', name//'errors of u, grad u, p', transpose(errors)
    associate (orders => log(errors(:, n - 1) / errors(:, n)) &
               / log(real(sizes(n), wp) / real(sizes(n - 1), wp)))
      call print_row(name//'u in L2', orders(1), 2.0_wp, abs(orders(1) - 2.0_wp), 0.1_wp)
      call print_row(name//'u in H1', orders(2), 1.0_wp, abs(orders(2) - 1.0_wp), 0.1_wp)
      ! Higher is no fault: 1.5 is known from structured meshes
      slope = orders(3)
      call print_row(name//'p in L2', slope, 1.0_wp, max(0.0_wp, 1.0_wp - slope), 0.05_wp)
    end associate

  end subroutine rows_of

end program verify_convergence
