!> The points a law is called for, with everything it may read and everything it returns.
!>
!> One object instead of a list of arguments: a new datum is a new component here, with a neutral
!> value, and no existing law changes. Components are `allocatable`, made once for the largest
!> batch and reused; a law loops to `n_point`, which may be less than their last extent.
!>
!> Frame: every tensor is Mandel, and refers to the axes at the end of the step. The caller has
!> turned `stress_old` and the tensors of `state_old` by `rotation_increment`, and
!> `strain_increment`, taken at mid-step, by half of it.
module swage_point_batch
  use swage_kinds, only: gp, wp
  use swage_units, only: ROOM_TEMPERATURE
  implicit none(type, external)
  private

  public :: point_batch_t, point_batch_create

  type :: point_batch_t
    !> Points in use.
    integer :: n_point = 0

    ! In; a law leaves these alone

    !> Time increment [time], positive.
    real(wp) :: dt = 1.0_wp
    !> Time at the end of the step [time].
    real(wp) :: time = 0.0_wp
    !> Global number of the cell of each point, for messages and adapters; shape (n_point).
    integer(gp), allocatable :: cell(:)
    !> Kelvin [temperature], at both ends of the step; shape (n_point).
    real(wp), allocatable :: temperature_old(:), temperature_new(:)
    !> Rotation over the step [1]; shape (3, 3, n_point).
    real(wp), allocatable :: rotation_increment(:, :, :)
    !> Logarithmic to second order in the step [1]; shape (6, n_point).
    real(wp), allocatable :: strain_increment(:, :)
    !> Cauchy stress, pressure included, at the start of the step [stress]; shape (6, n_point).
    real(wp), allocatable :: stress_old(:, :)
    !> History at the start of the step, as the law's state table; shape (n_state, n_point).
    real(wp), allocatable :: state_old(:, :)

    ! Out; every law sets these

    !> History at the end of the step; shape (n_state, n_point).
    real(wp), allocatable :: state_new(:, :)
    !> Deviator of the Cauchy stress at the end of the step [stress]; shape (6, n_point).
    real(wp), allocatable :: deviatoric_stress(:, :)
    !> Its derivative by `strain_increment` at fixed pressure [stress]; shape (6, 6, n_point).
    real(wp), allocatable :: deviatoric_tangent(:, :, :)
    !> Stress left by a small change of the rotated old deviator, as 2G: the change of the old
    !> deviator acts like a strain increment of that change over `memory_modulus`; 0 for a law that
    !> forgets its old stress [stress]; shape (n_point).
    real(wp), allocatable :: memory_modulus(:)
    !> Equivalent stress at which the point flows [stress], 0 for a law that never does: the scale
    !> of the grad-div term; shape (n_point).
    real(wp), allocatable :: flow_stress(:)
    !> Secant 2µ of the deviator, for the bubble [stress], positive: 2Gθ, or 2η/dt for pure flow;
    !> shape (n_point).
    real(wp), allocatable :: bubble_modulus(:)
    !> θ, the part of the trial deviator that the step leaves [1]: 1 elastic, 0 purely viscous;
    !> shape (n_point).
    real(wp), allocatable :: relaxation_factor(:)

    ! Out; `start` has given a neutral value to what a law may leave alone

    !> Plastic or viscous power per volume [power/length^3], at least 0; shape (n_point).
    real(wp), allocatable :: dissipated_power(:)
    !> Longest next step that the law recommends [time]. A law may only lower it.
    real(wp) :: suggested_time_step = huge(1.0_wp)
  contains
    !> Open a batch of `n_point` points: neutral values for the outputs that are not compulsory.
    procedure :: start => point_batch_start
  end type point_batch_t

contains

  !> Room for batches of up to `capacity` points, filled with undeformed points at rest.
  pure subroutine point_batch_create(capacity, n_state, batch)
    integer, intent(in) :: capacity
    !> Largest `n_state` of the laws the batch will meet.
    integer, intent(in) :: n_state
    type(point_batch_t), intent(out) :: batch

    integer :: i

    allocate (batch%cell(capacity), source=0_gp)
    allocate (batch%temperature_old(capacity), source=ROOM_TEMPERATURE)
    allocate (batch%temperature_new(capacity), source=ROOM_TEMPERATURE)
    allocate (batch%rotation_increment(3, 3, capacity), source=0.0_wp)
    do i = 1, 3
      batch%rotation_increment(i, i, :) = 1.0_wp
    end do
    allocate (batch%strain_increment(6, capacity), source=0.0_wp)
    allocate (batch%stress_old(6, capacity), source=0.0_wp)
    allocate (batch%state_old(n_state, capacity), source=0.0_wp)
    allocate (batch%state_new(n_state, capacity), source=0.0_wp)
    allocate (batch%deviatoric_stress(6, capacity), source=0.0_wp)
    allocate (batch%deviatoric_tangent(6, 6, capacity), source=0.0_wp)
    allocate (batch%memory_modulus(capacity), source=0.0_wp)
    allocate (batch%flow_stress(capacity), source=0.0_wp)
    allocate (batch%bubble_modulus(capacity), source=0.0_wp)
    allocate (batch%relaxation_factor(capacity), source=1.0_wp)
    allocate (batch%dissipated_power(capacity), source=0.0_wp)
    call batch%start(capacity)

  end subroutine point_batch_create

  pure subroutine point_batch_start(self, n_point)
    class(point_batch_t), intent(inout) :: self
    !> At most the capacity.
    integer, intent(in) :: n_point

    self%n_point = n_point
    self%dissipated_power(:n_point) = 0.0_wp
    self%suggested_time_step = huge(1.0_wp)

  end subroutine point_batch_start

end module swage_point_batch
