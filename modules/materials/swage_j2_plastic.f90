!> Plasticity of von Mises with isotropic and kinematic hardening: no overstress, hence independent
!> of the rate unless the flow stress depends on it.
module swage_j2_plastic
  use swage_elasticity, only: elasticity_t
  use swage_flow_stress, only: flow_stress_t
  use swage_flow_stress_registry, only: take_flow_stress
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_kinematic_hardening, only: kinematic_hardening_t
  use swage_material_law, only: material_law_t
  use swage_material_sources, only: material_sources_t
  use swage_radial_return, only: radial_return_create, radial_return_law_t
  use swage_status, only: status_t
  use swage_text, only: text
  implicit none(type, external)
  private

  public :: j2_plastic_create, j2_plastic_from_group

  !> Yield strain that no metal reaches; more means that two units have been mixed.
  real(wp), parameter :: LARGEST_YIELD_STRAIN = 0.1_wp

contains

  !> Make the law from valid parameters.
  pure subroutine j2_plastic_create(elasticity, flow_stress, law, kinematic)
    type(elasticity_t), intent(in) :: elasticity
    !> Positive at no strain.
    class(flow_stress_t), intent(in) :: flow_stress
    type(radial_return_law_t), intent(out) :: law
    !> Absent in a law without kinematic hardening.
    type(kinematic_hardening_t), intent(in), optional :: kinematic

    call radial_return_create('j2', elasticity, flow_stress, law, kinematic=kinematic)

  end subroutine j2_plastic_create

  !> Make the law from its keys in a group `&material`. Not made when a key is faulty.
  subroutine j2_plastic_from_group(group, sources, law, status)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(material_law_t), allocatable, intent(out) :: law
    !> The first fault of the group or of its flow stress.
    type(status_t), intent(inout) :: status

    type(elasticity_t) :: elasticity
    type(kinematic_hardening_t) :: kinematic
    class(flow_stress_t), allocatable :: flow_stress
    type(radial_return_law_t) :: made

    call elasticity%take(group, sources)
    call kinematic%take(group, sources)
    call take_flow_stress(group, sources, .true., flow_stress, status)
    call group%finish(status)
    if (group%explaining .or. status%failed()) return

    call j2_plastic_create(elasticity, flow_stress, made, kinematic)
    if (made%initial_flow_stress <= 0.0_wp) then
      call group%refuse('flow_stress', 'without strain it is 0, and j2 needs a positive yield ' &
                        //'stress')
    else if (made%initial_flow_stress > LARGEST_YIELD_STRAIN * elasticity%young) then
      call group%refuse('flow_stress', 'its yield stress '//text(made%initial_flow_stress)// &
                        ' is above a tenth of Young''s modulus '//text(elasticity%young)// &
                        ': are they in the same unit?')
    end if
    call group%finish(status)
    if (.not. status%failed()) allocate (law, source=made)

  end subroutine j2_plastic_from_group

end module swage_j2_plastic
