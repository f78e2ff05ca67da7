!> Contact without friction.
module swage_no_friction
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: no_friction_t, no_friction_create, no_friction_from_group

  type, extends(friction_law_t) :: no_friction_t
  contains
    procedure :: traction => no_friction_traction
  end type no_friction_t

contains

  pure subroutine no_friction_create(law)
    type(no_friction_t), intent(out) :: law

    law%name = 'none'

  end subroutine no_friction_create

  !> It has no keys.
  subroutine no_friction_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    type(no_friction_t) :: made

    if (group%explaining) return
    call no_friction_create(made)
    allocate (law, source=made)

  end subroutine no_friction_from_group

  !> See [[friction_law_t:traction]].
  pure subroutine no_friction_traction(self, point)
    class(no_friction_t), intent(in) :: self
    type(friction_point_t), intent(inout) :: point

    point%traction = 0.0_wp
    point%d_slip = 0.0_wp
    point%secant = 0.0_wp
    point%d_traction_old = 0.0_wp
    point%d_pressure = 0.0_wp
    point%dissipation = 0.0_wp
    point%sticking = self%has_history

  end subroutine no_friction_traction

end module swage_no_friction
