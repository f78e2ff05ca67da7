!> What every constitutive law provides to the element loops.
!>
!> A law is called once per *batch* of integration points, so its dynamic dispatch is paid per
!> batch. It answers for the deviator only: pressure is an unknown of its own.
module swage_material_law
  use swage_kinds, only: wp
  use swage_point_batch, only: point_batch_t
  use swage_state_table, only: state_variable_t
  implicit none(type, external)
  private

  public :: material_law_t
  public :: PLASTIC_STATE, ROW_STRAIN, ROW_RATE

  !> History of every law that flows; its rows come first in the table of such a law, so that
  !> pictures and restarts name them alike.
  type(state_variable_t), parameter :: PLASTIC_STATE(*) = [ &
    state_variable_t('equivalent_plastic_strain', '1', lower=0.0_wp), &
    state_variable_t('equivalent_plastic_strain_rate', '1/time', lower=0.0_wp)]

  !> Rows of `PLASTIC_STATE` in a state array.
  integer, parameter :: ROW_STRAIN = 1
  integer, parameter :: ROW_RATE = 2

  !> A constitutive law with its parameters; immutable once created, shared by all points.
  type, abstract :: material_law_t
    !> Name used in input decks and messages.
    character(len=32) :: label = ''
    !> 1/κ, the inverse of the bulk modulus [1/stress]; 0 for an incompressible material.
    real(wp) :: inverse_bulk_modulus = 0.0_wp
    !> True for a law without elasticity: its stress depends on the rate alone, its bubble modulus
    !> grows as 1/dt, and `reference_modulus` is an estimate for a strain step of 1 %.
    logical :: fluid = .false.
    !> 2G of the unloaded material, or a typical 2η/dt of a fluid [stress], positive: it scales
    !> penalties.
    real(wp) :: reference_modulus = 1.0_wp
    !> θ of a point that has not moved yet: 1 for a law with elasticity, 0 for pure flow.
    real(wp) :: initial_relaxation = 1.0_wp
    !> Equivalent stress at which a virgin point flows, a scale [stress]: that of a law that depends
    !> on the rate is taken at its `reference_rate`; 0 for a law that never flows.
    real(wp) :: initial_flow_stress = 0.0_wp
    !> Equivalent plastic strain [1] and its rate [1/time] up to which the law is known, of those in
    !> `PLASTIC_STATE`; beyond it stays constant.
    real(wp) :: largest_strain = huge(1.0_wp)
    real(wp) :: largest_rate = huge(1.0_wp)
    !> Temperatures for which the law is known [temperature], kelvin.
    real(wp) :: lowest_temperature = 0.0_wp
    real(wp) :: highest_temperature = huge(1.0_wp)
    !> History variables, in the order of the rows of `state_old`.
    type(state_variable_t), allocatable :: state_table(:)
    !> Rows of `state_old`: the widths of the table, summed.
    integer :: n_state = 0
  contains
    !> Publish the history variables; a maker calls it once.
    procedure :: publish_state => material_law_publish_state
    !> Stress, tangent and new history of a batch of points.
    procedure(update_points), deferred :: update
  end type material_law_t

  abstract interface

    !> Stress, tangent and new history of a batch of points.
    !>
    !> Not `pure`, so that an adapter may call foreign code (UMAT, MGIS); a law of Swage's own
    !> declares its update and its kernels `pure` all the same. History is never changed in place:
    !> a rejected step leaves `state_old` as it was.
    subroutine update_points(self, batch, n_failed)
      import :: material_law_t, point_batch_t
      implicit none(type, external)
      class(material_law_t), intent(in) :: self
      type(point_batch_t), intent(inout) :: batch
      !> Points without a usable result. The caller turns a positive count into `STATUS_RETRY`.
      integer, intent(out) :: n_failed
    end subroutine update_points

  end interface

contains

  pure subroutine material_law_publish_state(self, table)
    class(material_law_t), intent(inout) :: self
    type(state_variable_t), intent(in) :: table(:)

    self%state_table = table
    self%n_state = sum(table%width())

  end subroutine material_law_publish_state

end module swage_material_law
