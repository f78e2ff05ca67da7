!> What the rate-dependent laws share: consistency, rate sensitivity and their keys, and the power
!> of a rate made regular at rest.
module swage_viscosity
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_sources, only: material_sources_t
  use swage_units, only: ROOM_TEMPERATURE
  implicit none(type, external)
  private

  public :: viscosity_t, evaluate_rate_power

  !> Parameters; the convention for \(K\) is the law's own.
  type :: viscosity_t
    !> \(K_0\) [stress*time^m].
    real(wp) :: consistency = 0.0_wp
    !> \(m\) [1].
    real(wp) :: rate_sensitivity = 0.0_wp
    !> \(\beta\) [1/temperature_change].
    real(wp) :: thermal_softening = 0.0_wp
    !> \(T_0\) [temperature], kelvin.
    real(wp) :: reference_temperature = ROOM_TEMPERATURE
    !> \(\dot\varepsilon_0\), below which the law is made regular [1/time].
    real(wp) :: minimum_rate = 1.0e-8_wp
    !> Rate at which scales of stress are estimated before anything moves [1/time].
    real(wp) :: reference_rate = 1.0_wp
  contains
    !> Name, read and check the keys.
    procedure :: take => viscosity_take
    !> \(K(T) = K_0\, e^{-\beta (T - T_0)}\).
    procedure :: get_consistency => viscosity_get_consistency
  end type viscosity_t

contains

  subroutine viscosity_take(self, group, sources, convention)
    class(viscosity_t), intent(inout) :: self
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    !> What \(K\) means in the law, for the reader of the keys.
    character(len=*), intent(in) :: convention

    call group%take('consistency', self%consistency, 'stress*time^m', convention, above=0.0_wp, &
                    required=.true.)
    call group%take('rate_sensitivity', self%rate_sensitivity, '1', &
                    'Exponent m of the strain rate.', above=0.0_wp, upper=1.0_wp, required=.true.)
    call group%take('thermal_softening', self%thermal_softening, '1/temperature_change', &
                    'Softening b: the consistency is multiplied by exp(-b (T - T0)).', &
                    lower=0.0_wp)
    call group%take('reference_temperature', self%reference_temperature, 'temperature', &
                    'Temperature T0 at which the softening factor is 1.', above=0.0_wp)
    call group%take('minimum_rate', self%minimum_rate, '1/time', &
                    'Equivalent strain rate below which the material is a linear viscous one.', &
                    above=0.0_wp)
    call group%take('reference_rate', self%reference_rate, '1/time', &
                    'Typical equivalent strain rate, for the scale of penalties only.', &
                    above=0.0_wp)
    call sources%check_stress(group, 'consistency', self%consistency, 1.0e3_wp)

  end subroutine viscosity_take

  elemental function viscosity_get_consistency(self, temperature) result(consistency)
    class(viscosity_t), intent(in) :: self
    !> Kelvin [temperature].
    real(wp), intent(in) :: temperature
    real(wp) :: consistency

    consistency = self%consistency
    if (abs(self%thermal_softening) > 0.0_wp) then
      consistency = consistency &
        * exp(-self%thermal_softening * (temperature - self%reference_temperature))
    end if

  end function viscosity_get_consistency

  !> \(\dot\varepsilon^p\), exact from \(\dot\varepsilon_0\) on; below, a cubic through the origin
  !> that joins it with two continuous derivatives.
  !>
  !> With \(r = \dot\varepsilon / \dot\varepsilon_0 < 1\) it is
  !> \(\dot\varepsilon_0^p (a r + b r^2 + c r^3)\), rising and concave for \(0 < p \le 1\). The
  !> usual \((\dot\varepsilon^2 + \dot\varepsilon_0^2)^{p/2} - \dot\varepsilon_0^p\) takes
  !> \(\dot\varepsilon_0^p\) off the stress at every rate: 6 % of \(K\) at
  !> \(\dot\varepsilon_0 = 10^{-6}\), \(p = 0.2\). Here nothing is lost, and the slope at rest is
  !> finite just the same.
  elemental subroutine evaluate_rate_power(rate, minimum_rate, exponent, value, slope)
    !> \(\dot\varepsilon\), at least 0 [1/time].
    real(wp), intent(in) :: rate
    !> \(\dot\varepsilon_0\), positive [1/time].
    real(wp), intent(in) :: minimum_rate
    !> \(p\), above 0, at most 1 [1].
    real(wp), intent(in) :: exponent
    !> [1/time^p].
    real(wp), intent(out) :: value
    !> Its derivative by the rate.
    real(wp), intent(out) :: slope

    real(wp) :: a, b, c, r, scale

    if (rate >= minimum_rate) then
      value = rate**exponent
      slope = exponent * value / rate
    else
      r = rate / minimum_rate
      scale = minimum_rate**exponent
      c = 0.5_wp * (1.0_wp - exponent) * (2.0_wp - exponent)
      b = (exponent - 1.0_wp) * (3.0_wp - exponent)
      a = 1.0_wp - b - c
      value = scale * r * (a + r * (b + r * c))
      slope = scale / minimum_rate * (a + r * (2.0_wp * b + r * 3.0_wp * c))
    end if

  end subroutine evaluate_rate_power

end module swage_viscosity
