!> What every flow-stress law provides: the stress at which a material flows, as a function of its
!> equivalent plastic strain and of temperature.
!>
!> Temperature acts alike on all kinds, through one factor on the whole stress:
!> \[ \sigma_0(\bar\varepsilon, T) = h(\bar\varepsilon)\, e^{-\beta (T - T_0)}. \]
!> The exponential is chosen because it is positive at every temperature and is the one of the
!> Norton–Hoff consistency; \(\beta = 0\), the default, switches it off.
module swage_flow_stress
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_units, only: ROOM_TEMPERATURE
  implicit none(type, external)
  private

  public :: flow_stress_t

  !> A flow-stress law with its parameters; immutable once created.
  type, abstract :: flow_stress_t
    !> \(\beta\) [1/temperature_change].
    real(wp) :: thermal_softening = 0.0_wp
    !> \(T_0\) [temperature], kelvin.
    real(wp) :: reference_temperature = ROOM_TEMPERATURE
  contains
    !> Flow stress and its slope.
    procedure, non_overridable :: evaluate => flow_stress_evaluate
    !> Name and check the keys of the thermal softening.
    procedure, non_overridable :: take_softening => flow_stress_take_softening
    !> Flow stress and its slope at the reference temperature.
    procedure(evaluate_hardening), deferred :: evaluate_hardening
  end type flow_stress_t

  abstract interface

    !> \(h\) and \(h'\).
    pure subroutine evaluate_hardening(self, equivalent_strain, stress, slope)
      import :: flow_stress_t, wp
      implicit none(type, external)
      class(flow_stress_t), intent(in) :: self
      !> Equivalent plastic strain [1], at least 0.
      real(wp), intent(in) :: equivalent_strain
      !> [stress].
      real(wp), intent(out) :: stress
      !> Its derivative by the strain [stress].
      real(wp), intent(out) :: slope
    end subroutine evaluate_hardening

  end interface

contains

  !> \(\sigma_0\) and \(\partial\sigma_0 / \partial\bar\varepsilon\).
  pure subroutine flow_stress_evaluate(self, equivalent_strain, temperature, stress, slope)
    class(flow_stress_t), intent(in) :: self
    !> Equivalent plastic strain [1], at least 0.
    real(wp), intent(in) :: equivalent_strain
    !> Kelvin [temperature].
    real(wp), intent(in) :: temperature
    !> [stress].
    real(wp), intent(out) :: stress
    !> Its derivative by the strain [stress].
    real(wp), intent(out) :: slope

    real(wp) :: factor

    call self%evaluate_hardening(equivalent_strain, stress, slope)
    if (abs(self%thermal_softening) > 0.0_wp) then
      factor = exp(-self%thermal_softening * (temperature - self%reference_temperature))
      stress = factor * stress
      slope = factor * slope
    end if

  end subroutine flow_stress_evaluate

  subroutine flow_stress_take_softening(self, group)
    class(flow_stress_t), intent(inout) :: self
    type(group_t), intent(inout) :: group

    call group%take('thermal_softening', self%thermal_softening, '1/temperature_change', &
                    'Softening b: the flow stress is multiplied by exp(-b (T - T0)).', &
                    lower=0.0_wp)
    call group%take('reference_temperature', self%reference_temperature, 'temperature', &
                    'Temperature T0 at which the softening factor is 1.', above=0.0_wp)

  end subroutine flow_stress_take_softening

end module swage_flow_stress
