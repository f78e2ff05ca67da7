!> Keys of `&friction` that several laws share; each is named here and nowhere else.
module swage_friction_keys
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_sliding_friction, only: METHOD_NAMES, REGULARISED
  implicit none(type, external)
  private

  public :: take_coefficient, take_method, take_tresca_limit

contains

  subroutine take_coefficient(group, coefficient)
    type(group_t), intent(inout) :: group
    !> µ [1].
    real(wp), intent(out) :: coefficient

    coefficient = 0.0_wp
    call group%take('coefficient', coefficient, '1', &
                    'Coulomb coefficient: friction stress over contact pressure.', lower=0.0_wp, &
                    required=.true.)

  end subroutine take_coefficient

  subroutine take_tresca_limit(group, factor, flow_stress, required)
    type(group_t), intent(inout) :: group
    !> m [1]; 1 when it may be absent and is.
    real(wp), intent(out) :: factor
    !> σ₀ [stress]; 0: that of the material.
    real(wp), intent(out) :: flow_stress
    !> True when the factor must be given.
    logical, intent(in) :: required

    factor = 1.0_wp
    flow_stress = 0.0_wp
    call group%take('tresca_factor', factor, '1', &
                    'Largest friction stress over the shear flow stress, flow_stress/sqrt(3).', &
                    lower=0.0_wp, upper=1.0_wp, required=required)
    call group%take('flow_stress', flow_stress, 'stress', &
                    'Uniaxial flow stress of the limit; 0: that of the material at each point.', &
                    lower=0.0_wp)

  end subroutine take_tresca_limit

  !> How friction is made a function of the slip.
  subroutine take_method(group, method, velocity)
    type(group_t), intent(inout) :: group
    !> One of `METHOD_NAMES`.
    character(len=:), allocatable, intent(out) :: method
    !> Slip rate of the regularisation [length/time]; 0: not given.
    real(wp), intent(out) :: velocity

    allocate (method, source=trim(METHOD_NAMES(REGULARISED)))
    velocity = 0.0_wp
    call group%take('method', method, 'Friction that fades at small slip rates and creeps, or '// &
                    'an elastic bond that breaks at the limit and remembers.', &
                    choices=METHOD_NAMES)
    call group%take('regularisation_velocity', velocity, 'length/time', &
                    'Slip rate below which regularised friction fades; 0: one per cent of the '// &
                    'speed of the fastest tool.', lower=0.0_wp)
    if (group%explaining .or. group%status%failed()) return
    if (method /= METHOD_NAMES(REGULARISED) .and. group%given('regularisation_velocity')) then
      call group%refuse('regularisation_velocity', 'has no effect with method = '''//method//'''')
    end if

  end subroutine take_method

end module swage_friction_keys
