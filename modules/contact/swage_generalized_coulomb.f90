!> Generalized Coulomb friction: τ = -µ(p) |v|^(p_f - 1) v, with the stress µ(p) any function of the
!> contact pressure and p_f the exponent of the slip rate.
!>
!> Source: J.-L. Chenot et al., Procedia Engineering 81 (2014) 2427, eq. 7; µ(p) is the friction
!> stress at the slip rate `reference_velocity`.
module swage_generalized_coulomb
  use swage_friction, only: friction_law_t, friction_point_t, shear_limit
  use swage_friction_keys, only: take_method, take_tresca_limit
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_sliding_friction, only: sliding_law_t
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: generalized_coulomb_from_group

  !> µ(p) is linear between the points of a table and constant after the last.
  type, extends(sliding_law_t) :: generalized_coulomb_t
    private
    !> Pressures, ascending from 0, and friction stresses there [stress].
    real(wp), allocatable :: pressure(:), friction_stress(:)
    !> Slope between a pressure and the next, 0 after the last [1].
    real(wp), allocatable :: slope(:)
    !> False when nothing but the table limits the friction stress.
    logical :: is_capped = .false.
    !> m [1].
    real(wp) :: tresca_factor = 1.0_wp
    !> σ₀ [stress]; 0: that of the material.
    real(wp) :: flow_stress = 0.0_wp
  contains
    procedure, public :: limit => generalized_coulomb_limit
  end type generalized_coulomb_t

contains

  !> Make the law from its keys in a group `&friction`; faults of the keys stay in `group`.
  subroutine generalized_coulomb_from_group(group, law)
    type(group_t), intent(inout) :: group
    class(friction_law_t), allocatable, intent(out) :: law

    character(len=:), allocatable :: method
    real(wp) :: coefficient, velocity
    real(wp), allocatable :: friction_stress(:), pressure(:)
    type(generalized_coulomb_t) :: made

    coefficient = 0.0_wp
    call group%take('coefficient', coefficient, '1', 'Friction stress over contact pressure at '// &
                    'the reference velocity, in place of a table.', lower=0.0_wp)
    call group%take_list('pressure', pressure, 'stress', 'Contact pressures of a table, '// &
                         'ascending; (0, 0) comes before the first.', above=0.0_wp)
    call group%take_list('friction_stress', friction_stress, 'stress', &
                         'Friction stress at each pressure and the reference velocity, linear '// &
                         'between them, constant after the last.', lower=0.0_wp)
    call group%take('rate_exponent', made%rate_exponent, '1', &
                    'Exponent of the slip rate: 0 for dry friction.', lower=0.0_wp, upper=1.0_wp)
    call group%take('reference_velocity', made%reference_velocity, 'length/time', 'Slip rate '// &
                    'that the friction stress belongs to.', above=0.0_wp)
    call take_tresca_limit(group, made%tresca_factor, made%flow_stress, required=.false.)
    made%is_capped = group%given('tresca_factor') .or. group%given('flow_stress')
    call take_method(group, method, velocity)
    if (group%explaining .or. group%status%failed()) return
    call check_function(group, pressure, friction_stress)
    if (made%rate_exponent > 0.0_wp .and. .not. group%given('reference_velocity')) then
      call group%refuse('rate_exponent', 'needs the reference_velocity of the friction stress')
    end if
    if (group%status%failed()) return

    made%name = 'generalized_coulomb'
    made%uses_flow_stress = made%is_capped .and. .not. made%flow_stress > 0.0_wp
    call set_function(made, coefficient, pressure, friction_stress)
    call made%set_method(method, velocity)
    allocate (law, source=made)

  end subroutine generalized_coulomb_from_group

  !> Either a coefficient or a table; faults stay in `group`.
  subroutine check_function(group, pressure, friction_stress)
    type(group_t), intent(inout) :: group
    real(wp), intent(in) :: pressure(:)
    real(wp), intent(in) :: friction_stress(:)

    integer :: i

    if (group%given('coefficient') .eqv. group%given('pressure')) then
      call group%refuse('coefficient', 'is needed, or a table of pressure and friction_stress, '// &
                        'but not both')
    end if
    if (size(pressure) /= size(friction_stress)) then
      call group%refuse('friction_stress', 'must have one value for each of pressure: '// &
                        text(size(friction_stress))//' for '//text(size(pressure)))
    end if
    do i = 2, size(pressure)
      if (pressure(i) > pressure(i - 1)) cycle
      call group%refuse('pressure', 'must increase strictly, but '//text(pressure(i))// &
                        ' follows '//text(pressure(i - 1)))
      exit
    end do

  end subroutine check_function

  pure subroutine set_function(law, coefficient, pressure, friction_stress)
    type(generalized_coulomb_t), intent(inout) :: law
    !> Counts when there is no table.
    real(wp), intent(in) :: coefficient
    real(wp), intent(in) :: pressure(:)
    real(wp), intent(in) :: friction_stress(:)

    integer :: n

    n = size(pressure)
    allocate (law%pressure(0:n), law%friction_stress(0:n), law%slope(0:n), source=0.0_wp)
    law%pressure(1:) = pressure
    law%friction_stress(1:) = friction_stress
    law%slope(:n - 1) = (law%friction_stress(1:) - law%friction_stress(:n - 1)) &
      / (law%pressure(1:) - law%pressure(:n - 1))
    if (n == 0) law%slope(0) = coefficient

  end subroutine set_function

  !> See [[sliding_law_t:limit]].
  pure subroutine generalized_coulomb_limit(self, point, limit, d_limit)
    class(generalized_coulomb_t), intent(in) :: self
    type(friction_point_t), intent(in) :: point
    real(wp), intent(out) :: limit
    real(wp), intent(out) :: d_limit

    real(wp) :: cap
    integer :: i

    limit = 0.0_wp
    d_limit = 0.0_wp
    if (.not. point%pressure > 0.0_wp) return
    i = count(self%pressure(1:) <= point%pressure)
    limit = self%friction_stress(i) + self%slope(i) * (point%pressure - self%pressure(i))
    d_limit = self%slope(i)
    if (.not. self%is_capped) return
    cap = shear_limit(self%tresca_factor, &
                      merge(point%flow_stress, self%flow_stress, self%uses_flow_stress))
    if (limit < cap) return
    limit = cap
    d_limit = 0.0_wp

  end subroutine generalized_coulomb_limit

end module swage_generalized_coulomb
