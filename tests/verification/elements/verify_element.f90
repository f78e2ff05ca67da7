!> Benchmarks A1 (constant strain), A2 (rigid rotation), A5 (condensation) and the derivative of
!> the element, in plane strain, axial symmetry and three dimensions.
program verify_element
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t
  use swage_test_element_checks, only: condensation_error, KIND_NAMES, KINDS, patch_errors, &
    rotation_errors, tangent_error
  use swage_test_laws, only: LAW_NAMES, make_elastic, make_law
  use swage_test_rows, only: print_row
  implicit none(type, external)

  integer :: i

  do i = 1, size(KINDS)
    call patch_rows(i)
  end do
  do i = 1, size(KINDS)
    call rotation_rows(i)
  end do
  do i = 1, size(KINDS)
    call condensation_row(i)
  end do
  do i = 1, size(KINDS)
    call tangent_rows(i)
  end do

contains

  subroutine patch_rows(i)
    integer, intent(in) :: i

    real(wp), parameter :: POISSON(2) = [0.3_wp, 0.4999_wp]
    character(len=6), parameter :: POISSON_NAMES(2) = ['0.3   ', '0.4999']
    character(len=8), parameter :: GEOMETRY_NAMES(2) = ['fixed   ', 'updated ']
    class(material_law_t), allocatable :: law
    character(len=:), allocatable :: name
    real(wp) :: displacement_error, pressure_error, shear_modulus, stress_error
    integer :: geometry, j

    do j = 1, size(POISSON)
      call make_elastic(1000.0_wp, POISSON(j), law, shear_modulus)
      do geometry = 1, 2
        call patch_errors(KINDS(i), geometry == 1, law, shear_modulus, displacement_error, &
                          pressure_error, stress_error)
        name = 'A1 patch, '//trim(KIND_NAMES(i))//', '//trim(GEOMETRY_NAMES(geometry))//', nu = ' &
          //trim(POISSON_NAMES(j))
        call print_row(name//': displacement', displacement_error, 0.0_wp, displacement_error, &
                       1.0e-11_wp)
        call print_row(name//': pressure', pressure_error, 0.0_wp, pressure_error, 1.0e-11_wp)
        call print_row(name//': deviator', stress_error, 0.0_wp, stress_error, 1.0e-11_wp)
      end do
    end do

  end subroutine patch_rows

  subroutine rotation_rows(i)
    integer, intent(in) :: i

    integer, parameter :: STEPS(3) = [1, 10, 90]
    character(len=2), parameter :: STEP_NAMES(3) = ['1 ', '10', '90']
    class(material_law_t), allocatable :: law
    character(len=:), allocatable :: name
    real(wp) :: equation_error, shear_modulus, stress_error
    integer :: j

    call make_elastic(1000.0_wp, 0.3_wp, law, shear_modulus)
    do j = 1, size(STEPS)
      call rotation_errors(KINDS(i), law, STEPS(j), stress_error, equation_error)
      name = 'A2 rotation by 90 degrees, '
      if (KIND_NAMES(i) == 'axisymmetric') name = 'A2 motion along the axis, '
      name = name//trim(KIND_NAMES(i))//', '//trim(STEP_NAMES(j))//' steps'
      call print_row(name//': stress', stress_error, 0.0_wp, stress_error, 1.0e-12_wp)
      call print_row(name//': forces, volume', equation_error, 0.0_wp, equation_error, 1.0e-12_wp)
    end do

  end subroutine rotation_rows

  subroutine condensation_row(i)
    integer, intent(in) :: i

    class(material_law_t), allocatable :: law
    real(wp) :: error, shear_modulus

    call make_elastic(2.6_wp, 0.3_wp, law, shear_modulus)
    call condensation_error(KINDS(i), law, shear_modulus, error)
    call print_row('A5 condensation, '//trim(KIND_NAMES(i)), error, 0.0_wp, error, 1.0e-12_wp)

  end subroutine condensation_row

  subroutine tangent_rows(i)
    integer, intent(in) :: i

    class(material_law_t), allocatable :: law
    real(wp) :: error, fixed_error
    integer :: j

    do j = 1, size(LAW_NAMES)
      call make_law(LAW_NAMES(j), 1.0_wp, law)
      call tangent_error(KINDS(i), .false., law, 1.0_wp, error)
      call tangent_error(KINDS(i), .true., law, 1.0_wp, fixed_error)
      error = max(error, fixed_error)
      call print_row('A6 element tangent, '//trim(KIND_NAMES(i))//', '//trim(LAW_NAMES(j)), &
                     error, 0.0_wp, error, 1.0e-6_wp)
    end do

  end subroutine tangent_rows

end program verify_element
