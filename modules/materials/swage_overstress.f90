!> The rate-dependent part of an elastic-viscoplastic law: what the equivalent stress has above the
!> threshold while the material flows.
module swage_overstress
  use swage_kinds, only: wp
  use swage_point_batch, only: LANES
  implicit none(type, external)
  private

  public :: overstress_t, overstress_batch_t

  !> Points where an overstress is asked for, all at once.
  type :: overstress_batch_t
    !> Points in use.
    integer :: n_point = 0
    !> Time increment [time], positive.
    real(wp) :: dt = 1.0_wp
    !> \(x\), increment of the equivalent plastic strain [1], at least 0.
    real(wp) :: increment(LANES) = 0.0_wp
    !> \(q\), equivalent stress [stress], positive.
    real(wp) :: stress(LANES) = 1.0_wp
    !> Kelvin [temperature].
    real(wp) :: temperature(LANES) = 0.0_wp
    !> \(\Phi\), set by the law [stress].
    real(wp) :: overstress(LANES) = 0.0_wp
    !> \(\Phi_x\), set by the law [stress].
    real(wp) :: by_increment(LANES) = 0.0_wp
    !> \(\Phi_q\), set by the law [1].
    real(wp) :: by_stress(LANES) = 0.0_wp
  end type overstress_batch_t

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
    pure subroutine evaluate_overstress(self, points)
      import :: overstress_batch_t, overstress_t
      implicit none(type, external)
      class(overstress_t), intent(in) :: self
      type(overstress_batch_t), intent(inout) :: points
    end subroutine evaluate_overstress

  end interface

end module swage_overstress
