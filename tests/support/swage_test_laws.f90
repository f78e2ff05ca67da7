!> One example of every constitutive law: its yield stress is a tenth of its shear modulus.
module swage_test_laws
  use swage_chenot_eq3, only: chenot_eq3_create
  use swage_elasticity, only: elasticity_t
  use swage_flow_stress, only: flow_stress_t
  use swage_grid_flow_stress, only: grid_flow_stress_create, grid_flow_stress_t
  use swage_j2_plastic, only: j2_plastic_create
  use swage_kinds, only: wp
  use swage_kinematic_hardening, only: kinematic_hardening_t
  use swage_linear_elastic, only: linear_elastic_create, linear_elastic_t
  use swage_linear_flow_stress, only: linear_flow_stress_t
  use swage_material_law, only: material_law_t
  use swage_norton_hoff, only: norton_hoff_create, norton_hoff_t
  use swage_perzyna, only: perzyna_create
  use swage_radial_return, only: radial_return_law_t
  use swage_swift_flow_stress, only: swift_flow_stress_t
  use swage_table_flow_stress, only: table_flow_stress_create, table_flow_stress_t
  use swage_viscosity, only: viscosity_t
  use swage_voce_flow_stress, only: voce_flow_stress_t
  implicit none(type, external)
  private

  public :: make_elastic, make_law
  public :: LAW_NAMES

  !> What `make_law` knows.
  character(len=20), parameter :: LAW_NAMES(*) = &
    [character(len=20) :: 'elastic', 'j2 linear', 'j2 swift', 'j2 voce', 'j2 table', 'perzyna', &
                          'chenot_eq3', 'norton_hoff', 'kinematic j2', 'kinematic perzyna', &
                          'kinematic chenot_eq3', 'j2 grid', 'kinematic grid']

contains

  !> A linear elastic law.
  subroutine make_elastic(young, poisson, law, shear_modulus)
    !> [stress]
    real(wp), intent(in) :: young
    real(wp), intent(in) :: poisson
    class(material_law_t), allocatable, intent(out) :: law
    !> [stress]
    real(wp), intent(out) :: shear_modulus

    type(elasticity_t) :: elasticity
    type(linear_elastic_t) :: made

    elasticity = elasticity_t(young=young, poisson=poisson)
    call linear_elastic_create(elasticity, made)
    allocate (law, source=made)
    shear_modulus = elasticity%get_shear_modulus()

  end subroutine make_elastic

  !> A law of `LAW_NAMES`, which softens with temperature where it can.
  subroutine make_law(name, shear_modulus, law)
    character(len=*), intent(in) :: name
    !> Scale of all stresses [stress].
    real(wp), intent(in) :: shear_modulus
    class(material_law_t), allocatable, intent(out) :: law

    real(wp), parameter :: POISSON = 0.3_wp
    type(elasticity_t) :: elasticity
    type(viscosity_t) :: viscosity
    type(kinematic_hardening_t) :: kinematic
    type(norton_hoff_t) :: fluid
    type(radial_return_law_t) :: solid
    class(flow_stress_t), allocatable :: flow_stress
    real(wp) :: spare

    elasticity = elasticity_t(young=2.0_wp * (1.0_wp + POISSON) * shear_modulus, poisson=POISSON)
    viscosity = viscosity_t(consistency=0.05_wp * shear_modulus, rate_sensitivity=0.3_wp, &
                            thermal_softening=1.0e-3_wp, minimum_rate=1.0e-3_wp)
    kinematic%modulus = 0.0_wp
    if (index(name, 'kinematic') == 1) kinematic%modulus = 0.3_wp * shear_modulus
    select case (name)
    case ('elastic')
      call make_elastic(elasticity%young, elasticity%poisson, law, spare)
    case ('norton_hoff')
      call norton_hoff_create(viscosity, 10.0_wp * shear_modulus, fluid)
      allocate (law, source=fluid)
    case ('perzyna', 'kinematic perzyna')
      call make_flow_stress('linear', shear_modulus, flow_stress)
      call perzyna_create(elasticity, flow_stress, viscosity, solid, kinematic)
      allocate (law, source=solid)
    case ('chenot_eq3', 'kinematic chenot_eq3')
      call make_flow_stress('linear', shear_modulus, flow_stress)
      call chenot_eq3_create(elasticity, flow_stress, viscosity, solid, kinematic)
      allocate (law, source=solid)
    case ('kinematic j2', 'kinematic grid')
      call make_flow_stress(trim(merge('grid  ', 'linear', name == 'kinematic grid')), &
                            shear_modulus, flow_stress)
      call j2_plastic_create(elasticity, flow_stress, solid, kinematic)
      allocate (law, source=solid)
    case default
      call make_flow_stress(name(4:), shear_modulus, flow_stress)
      call j2_plastic_create(elasticity, flow_stress, solid)
      allocate (law, source=solid)
    end select

  end subroutine make_law

  subroutine make_flow_stress(name, scale, flow_stress)
    character(len=*), intent(in) :: name
    !> [stress]
    real(wp), intent(in) :: scale
    class(flow_stress_t), allocatable, intent(out) :: flow_stress

    type(grid_flow_stress_t) :: grid
    type(table_flow_stress_t) :: table
    real(wp) :: stress(3, 3, 2)
    integer :: i

    select case (name)
    case ('swift')
      allocate (flow_stress, source=swift_flow_stress_t(strength=0.25_wp * scale, &
                                                        prestrain=0.01_wp, exponent=0.2_wp))
    case ('voce')
      allocate (flow_stress, source=voce_flow_stress_t(yield_stress=0.1_wp * scale, &
                                                       hardening_modulus=0.02_wp * scale, &
                                                       saturation_increment=0.08_wp * scale, &
                                                       saturation_exponent=5.0_wp))
    case ('table')
      call table_flow_stress_create([0.0_wp, 0.1_wp, 0.5_wp, 2.0_wp], &
                                    scale * [0.1_wp, 0.15_wp, 0.2_wp, 0.24_wp], table)
      allocate (flow_stress, source=table)
    case ('grid')
      do i = 1, 3
        stress(:, i, 1) = scale * [0.1_wp, 0.15_wp, 0.2_wp] * (0.7_wp + 0.3_wp * i**2)
      end do
      stress(:, :, 2) = 0.4_wp * stress(:, :, 1)
      ! Slower than any rate that tests draw: a difference across its end has no derivative
      call grid_flow_stress_create([0.0_wp, 0.2_wp, 1.0_wp], [1.0e-5_wp, 1.0_wp, 1.0e2_wp], &
                                   [300.0_wp, 1200.0_wp], stress, grid)
      allocate (flow_stress, source=grid)
    case default
      allocate (flow_stress, source=linear_flow_stress_t(yield_stress=0.1_wp * scale, &
                                                         hardening_modulus=0.05_wp * scale))
    end select
    flow_stress%thermal_softening = 1.0e-3_wp

  end subroutine make_flow_stress

end module swage_test_laws
