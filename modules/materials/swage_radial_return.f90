!> The skeleton of every isotropic law with elasticity: trial stress, radial return, tangent.
!>
!> A law is a threshold \(R(\bar\varepsilon, T)\) and, when it depends on the rate, an overstress
!> \(\Phi\). With the trial deviator
!> \(s^{tr} = \mathrm{dev}\,\sigma_n + 2G\,\mathrm{dev}\,\Delta\varepsilon\), its equivalent
!> \(q^{tr} = \sqrt{\tfrac32 s^{tr}:s^{tr}}\) and the unknown increment \(x\) of the equivalent
!> plastic strain,
!> \[ f(x) = q - R(\bar\varepsilon_n + x, T) - \Phi(x, q) = 0, \quad q = q^{tr} - 3G x, \quad
!>    s = \theta s^{tr}, \quad \theta = q / q^{tr}, \]
!> and the consistent tangent, with \(H\) the rise of \(q^{tr}\) per unit of \(x\), is
!> \[ 2G \theta\, \mathbb P - 2G \bigl(3G / H - (1 - \theta)\bigr) n \otimes n, \quad
!>    n = s^{tr} / |s^{tr}|. \]
!> Temperature is that of the end of the step.
!>
!> Source: J. C. Simo and T. J. R. Hughes, Computational Inelasticity (1998), chapter 3.
module swage_radial_return
  use swage_elasticity, only: elasticity_t
  use swage_finite, only: is_finite
  use swage_flow_stress, only: flow_stress_t
  use swage_isotropic_tangent, only: set_isotropic_tangent
  use swage_kinds, only: wp
  use swage_mandel, only: deviator
  use swage_material_law, only: material_law_t, PLASTIC_STATE, ROW_RATE, ROW_STRAIN
  use swage_overstress, only: flow_state_t, overstress_t
  use swage_point_batch, only: point_batch_t
  implicit none(type, external)
  private

  public :: radial_return_law_t, radial_return_create

  !> Enough for pure bisection of the widest bracket.
  integer, parameter :: MAX_ITERATIONS = 120

  !> From here on every second iteration is a bisection.
  integer, parameter :: PATIENCE = 15

  !> A stress outside the yield surface by less than this share lies on it: a step without strain
  !> that follows a plastic one is elastic, and so is the tangent that it starts from when the load
  !> turns back.
  real(wp), parameter :: ON_SURFACE = 1.0e-10_wp
  !> The increment is found when its relative change and the residual over the trial stress are
  !> below these. Either alone deceives: near \(q = 0\) the overstress of equation 3 is so steep
  !> that a step moves nothing.
  real(wp), parameter :: STEP_TOLERANCE = 1.0e-14_wp
  real(wp), parameter :: RESIDUAL_TOLERANCE = 1.0e-12_wp

  !> Ratio of the ends of a bracket beyond which it is cut by logarithms.
  real(wp), parameter :: DECADES = 10.0_wp

  !> Least θ of the bubble, so that its modulus stays positive.
  real(wp), parameter :: LEAST_RELAXATION = 1.0e-6_wp

  type, extends(material_law_t) :: radial_return_law_t
    private
    !> \(G\) [stress].
    real(wp) :: shear_modulus = 0.0_wp
    !> \(R\).
    class(flow_stress_t), allocatable :: threshold
    !> \(\Phi\); not allocated in a law that does not depend on the rate.
    class(overstress_t), allocatable :: overstress
  contains
    procedure :: update => radial_return_update
  end type radial_return_law_t

  !> What the return of one point leaves.
  type :: return_t
    !> \(x\) [1].
    real(wp) :: increment = 0.0_wp
    !> \(H = -f_x / f_{q^{tr}}\) [stress].
    real(wp) :: resistance = 0.0_wp
    !> \(R + \Phi\) [stress].
    real(wp) :: flow_stress = 0.0_wp
    logical :: found = .false.
  end type return_t

