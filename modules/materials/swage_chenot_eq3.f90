!> Elastic-viscoplastic law of the paper's equation 3,
!> \[ \dot\varepsilon^p = \frac1K \Bigl\langle \frac{\sigma_{eq} - R}{K} \Bigr\rangle^{1/m - 1}
!>    s. \]
!>
!> The factor is the deviator \(s\), not its direction, so for \(R > 0\) this is not Perzyna's law,
!> and for \(R = 0\) it gives \(\sigma_{eq} = K (\tfrac32 \dot{\bar\varepsilon})^m\), not
!> Norton–Hoff's. It is solved as an overstress, in the power that is flat for small \(m\):
!> \[ \Phi(x, q) = K \Bigl(\frac{3 K x}{2 q \Delta t}\Bigr)^{m / (1 - m)}. \]
!> \(m = 1\) is no limit of it: the flow would start with a jump. Below the minimum rate, and for
!> \(m \le \tfrac12\), where the power is steep at rest, it passes into a line in \(x\), see
!> [[evaluate_rate_power]].
!>
!> Source: J.-L. Chenot et al., Finite element multi-body coupling in metal forming, Procedia Eng.
!> 81 (2014) 2427–2432, eq. 3.
module swage_chenot_eq3
  use swage_elasticity, only: elasticity_t
  use swage_flow_stress, only: flow_stress_t
  use swage_flow_stress_registry, only: take_threshold
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_kinematic_hardening, only: kinematic_hardening_t
  use swage_material_law, only: material_law_t
  use swage_material_sources, only: material_sources_t
  use swage_overstress, only: overstress_batch_t, overstress_t
  use swage_radial_return, only: radial_return_create, radial_return_law_t
  use swage_status, only: status_t
  use swage_viscosity, only: evaluate_rate_power, viscosity_t
  implicit none(type, external)
  private

  public :: chenot_eq3_create, chenot_eq3_from_group

  !> Logarithm of an overstress over \(K\) beyond any stress: only its sign matters to the search.
  real(wp), parameter :: LARGEST_LOGARITHM = 200.0_wp

  type, extends(overstress_t) :: chenot_eq3_overstress_t
    private
    type(viscosity_t) :: viscosity
    !> \(m / (1 - m)\).
    real(wp) :: exponent = 0.0_wp
  contains
    procedure :: evaluate => chenot_eq3_evaluate
  end type chenot_eq3_overstress_t

contains

  !> Make the law from valid parameters, `rate_sensitivity` below 1.
  pure subroutine chenot_eq3_create(elasticity, threshold, viscosity, law, kinematic)
    type(elasticity_t), intent(in) :: elasticity
    class(flow_stress_t), intent(in) :: threshold
    type(viscosity_t), intent(in) :: viscosity
    type(radial_return_law_t), intent(out) :: law
    !> Absent in a law without kinematic hardening.
    type(kinematic_hardening_t), intent(in), optional :: kinematic

    type(chenot_eq3_overstress_t) :: overstress

    overstress%viscosity = viscosity
    overstress%exponent = viscosity%rate_sensitivity / (1.0_wp - viscosity%rate_sensitivity)
    overstress%starting_rate = viscosity%minimum_rate
    call radial_return_create('chenot_eq3', elasticity, threshold, law, overstress, kinematic)
    ! From above: the sum is exact for R = 0
    law%initial_flow_stress = law%initial_flow_stress + viscosity%consistency &
      * (1.5_wp * viscosity%reference_rate)**viscosity%rate_sensitivity

  end subroutine chenot_eq3_create

  !> Make the law from its keys in a group `&material`. Not made when a key is faulty.
  subroutine chenot_eq3_from_group(group, sources, law, status)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(material_law_t), allocatable, intent(out) :: law
    !> The first fault of the group or of its flow stress.
    type(status_t), intent(inout) :: status

    type(elasticity_t) :: elasticity
    type(kinematic_hardening_t) :: kinematic
    type(radial_return_law_t) :: made
    type(viscosity_t) :: viscosity
    class(flow_stress_t), allocatable :: threshold

    call elasticity%take(group, sources)
    call viscosity%take(group, sources, 'K of rate = (1/K) ((sigma - R) / K)^(1/m - 1) s.')
    if (.not. group%explaining .and. viscosity%rate_sensitivity >= 1.0_wp) then
      call group%refuse('rate_sensitivity', 'must be below 1 in chenot_eq3, whose flow would ' &
                        //'start with a jump; perzyna has the linear law')
    end if
    call kinematic%take(group, sources)
    call take_threshold(group, sources, threshold, status)
    call group%finish(status)
    if (group%explaining .or. status%failed()) return

    call chenot_eq3_create(elasticity, threshold, viscosity, made, kinematic)
    allocate (law, source=made)

  end subroutine chenot_eq3_from_group

  !> \(\Phi\) of the module's docstring.
  pure subroutine chenot_eq3_evaluate(self, points)
    class(chenot_eq3_overstress_t), intent(in) :: self
    type(overstress_batch_t), intent(inout) :: points

    real(wp) :: consistency, logarithm, power, rate, slope
    integer :: i

    do i = 1, points%n_point
      associate (overstress => points%overstress(i), by_increment => points%by_increment(i), &
                 by_stress => points%by_stress(i))
        overstress = 0.0_wp
        by_increment = 0.0_wp
        by_stress = 0.0_wp
        rate = points%increment(i) / points%dt
        if (rate <= 0.0_wp .and. self%exponent > 1.0_wp) cycle

        consistency = self%viscosity%get_consistency(points%temperature(i))
        if (self%exponent <= 1.0_wp .and. rate < self%viscosity%minimum_rate) then
          call evaluate_rate_power(rate, self%viscosity%minimum_rate, self%exponent, power, slope)
          overstress = consistency * (1.5_wp * consistency / points%stress(i))**self%exponent
          by_increment = overstress * slope / points%dt
          overstress = overstress * power
        else
          logarithm = self%exponent * log(1.5_wp * consistency * rate / points%stress(i))
          overstress = consistency * exp(min(logarithm, LARGEST_LOGARITHM))
          by_increment = self%exponent * overstress / points%increment(i)
        end if
        by_stress = -self%exponent * overstress / points%stress(i)
      end associate
    end do

  end subroutine chenot_eq3_evaluate

end module swage_chenot_eq3
