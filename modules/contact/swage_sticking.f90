!> Sticking: once in contact, a point follows the tool as if welded on in the tangent plane.
module swage_sticking
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_rotation, only: IDENTITY
  implicit none(type, external)
  private

  public :: sticking_t, sticking_create, sticking_from_group

  !> An elastic bond with history, so that it neither creeps nor drifts under a constant load. It
  !> stores energy and dissipates none; it lasts as long as the contact does.
  type, extends(friction_law_t) :: sticking_t
  contains
    procedure :: traction => sticking_traction
  end type sticking_t

contains

  pure subroutine sticking_create(law)
    type(sticking_t), intent(out) :: law

    law%name = 'sticking'
    law%has_history = .true.

  end subroutine sticking_create

  !> It has no keys: its stiffness is that of the contact.
  subroutine sticking_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    type(sticking_t) :: made

    if (group%explaining) return
    call sticking_create(made)
    allocate (law, source=made)

  end subroutine sticking_from_group

  !> See [[friction_law_t:traction]].
  pure subroutine sticking_traction(self, point)
    class(sticking_t), intent(in) :: self
    type(friction_point_t), intent(inout) :: point

    point%traction = point%traction_old - point%tangential_stiffness * point%slip
    point%d_slip = -point%tangential_stiffness * IDENTITY
    point%secant = point%tangential_stiffness
    point%d_traction_old = IDENTITY
    point%d_pressure = 0.0_wp
    point%dissipation = 0.0_wp
    point%sticking = self%has_history

  end subroutine sticking_traction

end module swage_sticking
