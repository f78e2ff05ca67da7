!> Friction that slides at a limit stress: what the laws share that say no more than the limit.
!>
!> With the slip rate v = slip/dt the law is
!> \[ \tau = -L \Big(\frac{|v|}{v_0}\Big)^{q} \frac{v}{|v|}, \]
!> the limit L [stress] from pressure and flow stress, q the rate exponent, 0 for dry friction.
!> At rest it is a set of tractions, not a traction. One method smooths it there in the slip rate:
!> simple, without history, and a point that should stick creeps. The other puts an elastic bond in
!> series with it and keeps the traction of the last step: nothing creeps, and loads may wait.
module swage_sliding_friction
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_kinds, only: wp
  use swage_rotation, only: dyadic, IDENTITY
  implicit none(type, external)
  private

  public :: sliding_law_t, REGULARISED, RETURN_MAPPING, METHOD_NAMES

  integer, parameter :: REGULARISED = 1, RETURN_MAPPING = 2
  !> What the key `method` calls them.
  character(len=*), parameter :: METHOD_NAMES(*) = [character(len=14) :: 'regularised', &
                                                    'return_mapping']

  !> Iterations of the return with a rate; Newton's method from the safe side converges in fewer.
  integer, parameter :: MAXIMUM_ITERATIONS = 60

  !> How a law slides, whatever its limit. Call `set_method` when made.
  type, abstract, extends(friction_law_t) :: sliding_law_t
    !> `REGULARISED` or `RETURN_MAPPING`.
    integer :: method = REGULARISED
    !> q [1], 0 to 1.
    real(wp) :: rate_exponent = 0.0_wp
    !> v₀ [length/time], positive.
    real(wp) :: reference_velocity = 1.0_wp
  contains
    procedure :: traction => sliding_law_traction
    !> Choose the method, and announce what it asks for.
    procedure :: set_method => sliding_law_set_method
    !> Friction stress at the slip rate v₀.
    procedure(find_limit), deferred :: limit
  end type sliding_law_t

  abstract interface
    pure subroutine find_limit(self, point, limit, d_limit)
      import :: friction_point_t, sliding_law_t, wp
      implicit none(type, external)
      class(sliding_law_t), intent(in) :: self
      !> Its pressure and flow stress count.
      type(friction_point_t), intent(in) :: point
      !> [stress], at least 0.
      real(wp), intent(out) :: limit
      !> Its derivative by the pressure [1].
      real(wp), intent(out) :: d_limit
    end subroutine find_limit
  end interface

