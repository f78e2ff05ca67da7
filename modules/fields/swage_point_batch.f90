!> The points a law is called for, with everything it may read and everything it returns.
!>
!> One object instead of a list of arguments: a new datum is a new component here, with a neutral
!> value, and no existing law changes. Components are `allocatable`, made once for the largest
!> batch and reused; a law loops to `n_point`, which may be less than their first extent. The point
!> is the first index, so that loops over points meet neighbours and the compiler can use vectors.
!>
!> Frame: every tensor is Mandel, and refers to the axes at the end of the step. The caller has
!> turned `stress_old` and the tensors of `state_old` by `rotation_increment`, and
!> `strain_increment`, taken at mid-step, by half of it.
module swage_point_batch
  use swage_kinds, only: gp, wp
  use swage_units, only: ROOM_TEMPERATURE
  implicit none(type, external)
  private

  public :: point_batch_t, point_batch_create, LANES

  !> Points computed side by side: loops over them have this length, known to the compiler. One to
  !> four vector registers; the matrices of a batch of cells, 16 kB, stay in the first cache.
  integer, parameter :: LANES = 8

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
    !> Rotation over the step [1]; shape (n_point, 3, 3).
    real(wp), allocatable :: rotation_increment(:, :, :)
    !> Logarithmic to second order in the step [1]; shape (n_point, 6).
    real(wp), allocatable :: strain_increment(:, :)
    !> Cauchy stress, pressure included, at the start of the step [stress]; shape (n_point, 6).
    real(wp), allocatable :: stress_old(:, :)
    !> History at the start of the step, as the law's state table; shape (n_point, n_state).
    real(wp), allocatable :: state_old(:, :)

    ! Out; every law sets these

    !> History at the end of the step; shape (n_point, n_state).
    real(wp), allocatable :: state_new(:, :)
    !> Deviator of the Cauchy stress at the end of the step [stress]; shape (n_point, 6).
    real(wp), allocatable :: deviatoric_stress(:, :)
    !> Its derivative by `strain_increment` at fixed pressure, which every isotropic law has in the
    !> form \(a\,\mathbb P + b\,n \otimes n\), with the deviatoric projector \(\mathbb P\): a and
    !> b [stress]; shape (n_point).
    real(wp), allocatable :: tangent_secant(:), tangent_factor(:)
    !> The deviator n [1], of any length; shape (n_point, 6).
    real(wp), allocatable :: tangent_direction(:, :)
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
    !> First point without a usable result, 0 when there is none, and what failed there.
    integer :: first_failed = 0
    character(len=80) :: failure = ''
    !> Back stress, turned to the end of the step, of a law that answers for the stress relative to
    !> it [stress]: `memory_modulus` is then that of the relative stress, and the deviator turns
    !> with the back stress besides; shape (n_point, 6).
    logical :: has_back_stress = .false.
    real(wp), allocatable :: back_stress(:, :)
    !> Longest next step that the law recommends [time]. A law may only lower it.
    real(wp) :: suggested_time_step = huge(1.0_wp)
  contains
    !> Open a batch of `n_point` points: neutral values for the outputs that are not compulsory.
    procedure :: start => point_batch_start
    !> Remember where and why a law fails; the first point counts.
    procedure :: fail => point_batch_fail
    !> Derivative of the deviator of a point by its strain increment.
    procedure :: tangent_at => point_batch_tangent_at
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
    allocate (batch%rotation_increment(capacity, 3, 3), source=0.0_wp)
    do i = 1, 3
      batch%rotation_increment(:, i, i) = 1.0_wp
    end do
    allocate (batch%strain_increment(capacity, 6), source=0.0_wp)
    allocate (batch%stress_old(capacity, 6), source=0.0_wp)
    allocate (batch%state_old(capacity, n_state), source=0.0_wp)
    allocate (batch%state_new(capacity, n_state), source=0.0_wp)
    allocate (batch%deviatoric_stress(capacity, 6), source=0.0_wp)
    allocate (batch%tangent_secant(capacity), source=0.0_wp)
    allocate (batch%tangent_factor(capacity), source=0.0_wp)
    allocate (batch%tangent_direction(capacity, 6), source=0.0_wp)
    allocate (batch%memory_modulus(capacity), source=0.0_wp)
    allocate (batch%flow_stress(capacity), source=0.0_wp)
    allocate (batch%bubble_modulus(capacity), source=0.0_wp)
    allocate (batch%relaxation_factor(capacity), source=1.0_wp)
    allocate (batch%dissipated_power(capacity), source=0.0_wp)
    allocate (batch%back_stress(capacity, 6), source=0.0_wp)
    call batch%start(capacity)

  end subroutine point_batch_create

  pure subroutine point_batch_start(self, n_point)
    class(point_batch_t), intent(inout) :: self
    !> At most the capacity.
    integer, intent(in) :: n_point

    self%n_point = n_point
    self%dissipated_power(:n_point) = 0.0_wp
    self%first_failed = 0
    self%failure = ''
    self%has_back_stress = .false.
    self%suggested_time_step = huge(1.0_wp)

  end subroutine point_batch_start

  pure subroutine point_batch_fail(self, point, failure)
    class(point_batch_t), intent(inout) :: self
    integer, intent(in) :: point
    !> What is wrong, as a sentence without capital and full stop.
    character(len=*), intent(in) :: failure

    if (self%first_failed > 0 .and. self%first_failed <= point) return
    self%first_failed = point
    self%failure = failure

  end subroutine point_batch_fail

  pure function point_batch_tangent_at(self, point) result(tangent)
    class(point_batch_t), intent(in) :: self
    integer, intent(in) :: point
    !> Columns belong to the components of the strain increment [stress].
    real(wp) :: tangent(6, 6)

    integer :: i, j

    do j = 1, 6
      do i = 1, 6
        tangent(i, j) = self%tangent_factor(point) * self%tangent_direction(point, i) &
          * self%tangent_direction(point, j)
      end do
      tangent(j, j) = tangent(j, j) + self%tangent_secant(point)
    end do
    tangent(:3, :3) = tangent(:3, :3) - self%tangent_secant(point) / 3.0_wp

  end function point_batch_tangent_at

end module swage_point_batch