contains

  !> Make a law from valid parts.
  pure subroutine radial_return_create(label, elasticity, threshold, law, overstress)
    !> Name of the law in messages.
    character(len=*), intent(in) :: label
    type(elasticity_t), intent(in) :: elasticity
    !> \(R\); positive without strain in a law that does not depend on the rate.
    class(flow_stress_t), intent(in) :: threshold
    type(radial_return_law_t), intent(out) :: law
    !> \(\Phi\); absent in a law that does not depend on the rate.
    class(overstress_t), intent(in), optional :: overstress

    real(wp) :: slope

    law%label = label
    law%shear_modulus = elasticity%get_shear_modulus()
    allocate (law%threshold, source=threshold)
    if (present(overstress)) allocate (law%overstress, source=overstress)
    call elasticity%describe(law)
    call threshold%evaluate(0.0_wp, threshold%reference_temperature, law%initial_flow_stress, &
                            slope)
    call law%publish_state(PLASTIC_STATE)

  end subroutine radial_return_create

  !> See [[material_law_t:update]]. A point fails when its trial stress is not finite or no
  !> increment is found; it is left with its trial stress.
  pure subroutine radial_return_update(self, batch, n_failed)
    class(radial_return_law_t), intent(in) :: self
    type(point_batch_t), intent(inout) :: batch
    integer, intent(out) :: n_failed

    type(return_t) :: back
    real(wp) :: direction(6), loss, modulus, relaxation, slope, strain_old, threshold, trial
    real(wp) :: trial_equivalent, trial_stress(6)
    integer :: point

    modulus = 2.0_wp * self%shear_modulus
    n_failed = 0
    do point = 1, batch%n_point

      trial_stress = deviator(batch%stress_old(:, point)) &
        + modulus * deviator(batch%strain_increment(:, point))
      trial = sqrt(dot_product(trial_stress, trial_stress))
      trial_equivalent = sqrt(1.5_wp) * trial
      strain_old = batch%state_old(ROW_STRAIN, point)
      call self%threshold%evaluate(strain_old, batch%temperature_new(point), threshold, slope)

      back = return_t(flow_stress=threshold)
      direction = 0.0_wp
      relaxation = 1.0_wp
      loss = 0.0_wp
      if (.not. is_finite(trial_equivalent)) then
        n_failed = n_failed + 1
      else if (trial_equivalent > threshold * (1.0_wp + ON_SURFACE)) then
        call find_increment(self, trial_equivalent, strain_old, batch%temperature_new(point), &
                            batch%dt, back)
        if (back%found) then
          relaxation = 1.0_wp - 3.0_wp * self%shear_modulus * back%increment / trial_equivalent
          direction = trial_stress / trial
          loss = modulus &
            * (3.0_wp * self%shear_modulus / back%resistance - (1.0_wp - relaxation))
        else
          n_failed = n_failed + 1
          back = return_t(flow_stress=threshold)
        end if
      end if

      batch%deviatoric_stress(:, point) = relaxation * trial_stress
      call set_isotropic_tangent(modulus * relaxation, -loss, direction, &
                                 batch%deviatoric_tangent(:, :, point))
      batch%memory_modulus(point) = modulus
      batch%flow_stress(point) = back%flow_stress
      batch%bubble_modulus(point) = modulus * max(relaxation, LEAST_RELAXATION)
      batch%relaxation_factor(point) = relaxation
      batch%dissipated_power(point) = relaxation * trial_equivalent * back%increment / batch%dt
      batch%state_new(ROW_STRAIN, point) = strain_old + back%increment
      batch%state_new(ROW_RATE, point) = back%increment / batch%dt

    end do

  end subroutine radial_return_update

  !> Solve \(f(x) = 0\) by Newton's method inside a bracket that only shrinks.
  !>
  !> The overstress is steep at rest and flat later, so the search starts on the steep side, from
  !> where Newton's method climbs without overshooting. A bisection replaces a step that leaves the
  !> bracket or stands still, one after two that have not halved the residual, and, in a long
  !> search, every second one: it must not creep.
  pure subroutine find_increment(self, trial, strain_old, temperature, dt, back)
    class(radial_return_law_t), intent(in) :: self
    !> \(q^{tr}\), above the threshold at `strain_old` [stress].
    real(wp), intent(in) :: trial
    !> [1].
    real(wp), intent(in) :: strain_old
    !> Kelvin [temperature].
    real(wp), intent(in) :: temperature
    !> [time].
    real(wp), intent(in) :: dt
    type(return_t), intent(inout) :: back

    real(wp) :: by_increment, by_stress, high, low, next, overstress, residual, residual_before
    real(wp) :: residual_last, slope, stiffness, stress, threshold, threshold_old, x
    integer :: iteration

    back%found = .false.
    stiffness = 3.0_wp * self%shear_modulus
    threshold_old = back%flow_stress
    low = 0.0_wp
    high = (trial - threshold_old) / stiffness
    call self%threshold%evaluate(strain_old + high, temperature, threshold, slope)
    if (threshold < threshold_old) high = trial / stiffness
    x = 0.0_wp
    if (allocated(self%overstress)) x = min(self%overstress%starting_rate * dt, 0.5_wp * high)
    overstress = 0.0_wp
    by_increment = 0.0_wp
    by_stress = 0.0_wp
    residual_before = huge(1.0_wp)
    residual_last = huge(1.0_wp)

    do iteration = 1, MAX_ITERATIONS

      stress = max(trial - stiffness * x, epsilon(1.0_wp) * trial)
      call self%threshold%evaluate(strain_old + x, temperature, threshold, slope)
      if (allocated(self%overstress)) then
        call self%overstress%evaluate(flow_state_t(x, stress, dt, temperature), overstress, &
                                      by_increment, by_stress)
      end if
      residual = stress - threshold - overstress
      back%flow_stress = threshold + overstress
      back%resistance = stiffness + (slope + by_increment) / (1.0_wp - by_stress)
      back%increment = x

      if (abs(residual) <= epsilon(1.0_wp) * trial) then
        back%found = back%resistance > 0.0_wp
        return
      end if
      if (residual > 0.0_wp) then
        low = x
      else
        high = x
      end if

      next = high
      if (back%resistance > 0.0_wp) then
        next = x + residual / (back%resistance * (1.0_wp - by_stress))
        ! The end of the bracket is the root of perfect plasticity, and rounding may pass it
        if (next > high .and. next <= high * (1.0_wp + 1.0e-12_wp)) next = high
        if (abs(next - x) <= STEP_TOLERANCE * x .and. &
            abs(residual) <= RESIDUAL_TOLERANCE * trial) then
          back%increment = next
          back%found = .true.
          return
        end if
      end if
      if (back%resistance <= 0.0_wp .or. .not. (next > low .and. next <= high) .or. &
          abs(next - x) <= STEP_TOLERANCE * x .or. abs(residual) > 0.5_wp * abs(residual_before) &
          .or. (iteration > PATIENCE .and. mod(iteration, 2) == 0)) then
        next = middle(low, high, trial / stiffness)
      end if
      residual_before = residual_last
      residual_last = residual
      x = next

    end do

  end subroutine find_increment

  !> A point between two increments: in the middle of their logarithms while they are decades apart,
  !> or else of those of the elastic strains left, \(x_{end} - x\), or else of themselves.
  pure function middle(low, high, whole) result(x)
    real(wp), intent(in) :: low
    real(wp), intent(in) :: high
    !> \(x_{end}\), the increment that leaves no stress.
    real(wp), intent(in) :: whole
    real(wp) :: x

    real(wp) :: rest_high, rest_low

    rest_low = whole - low
    rest_high = max(whole - high, epsilon(1.0_wp) * whole)
    if (low > 0.0_wp .and. high > DECADES * low) then
      x = sqrt(low) * sqrt(high)
    else if (rest_low > DECADES * rest_high) then
      x = whole - sqrt(rest_low) * sqrt(rest_high)
    else
      x = 0.5_wp * (low + high)
    end if

  end function middle

end module swage_radial_return
