!> Linear hardening, \(h = \sigma_y + H \bar\varepsilon\); perfect plasticity when \(H = 0\).
module swage_linear_flow_stress
  use swage_flow_stress, only: flow_batch_t, flow_stress_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_sources, only: material_sources_t
  implicit none(type, external)
  private

  public :: linear_flow_stress_t, linear_flow_stress_from_group

  type, extends(flow_stress_t) :: linear_flow_stress_t
    !> \(\sigma_y\) [stress].
    real(wp) :: yield_stress = 0.0_wp
    !> \(H\) [stress].
    real(wp) :: hardening_modulus = 0.0_wp
  contains
    procedure :: evaluate_hardening => linear_evaluate_hardening
  end type linear_flow_stress_t

contains

  !> Make the law from its keys in a group `&flow_stress`; faults stay in `group`.
  subroutine linear_flow_stress_from_group(group, sources, flow_stress)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(flow_stress_t), allocatable, intent(out) :: flow_stress

    type(linear_flow_stress_t) :: made

    call group%take('yield_stress', made%yield_stress, 'stress', &
                    'Flow stress of the virgin material.', lower=0.0_wp, required=.true.)
    call group%take('hardening_modulus', made%hardening_modulus, 'stress', &
                    'Rise of the flow stress per unit of equivalent plastic strain.', lower=0.0_wp)
    call sources%check_stress(group, 'yield_stress', made%yield_stress, 1.0e4_wp)
    call made%take_softening(group)
    allocate (flow_stress, source=made)

  end subroutine linear_flow_stress_from_group

  pure subroutine linear_evaluate_hardening(self, points)
    class(linear_flow_stress_t), intent(in) :: self
    type(flow_batch_t), intent(inout) :: points

    integer :: i

    do i = 1, points%n_point
      points%stress(i) = self%yield_stress + self%hardening_modulus * points%strain(i)
      points%by_strain(i) = self%hardening_modulus
    end do

  end subroutine linear_evaluate_hardening

end module swage_linear_flow_stress
