!> Isotropic linear elasticity of the Jaumann rate of stress, without limit.
module swage_linear_elastic
  use swage_elasticity, only: elasticity_t
  use swage_finite, only: is_finite
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t
  use swage_material_sources, only: material_sources_t
  use swage_point_batch, only: point_batch_t
  use swage_state_table, only: state_variable_t
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: linear_elastic_t, linear_elastic_create, linear_elastic_from_group

  type, extends(material_law_t) :: linear_elastic_t
    private
    !> \(2G\) [stress].
    real(wp) :: modulus = 0.0_wp
  contains
    procedure :: update => linear_elastic_update
  end type linear_elastic_t

contains

  !> Make the law from valid constants.
  pure subroutine linear_elastic_create(elasticity, law)
    type(elasticity_t), intent(in) :: elasticity
    type(linear_elastic_t), intent(out) :: law

    law%label = 'elastic'
    law%modulus = 2.0_wp * elasticity%get_shear_modulus()
    call elasticity%describe(law)
    call law%publish_state([state_variable_t ::])

  end subroutine linear_elastic_create

  !> Make the law from its keys in a group `&material`. Not made when a key is faulty.
  subroutine linear_elastic_from_group(group, sources, law, status)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(material_law_t), allocatable, intent(out) :: law
    !> The first fault of the group.
    type(status_t), intent(inout) :: status

    type(elasticity_t) :: elasticity
    type(linear_elastic_t) :: made

    call elasticity%take(group, sources)
    call group%finish(status)
    if (group%explaining .or. status%failed()) return
    call linear_elastic_create(elasticity, made)
    allocate (law, source=made)

  end subroutine linear_elastic_from_group

  !> See [[material_law_t:update]]. A point fails when its stress is not finite.
  pure subroutine linear_elastic_update(self, batch, n_failed)
    class(linear_elastic_t), intent(in) :: self
    type(point_batch_t), intent(inout) :: batch
    integer, intent(out) :: n_failed

    real(wp) :: mean_strain, mean_stress
    integer :: i, n

    n = batch%n_point
    n_failed = 0
    do i = 1, n
      mean_stress = (batch%stress_old(i, 1) + batch%stress_old(i, 2) + batch%stress_old(i, 3)) &
        / 3.0_wp
      mean_strain = (batch%strain_increment(i, 1) + batch%strain_increment(i, 2) &
                     + batch%strain_increment(i, 3)) / 3.0_wp
      batch%deviatoric_stress(i, :3) = batch%stress_old(i, :3) - mean_stress &
        + self%modulus * (batch%strain_increment(i, :3) - mean_strain)
      batch%deviatoric_stress(i, 4:) = batch%stress_old(i, 4:) &
        + self%modulus * batch%strain_increment(i, 4:)
      if (all(is_finite(batch%deviatoric_stress(i, :)))) cycle
      n_failed = n_failed + 1
      call batch%fail(i, 'the stress is not a finite number')
    end do
    batch%tangent_secant(:n) = self%modulus
    batch%tangent_factor(:n) = 0.0_wp
    batch%tangent_direction(:n, :) = 0.0_wp
    batch%memory_modulus(:n) = self%modulus
    batch%bubble_modulus(:n) = self%modulus
    batch%relaxation_factor(:n) = 1.0_wp
    batch%flow_stress(:n) = 0.0_wp

  end subroutine linear_elastic_update

end module swage_linear_elastic
