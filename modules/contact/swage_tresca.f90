!> Tresca friction, regularised in the slip rate: τ_max = m σ₀/√3 whatever the pressure.
module swage_tresca
  use swage_friction, only: friction_law_t, friction_point_t, set_regularised, shear_limit
  use swage_friction_keys, only: take_regularisation_velocity, take_tresca_limit
  use swage_group, only: group_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: tresca_t, tresca_create, tresca_from_group

  type, extends(friction_law_t) :: tresca_t
    private
    !> m [1].
    real(wp) :: tresca_factor = 0.0_wp
    !> σ₀ [stress]; 0: that of the material.
    real(wp) :: flow_stress = 0.0_wp
  contains
    procedure, public :: traction => tresca_traction
  end type tresca_t

contains

  pure subroutine tresca_create(tresca_factor, flow_stress, regularisation_velocity, law)
    !> m [1], 0 to 1.
    real(wp), intent(in) :: tresca_factor
    !> σ₀ [stress], at least 0; 0: that of the material at each point.
    real(wp), intent(in) :: flow_stress
    !> [length/time], at least 0; see [[friction_law_t]].
    real(wp), intent(in) :: regularisation_velocity
    type(tresca_t), intent(out) :: law

    law%name = 'tresca'
    law%is_regularised = .true.
    law%uses_flow_stress = .not. flow_stress > 0.0_wp
    law%tresca_factor = tresca_factor
    law%flow_stress = flow_stress
    law%regularisation_velocity = regularisation_velocity

  end subroutine tresca_create

  !> Make the law from its keys in a group `&friction`; faults of the keys stay in `group`.
  subroutine tresca_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    real(wp) :: factor, flow_stress, velocity
    type(tresca_t) :: made

    call take_tresca_limit(group, factor, flow_stress, required=.true.)
    call take_regularisation_velocity(group, velocity)
    if (group%explaining .or. group%status%failed()) return
    call tresca_create(factor, flow_stress, velocity, made)
    allocate (law, source=made)

  end subroutine tresca_from_group

  !> See [[friction_law_t:traction]].
  pure subroutine tresca_traction(self, point)
    class(tresca_t), intent(in) :: self
    type(friction_point_t), intent(inout) :: point

    if (self%uses_flow_stress) then
      call set_regularised(shear_limit(self%tresca_factor, point%flow_stress), 0.0_wp, point)
    else
      call set_regularised(shear_limit(self%tresca_factor, self%flow_stress), 0.0_wp, point)
    end if

  end subroutine tresca_traction

end module swage_tresca
