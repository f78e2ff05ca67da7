!> Elastic-viscoplastic law with a power overstress above a threshold,
!> \[ \sigma_{eq} = R(\bar\varepsilon, T) + K(T)\, \dot{\bar\varepsilon}^{\,m}. \]
!>
!> \(K\) is the uniaxial overstress at a rate of 1. Below the minimum rate the power passes into a
!> line, see [[evaluate_rate_power]].
!>
!> Source: P. Perzyna, Fundamental problems in viscoplasticity, Adv. Appl. Mech. 9 (1966) 243–377.
module swage_perzyna
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

  public :: perzyna_create, perzyna_from_group

  type, extends(overstress_t) :: perzyna_overstress_t
    private
    type(viscosity_t) :: viscosity
  contains
    procedure :: evaluate => perzyna_evaluate
  end type perzyna_overstress_t

contains

  !> Make the law from valid parameters.
  pure subroutine perzyna_create(elasticity, threshold, viscosity, law, kinematic)
    type(elasticity_t), intent(in) :: elasticity
    class(flow_stress_t), intent(in) :: threshold
    type(viscosity_t), intent(in) :: viscosity
    type(radial_return_law_t), intent(out) :: law
    !> Absent in a law without kinematic hardening.
    type(kinematic_hardening_t), intent(in), optional :: kinematic

    type(perzyna_overstress_t) :: overstress

    overstress%viscosity = viscosity
    overstress%starting_rate = viscosity%minimum_rate
    call radial_return_create('perzyna', elasticity, threshold, law, overstress, kinematic)
    law%initial_flow_stress = law%initial_flow_stress &
      + viscosity%consistency * viscosity%reference_rate**viscosity%rate_sensitivity

  end subroutine perzyna_create

  !> Make the law from its keys in a group `&material`. Not made when a key is faulty.
  subroutine perzyna_from_group(group, sources, law, status)
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
    call viscosity%take(group, sources, 'K of sigma = R + K rate^m, uniaxial.')
    call kinematic%take(group, sources)
    call take_threshold(group, sources, threshold, status)
    call group%finish(status)
    if (group%explaining .or. status%failed()) return

    call perzyna_create(elasticity, threshold, viscosity, made, kinematic)
    allocate (law, source=made)

  end subroutine perzyna_from_group

  !> \(K\,(x / \Delta t)^m\).
  pure subroutine perzyna_evaluate(self, points)
    class(perzyna_overstress_t), intent(in) :: self
    type(overstress_batch_t), intent(inout) :: points

    real(wp) :: consistency, power, slope
    integer :: i

    do i = 1, points%n_point
      consistency = self%viscosity%get_consistency(points%temperature(i))
      call evaluate_rate_power(points%increment(i) / points%dt, self%viscosity%minimum_rate, &
                               self%viscosity%rate_sensitivity, power, slope)
      points%overstress(i) = consistency * power
      points%by_increment(i) = consistency * slope / points%dt
      points%by_stress(i) = 0.0_wp
    end do

  end subroutine perzyna_evaluate

end module swage_perzyna
