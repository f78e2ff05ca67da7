!> Norton–Hoff viscoplastic flow: the rigid-viscoplastic law of hot forming.
!>
!> With \(d\) the deviatoric strain rate and the regularised
!> \(\dot\varepsilon^2 = \tfrac23\, d:d + \dot\varepsilon_0^2\), which keeps rigid zones finite:
!> \[ s = 2\eta\,d, \quad \eta = K(T)\,(\sqrt3\,\dot\varepsilon)^{m-1},
!>    \quad K(T) = K_0\, e^{-\beta(T-T_0)}, \]
!> hence \(\sigma_{eq} = \sqrt3\,K\,(\sqrt3\,\dot\varepsilon)^m\): \(K\) is a consistency in shear,
!> not the uniaxial stress at \(\dot\varepsilon = 1\).
!>
!> Source: N. J. Hoff, Approximate analysis of structures in the presence of moderately large
!> creep deformations, Q. Appl. Math. 12 (1954) 49–55.
module swage_norton_hoff
  use swage_finite, only: is_finite
  use swage_group, only: group_t
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t, PLASTIC_STATE, ROW_RATE, ROW_STRAIN
  use swage_material_sources, only: material_sources_t
  use swage_point_batch, only: point_batch_t
  use swage_status, only: status_t
  use swage_viscosity, only: viscosity_t
  implicit none(type, external)
  private

  public :: norton_hoff_t, norton_hoff_create, norton_hoff_from_group

  !> Strain step for which `reference_modulus` is estimated.
  real(wp), parameter :: TYPICAL_STRAIN_STEP = 0.01_wp

  !> \(\dot\varepsilon_0\) unless given: larger than where elasticity keeps rigid zones stiff.
  real(wp), parameter :: DEFAULT_MINIMUM_RATE = 1.0e-6_wp

  type, extends(material_law_t) :: norton_hoff_t
    private
    type(viscosity_t) :: viscosity
  contains
    procedure :: update => norton_hoff_update
  end type norton_hoff_t

contains

  !> Make the law from valid parameters.
  pure subroutine norton_hoff_create(viscosity, bulk_modulus, law)
    type(viscosity_t), intent(in) :: viscosity
    !> [stress]; 0 or less makes the material incompressible.
    real(wp), intent(in) :: bulk_modulus
    type(norton_hoff_t), intent(out) :: law

    law%label = 'norton_hoff'
    law%viscosity = viscosity
    if (bulk_modulus > 0.0_wp) law%inverse_bulk_modulus = 1.0_wp / bulk_modulus
    law%fluid = .true.
    law%initial_relaxation = 0.0_wp
    law%initial_flow_stress = sqrt(3.0_wp) * viscosity%consistency &
      * (sqrt(3.0_wp) * viscosity%reference_rate)**viscosity%rate_sensitivity
    law%reference_modulus = 2.0_wp / 3.0_wp * law%initial_flow_stress / TYPICAL_STRAIN_STEP
    call law%publish_state(PLASTIC_STATE)

  end subroutine norton_hoff_create

  !> Make the law from its keys in a group `&material`. Not made when a key is faulty.
  subroutine norton_hoff_from_group(group, sources, law, status)
    type(group_t), intent(inout) :: group
    type(material_sources_t), intent(in) :: sources
    class(material_law_t), allocatable, intent(out) :: law
    !> The first fault of the group.
    type(status_t), intent(inout) :: status

    real(wp) :: bulk_modulus
    type(norton_hoff_t) :: made
    type(viscosity_t) :: viscosity

    viscosity%minimum_rate = DEFAULT_MINIMUM_RATE
    call viscosity%take(group, sources, &
                        'K of sigma = sqrt(3) K (sqrt(3) rate)^m, in shear.')
    bulk_modulus = 0.0_wp
    call group%take('bulk_modulus', bulk_modulus, 'stress', &
                    'Bulk modulus; 0 makes the material incompressible.', lower=0.0_wp)
    call sources%check_stress(group, 'bulk_modulus', bulk_modulus, 1.0e6_wp)
    call group%finish(status)
    if (group%explaining .or. status%failed()) return

    call norton_hoff_create(viscosity, bulk_modulus, made)
    allocate (law, source=made)

  end subroutine norton_hoff_from_group

  !> See [[material_law_t:update]]. Fails at points whose viscosity is not finite.
  pure subroutine norton_hoff_update(self, batch, n_failed)
    class(norton_hoff_t), intent(in) :: self
    type(point_batch_t), intent(inout) :: batch
    integer, intent(out) :: n_failed

    real(wp) :: mean, modulus, norm, rate, regular, viscosity
    integer :: i, k

    n_failed = 0
    associate (p => self%viscosity, d => batch%tangent_direction)
      do i = 1, batch%n_point

        ! The direction of the tangent is the deviatoric strain rate
        mean = (batch%strain_increment(i, 1) + batch%strain_increment(i, 2) &
                + batch%strain_increment(i, 3)) / 3.0_wp
        norm = 0.0_wp
        do k = 1, 6
          d(i, k) = (batch%strain_increment(i, k) - merge(mean, 0.0_wp, k <= 3)) / batch%dt
          norm = norm + d(i, k)**2
        end do
        rate = sqrt(2.0_wp / 3.0_wp * norm)
        regular = rate**2 + p%minimum_rate**2
        viscosity = p%get_consistency(batch%temperature_new(i)) &
          * (3.0_wp * regular)**(0.5_wp * (p%rate_sensitivity - 1.0_wp))
        if (.not. is_finite(viscosity)) then
          n_failed = n_failed + 1
          call batch%fail(i, 'the viscosity is not a finite number')
        end if

        modulus = 2.0_wp * viscosity / batch%dt
        do k = 1, 6
          batch%deviatoric_stress(i, k) = 2.0_wp * viscosity * d(i, k)
        end do
        batch%tangent_secant(i) = modulus
        batch%tangent_factor(i) = modulus * 2.0_wp / 3.0_wp * (p%rate_sensitivity - 1.0_wp) &
          / regular
        batch%memory_modulus(i) = 0.0_wp
        batch%flow_stress(i) = 3.0_wp * viscosity * rate
        batch%bubble_modulus(i) = modulus
        batch%relaxation_factor(i) = 0.0_wp
        batch%dissipated_power(i) = 3.0_wp * viscosity * rate**2
        batch%state_new(i, ROW_STRAIN) = batch%state_old(i, ROW_STRAIN) + batch%dt * rate
        batch%state_new(i, ROW_RATE) = rate

      end do
    end associate

  end subroutine norton_hoff_update

end module swage_norton_hoff
