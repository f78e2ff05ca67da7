!> The rate-dependent part of an elastic-viscoplastic law: what the equivalent stress has above the
!> threshold while the material flows.
module swage_overstress
  use swage_kinds, only: wp
  implicit none(type, external)
  private

  public :: overstress_t, flow_state_t

  !> Where an overstress is asked for.
  type :: flow_state_t
    !> \(x\), increment of the equivalent plastic strain [1], positive.
    real(wp) :: increment = 0.0_wp
    !> \(q\), equivalent stress [stress], positive.
    real(wp) :: stress = 0.0_wp
    !> Time increment [time], positive.
    real(wp) :: dt = 1.0_wp
    !> Kelvin [temperature].
    real(wp) :: temperature = 0.0_wp
  end type flow_state_t

  !> An overstress with its parameters; immutable once created.
  type, abstract :: overstress_t
    !> Rate at which it turns from a line into a power [1/time], positive: the search for the
    !> increment starts there.
    real(wp) :: starting_rate = 0.0_wp
  contains
    !> The overstress and its derivatives.
    procedure(evaluate_overstress), deferred :: evaluate
  end type overstress_t

  abstract interface

    !> \(\Phi(x, q)\): 0 at \(x = 0\), not falling with \(x\), not rising with \(q\).
    pure subroutine evaluate_overstress(self, state, overstress, by_increment, by_stress)
      import :: flow_state_t, overstress_t, wp
      implicit none(type, external)
      class(overstress_t), intent(in) :: self
      type(flow_state_t), intent(in) :: state
      !> \(\Phi\) [stress].
      real(wp), intent(out) :: overstress
      !> \(\Phi_x\) [stress].
      real(wp), intent(out) :: by_increment
      !> \(\Phi_q\) [1].
      real(wp), intent(out) :: by_stress
    end subroutine evaluate_overstress

  end interface

end module swage_overstress
