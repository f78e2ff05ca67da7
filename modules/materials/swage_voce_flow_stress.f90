!> Voce's saturating hardening with a linear part,
!> \(h = \sigma_y + H \bar\varepsilon + Q\,(1 - e^{-b \bar\varepsilon})\).
!>
!> Source: E. Voce, The relationship between stress and strain for homogeneous deformation,
!> J. Inst. Metals 74 (1948) 537–562; with the linear part, J. C. Simo, Comput. Methods Appl. Mech.
!> Eng. 66 (1988) 199–219.
module swage_voce_flow_stress
  use swage_flow_stress, only: flow_batch_t, flow_stress_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_sources, only: material_sources_t
  implicit none(type, external)
  private

  public :: voce_flow_stress_t, voce_flow_stress_from_group

  type, extends(flow_stress_t) :: voce_flow_stress_t
    !> \(\sigma_y\) [stress].
    real(wp) :: yield_stress = 0.0_wp
    !> \(H\) [stress].
    real(wp) :: hardening_modulus = 0.0_wp
    !> \(Q\) [stress].
    real(wp) :: saturation_increment = 0.0_wp
    !> \(b\) [1].
    real(wp) :: saturation_exponent = 0.0_wp
  contains
    procedure :: evaluate_hardening => voce_evaluate_hardening
  end type voce_flow_stress_t

contains

  !> Make the law from its keys in a group `&flow_stress`; faults stay in `group`.
  subroutine voce_flow_stress_from_group(group, sources, flow_stress)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(flow_stress_t), allocatable, intent(out) :: flow_stress

    type(voce_flow_stress_t) :: made

    call group%take('yield_stress', made%yield_stress, 'stress', &
                    'Flow stress of the virgin material.', lower=0.0_wp, required=.true.)
    call group%take('saturation_increment', made%saturation_increment, 'stress', &
                    'Q of Q (1 - exp(-b e)), the rise at saturation.', lower=0.0_wp, &
                    required=.true.)
    call group%take('saturation_exponent', made%saturation_exponent, '1', &
                    'b of Q (1 - exp(-b e)), the speed of saturation.', above=0.0_wp, &
                    required=.true.)
    call group%take('hardening_modulus', made%hardening_modulus, 'stress', &
                    'Slope of the linear part that is added to the saturating one.', &
                    lower=0.0_wp)
    call sources%check_stress(group, 'yield_stress', made%yield_stress, 1.0e4_wp)
    call made%take_softening(group)
    allocate (flow_stress, source=made)

  end subroutine voce_flow_stress_from_group

  pure subroutine voce_evaluate_hardening(self, points)
    class(voce_flow_stress_t), intent(in) :: self
    type(flow_batch_t), intent(inout) :: points

    real(wp) :: decay
    integer :: i

    do i = 1, points%n_point
      decay = exp(-self%saturation_exponent * points%strain(i))
      points%stress(i) = self%yield_stress + self%hardening_modulus * points%strain(i) &
        + self%saturation_increment * (1.0_wp - decay)
      points%by_strain(i) = self%hardening_modulus &
        + self%saturation_increment * self%saturation_exponent * decay
    end do

  end subroutine voce_evaluate_hardening

end module swage_voce_flow_stress
