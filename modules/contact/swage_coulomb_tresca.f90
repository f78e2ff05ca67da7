!> Coulomb friction limited by Tresca, regularised in the slip rate.
!>
!> τ_max = min(µ p, m σ₀/√3).
module swage_coulomb_tresca
  use swage_friction, only: friction_law_t, friction_point_t, set_regularised, shear_limit
  use swage_friction_keys, only: take_coefficient, take_regularisation_velocity, &
    take_tresca_limit
  use swage_group, only: group_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: coulomb_tresca_t, coulomb_tresca_create, coulomb_tresca_from_group

  type, extends(friction_law_t) :: coulomb_tresca_t
    private
    !> µ [1].
    real(wp) :: coefficient = 0.0_wp
    !> m [1].
    real(wp) :: tresca_factor = 1.0_wp
    !> σ₀ [stress]; 0: that of the material.
    real(wp) :: flow_stress = 0.0_wp
  contains
    procedure, public :: traction => coulomb_tresca_traction
  end type coulomb_tresca_t

contains

  pure subroutine coulomb_tresca_create(coefficient, tresca_factor, flow_stress, &
                                        regularisation_velocity, law)
    !> µ [1], at least 0.
    real(wp), intent(in) :: coefficient
    !> m [1], 0 to 1.
    real(wp), intent(in) :: tresca_factor
    !> σ₀ [stress], at least 0; 0: that of the material at each point.
    real(wp), intent(in) :: flow_stress
    !> [length/time], at least 0; see [[friction_law_t]].
    real(wp), intent(in) :: regularisation_velocity
    type(coulomb_tresca_t), intent(out) :: law

    law%name = 'coulomb_tresca'
    law%is_regularised = .true.
    law%uses_flow_stress = .not. flow_stress > 0.0_wp
    law%coefficient = coefficient
    law%tresca_factor = tresca_factor
    law%flow_stress = flow_stress
    law%regularisation_velocity = regularisation_velocity

  end subroutine coulomb_tresca_create

  !> Make the law from its keys in a group `&friction`; faults of the keys stay in `group`.
  subroutine coulomb_tresca_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    real(wp) :: coefficient, factor, flow_stress, velocity
    type(coulomb_tresca_t) :: made

    call take_coefficient(group, coefficient)
    call take_tresca_limit(group, factor, flow_stress, required=.false.)
    call take_regularisation_velocity(group, velocity)
    if (group%explaining .or. group%status%failed()) return
    call coulomb_tresca_create(coefficient, factor, flow_stress, velocity, made)
    allocate (law, source=made)

  end subroutine coulomb_tresca_from_group

  !> See [[friction_law_t:traction]].
  pure subroutine coulomb_tresca_traction(self, point)
    class(coulomb_tresca_t), intent(in) :: self
    type(friction_point_t), intent(inout) :: point

    real(wp) :: cap, coulomb, flow_stress

    flow_stress = self%flow_stress
    if (self%uses_flow_stress) flow_stress = point%flow_stress
    cap = shear_limit(self%tresca_factor, flow_stress)
    coulomb = self%coefficient * max(point%pressure, 0.0_wp)
    if (coulomb < cap .and. point%pressure > 0.0_wp) then
      call set_regularised(coulomb, self%coefficient, point)
    else
      call set_regularised(min(coulomb, cap), 0.0_wp, point)
    end if

  end subroutine coulomb_tresca_traction

end module swage_coulomb_tresca
