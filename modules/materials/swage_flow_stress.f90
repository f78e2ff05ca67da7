!> What every flow-stress law provides: the stress at which a material flows, as a function of its
!> equivalent plastic strain, of the rate of that, and of temperature.
!>
!> Temperature acts alike on all kinds, through one factor on the whole stress:
!> \[ \sigma_0(\bar\varepsilon, \dot{\bar\varepsilon}, T) =
!>    h(\bar\varepsilon, \dot{\bar\varepsilon}, T)\, e^{-\beta (T - T_0)}. \]
!> The exponential is chosen because it is positive at every temperature and is the one of the
!> Norton–Hoff consistency; \(\beta = 0\), the default, switches it off.
module swage_flow_stress
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_point_batch, only: LANES
  use swage_units, only: ROOM_TEMPERATURE
  implicit none(type, external)
  private

  public :: flow_batch_t, flow_stress_t

  !> Points whose flow stress is wanted: a law is called once for all of them.
  type :: flow_batch_t
    !> Points in use.
    integer :: n_point = 0
    !> Equivalent plastic strain [1], at least 0.
    real(wp) :: strain(LANES) = 0.0_wp
    !> Its rate [1/time], at least 0.
    real(wp) :: rate(LANES) = 0.0_wp
    !> Kelvin [temperature].
    real(wp) :: temperature(LANES) = ROOM_TEMPERATURE
    !> Flow stress, set by the law [stress].
    real(wp) :: stress(LANES) = 0.0_wp
    !> Derivative of it by the strain, likewise [stress].
    real(wp) :: by_strain(LANES) = 0.0_wp
    !> Derivative of it by the rate, likewise [stress*time].
    real(wp) :: by_rate(LANES) = 0.0_wp
  end type flow_batch_t

  !> A flow-stress law with its parameters; immutable once created.
  type, abstract :: flow_stress_t
    !> \(\beta\) [1/temperature_change].
    real(wp) :: thermal_softening = 0.0_wp
    !> \(T_0\) [temperature], kelvin.
    real(wp) :: reference_temperature = ROOM_TEMPERATURE
    !> Rate up to which the flow stress does not depend on it, 0 in a law that never does
    !> [1/time]: a search for the increment starts there.
    real(wp) :: starting_rate = 0.0_wp
    !> Strain [1] and rate [1/time] up to which the law is known; beyond it stays constant.
    real(wp) :: largest_strain = huge(1.0_wp)
    real(wp) :: largest_rate = huge(1.0_wp)
    !> Temperatures for which the law is known [temperature], kelvin.
    real(wp) :: lowest_temperature = 0.0_wp
    real(wp) :: highest_temperature = huge(1.0_wp)
  contains
    !> Flow stress and its derivatives at many points.
    procedure, non_overridable :: evaluate_points => flow_stress_evaluate_points
    !> The same at one point.
    procedure, non_overridable :: evaluate => flow_stress_evaluate
    !> Name and check the keys of the thermal softening.
    procedure, non_overridable :: take_softening => flow_stress_take_softening
    !> \(h\) and its derivatives.
    procedure(evaluate_hardening), deferred :: evaluate_hardening
  end type flow_stress_t

  abstract interface

    !> \(h\) and its derivatives; `by_rate` is 0 before the call, for a law to leave alone.
    pure subroutine evaluate_hardening(self, points)
      import :: flow_batch_t, flow_stress_t
      implicit none(type, external)
      class(flow_stress_t), intent(in) :: self
      type(flow_batch_t), intent(inout) :: points
    end subroutine evaluate_hardening

  end interface

contains

  pure subroutine flow_stress_evaluate_points(self, points)
    class(flow_stress_t), intent(in) :: self
    type(flow_batch_t), intent(inout) :: points

    real(wp) :: factor
    integer :: i

    points%by_rate(:points%n_point) = 0.0_wp
    call self%evaluate_hardening(points)
    if (abs(self%thermal_softening) > 0.0_wp) then
      do i = 1, points%n_point
        factor = exp(-self%thermal_softening &
                     * (points%temperature(i) - self%reference_temperature))
        points%stress(i) = factor * points%stress(i)
        points%by_strain(i) = factor * points%by_strain(i)
        points%by_rate(i) = factor * points%by_rate(i)
      end do
    end if

  end subroutine flow_stress_evaluate_points

  !> \(\sigma_0\) and \(\partial\sigma_0 / \partial\bar\varepsilon\).
  pure subroutine flow_stress_evaluate(self, equivalent_strain, temperature, stress, slope, rate, &
                                       by_rate)
    class(flow_stress_t), intent(in) :: self
    !> Equivalent plastic strain [1], at least 0.
    real(wp), intent(in) :: equivalent_strain
    !> Kelvin [temperature].
    real(wp), intent(in) :: temperature
    !> [stress].
    real(wp), intent(out) :: stress
    !> Its derivative by the strain [stress].
    real(wp), intent(out) :: slope
    !> Rate of the strain [1/time]; 0 when absent.
    real(wp), intent(in), optional :: rate
    !> Derivative by the rate [stress*time].
    real(wp), intent(out), optional :: by_rate

    type(flow_batch_t) :: points

    points%n_point = 1
    points%strain(1) = equivalent_strain
    points%temperature(1) = temperature
    if (present(rate)) points%rate(1) = rate
    call self%evaluate_points(points)
    stress = points%stress(1)
    slope = points%by_strain(1)
    if (present(by_rate)) by_rate = points%by_rate(1)

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
