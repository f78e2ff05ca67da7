!> Coulomb friction limited by Tresca: the limit is min(µ p, m σ₀/√3).
module swage_coulomb_tresca
  use swage_friction, only: friction_law_t, friction_point_t, shear_limit
  use swage_friction_keys, only: take_coefficient, take_method, take_tresca_limit
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_sliding_friction, only: sliding_law_t
  implicit none(type, external)
  private

  public :: coulomb_tresca_from_group

  type, extends(sliding_law_t) :: coulomb_tresca_t
    private
    !> µ [1].
    real(wp) :: coefficient = 0.0_wp
    !> m [1].
    real(wp) :: tresca_factor = 1.0_wp
    !> σ₀ [stress]; 0: that of the material.
    real(wp) :: flow_stress = 0.0_wp
  contains
    procedure, public :: limit => coulomb_tresca_limit
  end type coulomb_tresca_t

contains

  !> Make the law from its keys in a group `&friction`; faults of the keys stay in `group`.
  subroutine coulomb_tresca_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    character(len=:), allocatable :: method
    real(wp) :: velocity
    type(coulomb_tresca_t) :: made

    call take_coefficient(group, made%coefficient)
    call take_tresca_limit(group, made%tresca_factor, made%flow_stress, required=.false.)
    call take_method(group, method, velocity)
    if (group%explaining .or. group%status%failed()) return
    made%name = 'coulomb_tresca'
    made%uses_flow_stress = .not. made%flow_stress > 0.0_wp
    call made%set_method(method, velocity)
    allocate (law, source=made)

  end subroutine coulomb_tresca_from_group

  !> See [[sliding_law_t:limit]].
  pure subroutine coulomb_tresca_limit(self, point, limit, d_limit)
    class(coulomb_tresca_t), intent(in) :: self
    type(friction_point_t), intent(in) :: point
    real(wp), intent(out) :: limit
    real(wp), intent(out) :: d_limit

    real(wp) :: cap

    cap = shear_limit(self%tresca_factor, &
                      merge(point%flow_stress, self%flow_stress, self%uses_flow_stress))
    limit = self%coefficient * max(point%pressure, 0.0_wp)
    d_limit = merge(self%coefficient, 0.0_wp, limit < cap .and. point%pressure > 0.0_wp)
    limit = min(limit, cap)

  end subroutine coulomb_tresca_limit

end module swage_coulomb_tresca
