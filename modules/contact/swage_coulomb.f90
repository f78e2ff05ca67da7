!> Coulomb friction: the limit is µ p.
module swage_coulomb
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_friction_keys, only: take_coefficient, take_method
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_sliding_friction, only: sliding_law_t
  implicit none(type, external)
  private

  public :: coulomb_from_group

  type, extends(sliding_law_t) :: coulomb_t
    private
    !> µ [1].
    real(wp) :: coefficient = 0.0_wp
  contains
    procedure, public :: limit => coulomb_limit
  end type coulomb_t

contains

  !> Make the law from its keys in a group `&friction`; faults of the keys stay in `group`.
  subroutine coulomb_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    character(len=:), allocatable :: method
    real(wp) :: velocity
    type(coulomb_t) :: made

    call take_coefficient(group, made%coefficient)
    call take_method(group, method, velocity)
    if (group%explaining .or. group%status%failed()) return
    made%name = 'coulomb'
    call made%set_method(method, velocity)
    allocate (law, source=made)

  end subroutine coulomb_from_group

  !> See [[sliding_law_t:limit]].
  pure subroutine coulomb_limit(self, point, limit, d_limit)
    class(coulomb_t), intent(in) :: self
    type(friction_point_t), intent(in) :: point
    real(wp), intent(out) :: limit
    real(wp), intent(out) :: d_limit

    limit = self%coefficient * max(point%pressure, 0.0_wp)
    d_limit = merge(self%coefficient, 0.0_wp, point%pressure > 0.0_wp)

  end subroutine coulomb_limit

end module swage_coulomb