contains

  pure subroutine sliding_law_set_method(self, method, regularisation_velocity)
    class(sliding_law_t), intent(inout) :: self
    !> One of `METHOD_NAMES`.
    character(len=*), intent(in) :: method
    !> [length/time], at least 0; see [[friction_law_t]].
    real(wp), intent(in) :: regularisation_velocity

    self%method = findloc(METHOD_NAMES == method, .true., dim=1)
    self%has_history = self%method == RETURN_MAPPING
    ! Proportional to the slip rate it is smooth already
    self%is_regularised = self%method == REGULARISED .and. self%rate_exponent < 1.0_wp
    self%regularisation_velocity = regularisation_velocity

  end subroutine sliding_law_set_method

  !> See [[friction_law_t:traction]].
  pure subroutine sliding_law_traction(self, point)
    class(sliding_law_t), intent(in) :: self
    type(friction_point_t), intent(inout) :: point

    real(wp) :: d_limit, limit

    call self%limit(point, limit, d_limit)
    if (self%method == RETURN_MAPPING) then
      call return_to_limit(self, limit, d_limit, point)
    else
      call regularise(self, limit, d_limit, point)
    end if

  end subroutine sliding_law_traction

  !> With \(s = \sqrt{|v|^2 + e^2}\) in place of |v|:
  !> \[ \tau = -L \frac{s^{q-1}}{v_0^q} v, \quad \frac{\partial\tau}{\partial v} =
  !>    -L \frac{s^{q-1}}{v_0^q} \Big(I - (1 - q) \frac{v\otimes v}{s^2}\Big). \]
  !>
  !> Without rate, a body that should stick creeps at \(e\,\tau/\sqrt{L^2-\tau^2}\).
  pure subroutine regularise(self, limit, d_limit, point)
    class(sliding_law_t), intent(in) :: self
    !> L [stress], and its derivative by the pressure [1].
    real(wp), intent(in) :: limit
    real(wp), intent(in) :: d_limit
    type(friction_point_t), intent(inout) :: point

    real(wp) :: direction(3), factor, scale, velocity(3)

    velocity = point%slip / point%dt
    scale = hypot(norm2(velocity), point%regularisation_velocity)
    direction = 0.0_wp
    point%d_slip = 0.0_wp
    point%secant = 0.0_wp
    if (self%rate_exponent >= 1.0_wp) then
      direction = velocity / self%reference_velocity
      point%secant = limit / (self%reference_velocity * point%dt)
      point%d_slip = -point%secant * IDENTITY
    else if (scale > 0.0_wp) then
      ! Zero only when neither the body moves nor a velocity was given: no direction, no friction
      factor = 1.0_wp
      if (self%rate_exponent > 0.0_wp) then
        factor = (scale / self%reference_velocity)**self%rate_exponent
      end if
      direction = factor * velocity / scale
      point%secant = limit * factor / (scale * point%dt)
      point%d_slip = point%secant &
        * ((1.0_wp - self%rate_exponent) * dyadic(velocity / scale, velocity / scale) - IDENTITY)
    end if
    point%traction = -limit * direction
    point%d_traction_old = 0.0_wp
    point%d_pressure = -d_limit * direction
    point%dissipation = limit * dot_product(direction, point%slip)
    point%sticking = limit > 0.0_wp .and. norm2(velocity) < point%regularisation_velocity

  end subroutine regularise

  !> An elastic bond of stiffness k in series, by backward Euler: the trial traction
  !> \(\tau^{tr} = \tau_n - k\,g\), g the slip, is drawn back along itself by the inelastic slip γ,
  !> until \(|\tau| = |\tau^{tr}| - k\gamma = L\,(\gamma/(v_0\Delta t))^q\).
  pure subroutine return_to_limit(self, limit, d_limit, point)
    class(sliding_law_t), intent(in) :: self
    real(wp), intent(in) :: limit
    real(wp), intent(in) :: d_limit
    type(friction_point_t), intent(inout) :: point

    real(wp) :: by_limit, by_size, d_trial(3, 3), direction(3), size_of_traction, slid, &
      trial(3), trial_size

    associate (k => point%tangential_stiffness)
      trial = point%traction_old - k * point%slip
      trial_size = norm2(trial)
      if (self%rate_exponent > 0.0_wp) then
        call slide_at_rate(self, limit, k, point%dt, trial_size, slid, by_size, by_limit)
        point%sticking = .false.
      else
        slid = max(trial_size - limit, 0.0_wp) / k
        point%sticking = trial_size <= limit .and. limit > 0.0_wp
        by_size = merge(1.0_wp, 0.0_wp, trial_size <= limit)
        by_limit = 1.0_wp - by_size
      end if
      size_of_traction = trial_size - k * slid

      direction = 0.0_wp
      point%secant = k
      d_trial = by_size * IDENTITY
      if (trial_size > 0.0_wp) then
        direction = trial / trial_size
        point%secant = k * (size_of_traction / trial_size)
        d_trial = size_of_traction / trial_size * (IDENTITY - dyadic(direction, direction)) &
          + by_size * dyadic(direction, direction)
      end if
      point%traction = size_of_traction * direction
      point%d_traction_old = d_trial
      point%d_slip = -k * d_trial
      point%d_pressure = by_limit * d_limit * direction
      point%dissipation = size_of_traction * slid
    end associate

  end subroutine return_to_limit

  !> Solve T - kγ = L (γ/(v₀Δt))^q for γ.
  !>
  !> In \(y = (\gamma/(v_0\Delta t))^q\) the equation is \(k v_0\Delta t\,y^{1/q} + L y = T\), whose
  !> left side is convex: Newton's method from above falls to the solution without passing it.
  pure subroutine slide_at_rate(self, limit, k, dt, trial, slid, by_trial, by_limit)
    class(sliding_law_t), intent(in) :: self
    !> L [stress].
    real(wp), intent(in) :: limit
    !> [stress/length]
    real(wp), intent(in) :: k
    real(wp), intent(in) :: dt
    !> T [stress], at least 0.
    real(wp), intent(in) :: trial
    !> γ [length].
    real(wp), intent(out) :: slid
    !> Derivatives of the size of the traction, T - kγ, by T and by L [1].
    real(wp), intent(out) :: by_trial
    real(wp), intent(out) :: by_limit

    real(wp) :: change, power, slope, spring, y
    integer :: i

    slid = 0.0_wp
    by_trial = 1.0_wp
    by_limit = 0.0_wp
    if (trial <= 0.0_wp) return
    power = 1.0_wp / self%rate_exponent
    spring = k * self%reference_velocity * dt
    y = (trial / spring)**self%rate_exponent
    if (limit * y > trial) y = trial / limit
    do i = 1, MAXIMUM_ITERATIONS
      slope = spring * power * y**(power - 1.0_wp) + limit
      change = (spring * y**power + limit * y - trial) / slope
      y = max(y - change, 0.0_wp)
      if (abs(change) <= epsilon(1.0_wp) * y) exit
    end do
    slope = spring * power * y**(power - 1.0_wp) + limit
    slid = y**power * self%reference_velocity * dt
    by_trial = limit / slope
    by_limit = y * (1.0_wp - by_trial)

  end subroutine slide_at_rate

end module swage_sliding_friction
