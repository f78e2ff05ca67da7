!> Norton friction, a lubricating film: τ = -α K |v|^(q-1) v whatever the pressure.
module swage_norton_friction
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_friction_keys, only: take_method
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_sliding_friction, only: sliding_law_t
  implicit none(type, external)
  private

  public :: norton_friction_from_group

  type, extends(sliding_law_t) :: norton_friction_t
    private
    !> α K, the friction stress at the slip rate 1 [stress*time^q/length^q].
    real(wp) :: consistency = 0.0_wp
  contains
    procedure, public :: limit => norton_friction_limit
  end type norton_friction_t

contains

  !> Make the law from its keys in a group `&friction`; faults of the keys stay in `group`.
  subroutine norton_friction_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    character(len=:), allocatable :: method
    real(wp) :: factor, velocity
    type(norton_friction_t) :: made

    factor = 1.0_wp
    call group%take('factor', factor, '1', &
                    'Alpha: share of the consistency that the film transmits.', lower=0.0_wp)
    call group%take('consistency', made%consistency, 'stress*time^q/length^q', &
                    'K: friction stress at the slip rate 1 for alpha = 1.', above=0.0_wp, &
                    required=.true.)
    call group%take('rate_exponent', made%rate_exponent, '1', &
                    'Exponent q of the slip rate: 1 for a Newtonian film.', above=0.0_wp, &
                    upper=1.0_wp, required=.true.)
    call take_method(group, method, velocity)
    if (group%explaining .or. group%status%failed()) return
    made%name = 'norton'
    made%consistency = factor * made%consistency
    call made%set_method(method, velocity)
    allocate (law, source=made)

  end subroutine norton_friction_from_group

  !> See [[sliding_law_t:limit]]. The reference velocity is 1.
  pure subroutine norton_friction_limit(self, point, limit, d_limit)
    class(norton_friction_t), intent(in) :: self
    !> Does not count.
    type(friction_point_t), intent(in) :: point
    real(wp), intent(out) :: limit
    real(wp), intent(out) :: d_limit

    limit = self%consistency
    d_limit = 0.0_wp * point%pressure

  end subroutine norton_friction_limit

end module swage_norton_friction
