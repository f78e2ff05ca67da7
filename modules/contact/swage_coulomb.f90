!> Coulomb friction, regularised in the slip rate: τ_max = µ p.
module swage_coulomb
  use swage_friction, only: friction_law_t, friction_point_t, set_regularised
  use swage_friction_keys, only: take_coefficient, take_regularisation_velocity
  use swage_group, only: group_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: coulomb_t, coulomb_create, coulomb_from_group

  type, extends(friction_law_t) :: coulomb_t
    private
    !> µ [1].
    real(wp) :: coefficient = 0.0_wp
  contains
    procedure, public :: traction => coulomb_traction
  end type coulomb_t

contains

  pure subroutine coulomb_create(coefficient, regularisation_velocity, law)
    !> µ [1], at least 0.
    real(wp), intent(in) :: coefficient
    !> [length/time], at least 0; see [[friction_law_t]].
    real(wp), intent(in) :: regularisation_velocity
    type(coulomb_t), intent(out) :: law

    law%name = 'coulomb'
    law%is_regularised = .true.
    law%coefficient = coefficient
    law%regularisation_velocity = regularisation_velocity

  end subroutine coulomb_create

  !> Make the law from its keys in a group `&friction`; faults of the keys stay in `group`.
  subroutine coulomb_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    real(wp) :: coefficient, velocity
    type(coulomb_t) :: made

    call take_coefficient(group, coefficient)
    call take_regularisation_velocity(group, velocity)
    if (group%explaining .or. group%status%failed()) return
    call coulomb_create(coefficient, velocity, made)
    allocate (law, source=made)

  end subroutine coulomb_from_group

  !> See [[friction_law_t:traction]].
  pure subroutine coulomb_traction(self, point)
    class(coulomb_t), intent(in) :: self
    type(friction_point_t), intent(inout) :: point

    if (point%pressure > 0.0_wp) then
      call set_regularised(self%coefficient * point%pressure, self%coefficient, point)
    else
      call set_regularised(0.0_wp, 0.0_wp, point)
    end if

  end subroutine coulomb_traction

end module swage_coulomb
