!> The two constants of isotropic elasticity: their keys, and what follows from them.
module swage_elasticity
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t
  use swage_material_sources, only: material_sources_t
  implicit none(type, external)
  private

  public :: elasticity_t

  type :: elasticity_t
    !> Young's modulus \(E\) [stress].
    real(wp) :: young = 0.0_wp
    !> Poisson's ratio \(\nu\) [1]; 0.5 is incompressible.
    real(wp) :: poisson = 0.0_wp
  contains
    !> Name, read and check the keys.
    procedure :: take => elasticity_take
    !> \(G = E / (2 (1 + \nu))\) [stress].
    procedure :: get_shear_modulus => elasticity_get_shear_modulus
    !> Hand to a law what its caller must know of its elasticity.
    procedure :: describe => elasticity_describe
  end type elasticity_t

contains

  subroutine elasticity_take(self, group, sources)
    class(elasticity_t), intent(inout) :: self
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources

    call group%take('young', self%young, 'stress', 'Young''s modulus.', above=0.0_wp, &
                    required=.true.)
    call group%take('poisson', self%poisson, '1', &
                    'Poisson''s ratio; 0.5 makes the elastic part incompressible.', &
                    above=-1.0_wp, upper=0.5_wp, required=.true.)
    call sources%check_stress(group, 'young', self%young, 1.0e6_wp)

  end subroutine elasticity_take

  elemental function elasticity_get_shear_modulus(self) result(shear_modulus)
    class(elasticity_t), intent(in) :: self
    real(wp) :: shear_modulus

    shear_modulus = self%young / (2.0_wp * (1.0_wp + self%poisson))

  end function elasticity_get_shear_modulus

  pure subroutine elasticity_describe(self, law)
    class(elasticity_t), intent(in) :: self
    class(material_law_t), intent(inout) :: law

    law%inverse_bulk_modulus = 3.0_wp * (1.0_wp - 2.0_wp * self%poisson) / self%young
    law%reference_modulus = 2.0_wp * self%get_shear_modulus()
    law%initial_relaxation = 1.0_wp

  end subroutine elasticity_describe

end module swage_elasticity
