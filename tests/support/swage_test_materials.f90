!> States of material points for tests, and derivatives of laws by differences.
module swage_test_materials
  use swage_elasticity, only: elasticity_t
  use swage_kinds, only: wp
  use swage_mandel, only: deviator
  use swage_material_law, only: material_law_t, ROW_RATE, ROW_STRAIN
  use swage_point_batch, only: point_batch_create, point_batch_t
  use swage_state_table, only: STATE_TENSOR2
  use swage_test_random, only: random_t
  implicit none(type, external)
  private

  public :: STEEL, compare_tangents, draw_states, equivalent_stress, stretch_point

  !> In mm, tonne, s.
  type(elasticity_t), parameter :: STEEL = elasticity_t(young=200000.0_wp, poisson=0.3_wp)

  !> Distance from the threshold of the states closest to it, relative.
  real(wp), parameter :: CLOSEST = 1.0e-8_wp

contains

  !> \(\sqrt{\tfrac32 s:s}\).
  pure function equivalent_stress(deviatoric_stress) result(equivalent)
    real(wp), intent(in) :: deviatoric_stress(6)
    real(wp) :: equivalent

    equivalent = sqrt(1.5_wp * dot_product(deviatoric_stress, deviatoric_stress))

  end function equivalent_stress

  !> Random states of a law: hardened or virgin, loaded below, at and above the threshold, strained
  !> by 1e-9 to 0.5; of every ten, one lies 1e-8 above the threshold and one 1e-8 below.
  !>
  !> `step` is a strain small enough to differentiate with: no state leaves its side of the
  !> threshold when strained by twice as much.
  subroutine draw_states(law, n_point, random, batch, step)
    class(material_law_t), intent(in) :: law
    integer, intent(in) :: n_point
    type(random_t), intent(inout) :: random
    type(point_batch_t), intent(out) :: batch
    !> Shape (n_point).
    real(wp), allocatable, intent(out) :: step(:)

    real(wp), allocatable :: threshold(:)
    real(wp) :: back(6), direction(6), distance, magnitude, pressure, scale, trial(6), &
      trial_equivalent
    integer :: i, point

    call point_batch_create(n_point, law%n_state, batch)
    allocate (step(n_point))
    call random%next(-4.0_wp, 2.0_wp, magnitude)
    batch%dt = 10.0_wp**magnitude
    do point = 1, n_point
      call random%next(250.0_wp, 1500.0_wp, batch%temperature_new(point))
      if (law%n_state > 0) then
        call random%next(-0.3_wp, 1.0_wp, batch%state_old(point, ROW_STRAIN))
        batch%state_old(point, ROW_STRAIN) = max(batch%state_old(point, ROW_STRAIN), 0.0_wp)
        call random%next(0.0_wp, 10.0_wp, batch%state_old(point, ROW_RATE))
      end if
    end do
    call find_thresholds(law, batch, threshold)

    do point = 1, n_point
      scale = max(threshold(point), 1.0_wp)
      call draw_back_stress(law, scale, point, random, batch, back)
      call draw_direction(random, direction)
      call random%next(0.0_wp, 1.3_wp, magnitude)
      call random%next(-1000.0_wp, 1000.0_wp, pressure)
      batch%stress_old(point, :) = magnitude * scale * sqrt(2.0_wp / 3.0_wp) * direction
      call draw_direction(random, direction)
      call random%next(-9.0_wp, log10(0.5_wp), magnitude)
      batch%strain_increment(point, :) = 10.0_wp**magnitude * direction
      do i = 1, 3
        batch%stress_old(point, i) = batch%stress_old(point, i) - pressure
        batch%strain_increment(point, i) = batch%strain_increment(point, i) &
          + 0.3_wp * 10.0_wp**magnitude
      end do

      ! Trial stress along the old one, to the wanted distance
      if (mod(point, 10) < 2 .and. threshold(point) > 0.0_wp) then
        ! Without pressure, whose rounding would drown the distance
        trial = deviator(batch%stress_old(point, :))
        batch%stress_old(point, :) = trial + back
        magnitude = 1.0_wp + merge(CLOSEST, -CLOSEST, mod(point, 10) == 0)
        trial = trial * (magnitude * threshold(point) / equivalent_stress(trial) - 1.0_wp)
        batch%strain_increment(point, :) = trial / law%reference_modulus
      end if

      if (law%fluid) then
        step(point) = 1.0e-3_wp * norm2(deviator(batch%strain_increment(point, :)))
        cycle
      end if
      trial = deviator(batch%stress_old(point, :)) - back &
        + law%reference_modulus * deviator(batch%strain_increment(point, :))
      trial_equivalent = equivalent_stress(trial)
      distance = abs(trial_equivalent - threshold(point))
      distance = max(1.0e-3_wp * distance, min(0.3_wp * distance, 1.0e-7_wp * trial_equivalent))
      step(point) = distance / (sqrt(1.5_wp) * law%reference_modulus)
    end do

  end subroutine draw_states

  !> Give the tensors of the history of a point, deviators all, a random value.
  subroutine draw_back_stress(law, scale, point, random, batch, back)
    class(material_law_t), intent(in) :: law
    !> Of the values [stress].
    real(wp), intent(in) :: scale
    integer, intent(in) :: point
    type(random_t), intent(inout) :: random
    type(point_batch_t), intent(inout) :: batch
    !> The last tensor, 0 when there is none.
    real(wp), intent(out) :: back(6)

    real(wp) :: direction(6)
    integer :: i, row

    back = 0.0_wp
    row = 1
    do i = 1, size(law%state_table)
      if (law%state_table(i)%kind == STATE_TENSOR2) then
        call draw_direction(random, direction)
        back = 0.7_wp * scale * direction
        batch%state_old(point, row:row + 5) = back
      end if
      row = row + law%state_table(i)%width()
    end do

  end subroutine draw_back_stress

  !> Equivalent stress at which each point starts to flow: that of the law for points at rest.
  subroutine find_thresholds(law, batch, threshold)
    class(material_law_t), intent(in) :: law
    type(point_batch_t), intent(in) :: batch
    real(wp), allocatable, intent(out) :: threshold(:)

    type(point_batch_t) :: resting
    integer :: n_failed

    resting = batch
    resting%strain_increment(:, :) = 0.0_wp
    resting%stress_old(:, :) = 0.0_wp
    call law%update(resting, n_failed)
    allocate (threshold, source=resting%flow_stress)

  end subroutine find_thresholds

  !> A deviator of norm 1.
  subroutine draw_direction(random, direction)
    type(random_t), intent(inout) :: random
    real(wp), intent(out) :: direction(6)

    call random%fill(-1.0_wp, 1.0_wp, direction)
    direction = deviator(direction)
    direction = direction / norm2(direction)

  end subroutine draw_direction

  !> Compare the tangent of a law with differences of fourth order of its stress.
  subroutine compare_tangents(law, batch, step, by_strain, by_stress, n_failed)
    class(material_law_t), intent(in) :: law
    !> In: states. Out: updated.
    type(point_batch_t), intent(inout) :: batch
    !> [1]; shape (n_point).
    real(wp), intent(in) :: step(:)
    !> Error of the derivative by `strain_increment`, relative to the largest component of the
    !> tangent at the point; shape (n_point).
    real(wp), allocatable, intent(out) :: by_strain(:)
    !> The same for the derivative by `stress_old`, which `memory_modulus` promises.
    real(wp), allocatable, intent(out) :: by_stress(:)
    !> Points that failed in any of the updates.
    integer, intent(out) :: n_failed

    real(wp), parameter :: WEIGHTS(4) = [1.0_wp, -8.0_wp, 8.0_wp, -1.0_wp] / 12.0_wp
    real(wp), parameter :: PLACES(4) = [-2.0_wp, -1.0_wp, 1.0_wp, 2.0_wp]

    type(point_batch_t) :: moved
    real(wp) :: modulus, scale, tangent(6, 6)
    real(wp), allocatable :: difference(:, :, :)
    integer :: i, j, n_lost, point

    call law%update(batch, n_failed)
    allocate (by_strain(batch%n_point), by_stress(batch%n_point), source=0.0_wp)
    do j = 1, 6
      allocate (difference(batch%n_point, 6, 2), source=0.0_wp)
      do i = 1, 4
        moved = batch
        moved%strain_increment(:, j) = moved%strain_increment(:, j) + PLACES(i) * step
        call law%update(moved, n_lost)
        n_failed = n_failed + n_lost
        difference(:, :, 1) = difference(:, :, 1) + WEIGHTS(i) * moved%deviatoric_stress

        moved = batch
        moved%stress_old(:, j) = moved%stress_old(:, j) &
          + PLACES(i) * step * law%reference_modulus
        call law%update(moved, n_lost)
        n_failed = n_failed + n_lost
        difference(:, :, 2) = difference(:, :, 2) + WEIGHTS(i) * moved%deviatoric_stress
      end do

      do point = 1, batch%n_point
        tangent = batch%tangent_at(point)
        scale = maxval(abs(tangent))
        by_strain(point) = max(by_strain(point), &
                               maxval(abs(difference(point, :, 1) / step(point) &
                                          - tangent(:, j))) / scale)
        modulus = batch%memory_modulus(point)
        if (modulus > 0.0_wp) then
          by_stress(point) = max(by_stress(point), &
                                 maxval(abs(difference(point, :, 2) / step(point) &
                                            * modulus / law%reference_modulus &
                                            - tangent(:, j))) / scale)
        else
          by_stress(point) = max(by_stress(point), maxval(abs(difference(point, :, 2))))
        end if
      end do
      deallocate (difference)
    end do

  end subroutine compare_tangents

  !> Stretch one point without change of volume, at a constant rate, in equal steps.
  subroutine stretch_point(law, rate, dt, n_step, batch, n_failed)
    class(material_law_t), intent(in) :: law
    !> Of the axial strain [1/time]; 0 holds the point.
    real(wp), intent(in) :: rate
    real(wp), intent(in) :: dt
    integer, intent(in) :: n_step
    !> In: a point, the start; made when it is not. Out: after the last step.
    type(point_batch_t), intent(inout) :: batch
    !> Failures of all steps.
    integer, intent(out) :: n_failed

    integer :: i, n_lost

    if (.not. allocated(batch%stress_old)) call point_batch_create(1, law%n_state, batch)
    batch%dt = dt
    batch%strain_increment(1, :) = rate * dt &
      * [1.0_wp, -0.5_wp, -0.5_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    n_failed = 0
    do i = 1, n_step
      call law%update(batch, n_lost)
      n_failed = n_failed + n_lost
      batch%stress_old(1, :) = batch%deviatoric_stress(1, :)
      batch%state_old(:, :) = batch%state_new
    end do

  end subroutine stretch_point

end module swage_test_materials
