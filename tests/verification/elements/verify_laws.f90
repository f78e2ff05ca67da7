!> Benchmark A6: the tangent of each law on 1000 random states.
program verify_laws
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t
  use swage_point_batch, only: point_batch_t
  use swage_test_laws, only: LAW_NAMES, make_law
  use swage_test_materials, only: compare_tangents, draw_states, STEEL
  use swage_test_random, only: random_t
  use swage_test_rows, only: print_row
  implicit none(type, external)

  integer, parameter :: N_STATE = 1000
  integer, parameter :: N_BATCH = 10
  class(material_law_t), allocatable :: law
  type(point_batch_t) :: batch
  type(random_t) :: random
  real(wp), allocatable :: by_strain(:), by_stress(:), step(:)
  real(wp) :: memory_error, tangent_error
  integer :: i, j, n_failed

  do i = 1, size(LAW_NAMES)
    call make_law(LAW_NAMES(i), STEEL%get_shear_modulus(), law)
    tangent_error = 0.0_wp
    memory_error = 0.0_wp
    ! Each batch has a time step of its own
    do j = 1, N_BATCH
      call draw_states(law, N_STATE / N_BATCH, random, batch, step)
      call compare_tangents(law, batch, step, by_strain, by_stress, n_failed)
      if (n_failed > 0) tangent_error = huge(1.0_wp)
      tangent_error = max(tangent_error, maxval(by_strain))
      memory_error = max(memory_error, maxval(by_stress))
    end do
    call print_row('A6 tangent by strain, '//trim(LAW_NAMES(i)), tangent_error, 0.0_wp, &
                   tangent_error, 1.0e-6_wp)
    call print_row('A6 tangent by old stress, '//trim(LAW_NAMES(i)), memory_error, 0.0_wp, &
                   memory_error, 1.0e-6_wp)
  end do

end program verify_laws
