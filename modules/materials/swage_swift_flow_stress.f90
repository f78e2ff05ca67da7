!> Swift's power hardening, \(h = K (\bar\varepsilon_0 + \bar\varepsilon)^n\).
!>
!> Source: H. W. Swift, Plastic instability under plane stress, J. Mech. Phys. Solids 1 (1952)
!> 1–18.
module swage_swift_flow_stress
  use swage_flow_stress, only: flow_batch_t, flow_stress_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_sources, only: material_sources_t
  implicit none(type, external)
  private

  public :: swift_flow_stress_t, swift_flow_stress_from_group

  type, extends(flow_stress_t) :: swift_flow_stress_t
    !> \(K\) [stress].
    real(wp) :: strength = 0.0_wp
    !> \(\bar\varepsilon_0\) [1]; positive, for the slope at the start to be finite.
    real(wp) :: prestrain = 0.0_wp
    !> \(n\) [1].
    real(wp) :: exponent = 0.0_wp
  contains
    procedure :: evaluate_hardening => swift_evaluate_hardening
  end type swift_flow_stress_t

contains

  !> Make the law from its keys in a group `&flow_stress`; faults stay in `group`.
  subroutine swift_flow_stress_from_group(group, sources, flow_stress)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(flow_stress_t), allocatable, intent(out) :: flow_stress

    type(swift_flow_stress_t) :: made

    call group%take('strength', made%strength, 'stress', &
                    'K of K (e0 + e)^n.', above=0.0_wp, required=.true.)
    call group%take('prestrain', made%prestrain, '1', &
                    'e0 of K (e0 + e)^n.', above=0.0_wp, required=.true.)
    call group%take('exponent', made%exponent, '1', &
                    'n of K (e0 + e)^n.', lower=0.0_wp, upper=1.0_wp, required=.true.)
    call sources%check_stress(group, 'strength', made%strength, 1.0e4_wp)
    call made%take_softening(group)
    allocate (flow_stress, source=made)

  end subroutine swift_flow_stress_from_group

  pure subroutine swift_evaluate_hardening(self, points)
    class(swift_flow_stress_t), intent(in) :: self
    type(flow_batch_t), intent(inout) :: points

    real(wp) :: strain
    integer :: i

    do i = 1, points%n_point
      strain = self%prestrain + points%strain(i)
      points%stress(i) = self%strength * strain**self%exponent
      points%by_strain(i) = self%exponent * points%stress(i) / strain
    end do

  end subroutine swift_evaluate_hardening

end module swage_swift_flow_stress
