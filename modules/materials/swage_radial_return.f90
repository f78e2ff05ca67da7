!> The skeleton of every isotropic law with elasticity: trial stress, radial return, tangent.
!>
!> A law is a threshold \(R(\bar\varepsilon, T)\) and, when it depends on the rate, an overstress
!> \(\Phi\). With the trial deviator
!> \(s^{tr} = \mathrm{dev}\,\sigma_n + 2G\,\mathrm{dev}\,\Delta\varepsilon\), its equivalent
!> \(q^{tr} = \sqrt{\tfrac32 s^{tr}:s^{tr}}\) and the unknown increment \(x\) of the equivalent
!> plastic strain,
!> \[ f(x) = q - R(\bar\varepsilon_n + x, T) - \Phi(x, q) = 0, \quad q = q^{tr} - 3G x, \quad
!>    s = \theta s^{tr}, \quad \theta = q / q^{tr}, \]
!> and the consistent tangent, with \(H\) the rise of \(q^{tr}\) per unit of \(x\), is
!> \[ 2G \theta\, \mathbb P - 2G \bigl(3G / H - (1 - \theta)\bigr) n \otimes n, \quad
!>    n = s^{tr} / |s^{tr}|. \]
!> With kinematic hardening all this holds for the stress relative to the back stress, and \(q\)
!> falls by \((3G + C) x\); see [[swage_kinematic_hardening]].
!> Temperature is that of the end of the step. The search for x goes through all points together, so
!> that threshold and overstress are called once for all that still search.
!>
!> Source: J. C. Simo and T. J. R. Hughes, Computational Inelasticity (1998), chapter 3.
module swage_radial_return
  use swage_elasticity, only: elasticity_t
  use swage_finite, only: is_finite
  use swage_flow_stress, only: flow_batch_t, flow_stress_t
  use swage_kinds, only: wp
  use swage_kinematic_hardening, only: kinematic_hardening_t, KINEMATIC_STATE, put_back_stress, &
                                       take_back_stress
  use swage_material_law, only: material_law_t, PLASTIC_STATE, ROW_RATE, ROW_STRAIN
  use swage_overstress, only: overstress_batch_t, overstress_t
  use swage_point_batch, only: LANES, point_batch_t
  implicit none(type, external)
  private

  public :: radial_return_law_t, radial_return_create

  !> Enough for pure bisection of the widest bracket.
  integer, parameter :: MAX_ITERATIONS = 120

  !> From here on every second iteration is a bisection.
  integer, parameter :: PATIENCE = 15

  !> A stress outside the yield surface by less than this share lies on it: a step without strain
  !> that follows a plastic one is elastic, and so is the tangent that it starts from when the load
  !> turns back.
  real(wp), parameter :: ON_SURFACE = 1.0e-10_wp
  !> The increment is found when its relative change and the residual over the trial stress are
  !> below these. Either alone deceives: near \(q = 0\) the overstress of equation 3 is so steep
  !> that a step moves nothing.
  real(wp), parameter :: STEP_TOLERANCE = 1.0e-14_wp
  real(wp), parameter :: RESIDUAL_TOLERANCE = 1.0e-12_wp

  !> Ratio of the ends of a bracket beyond which it is cut by logarithms.
  real(wp), parameter :: DECADES = 10.0_wp

  !> Least θ of the bubble, so that its modulus stays positive.
  real(wp), parameter :: LEAST_RELAXATION = 1.0e-6_wp

  type, extends(material_law_t) :: radial_return_law_t
    private
    !> \(G\) [stress].
    real(wp) :: shear_modulus = 0.0_wp
    !> \(R\).
    class(flow_stress_t), allocatable :: threshold
    !> \(\Phi\); not allocated in a law that does not depend on the rate.
    class(overstress_t), allocatable :: overstress
    type(kinematic_hardening_t) :: kinematic
    !> \(3G + C\), what \(q\) loses per unit of \(x\) [stress].
    real(wp) :: stiffness = 0.0_wp
  contains
    procedure :: update => radial_return_update
  end type radial_return_law_t

  !> The search for the increment of one point.
  type :: search_t
    !> Place of the point among those of the call.
    integer :: place = 0
    !> \(q^{tr}\) [stress].
    real(wp) :: trial = 0.0_wp
    !> \(\bar\varepsilon_n\) [1], and kelvin [temperature].
    real(wp) :: strain_old = 0.0_wp
    real(wp) :: temperature = 0.0_wp
    !> Threshold at \(\bar\varepsilon_n\) [stress].
    real(wp) :: threshold_old = 0.0_wp
    !> Bracket, and \(x\) where \(f\) is wanted next [1].
    real(wp) :: low = 0.0_wp
    real(wp) :: high = 0.0_wp
    real(wp) :: x = 0.0_wp
    !> \(f\) of the last two evaluations [stress].
    real(wp) :: residual_last = huge(1.0_wp)
    real(wp) :: residual_before = huge(1.0_wp)
  end type search_t

  !> What the return of points leaves.
  type :: returns_t
    !> \(x\) [1].
    real(wp) :: increment(LANES) = 0.0_wp
    !> \(H = -f_x / f_{q^{tr}}\) [stress].
    real(wp) :: resistance(LANES) = 1.0_wp
    !> \(R + \Phi\) [stress].
    real(wp) :: flow_stress(LANES) = 0.0_wp
  end type returns_t

contains

  !> Make a law from valid parts.
  pure subroutine radial_return_create(label, elasticity, threshold, law, overstress, kinematic)
    !> Name of the law in messages.
    character(len=*), intent(in) :: label
    type(elasticity_t), intent(in) :: elasticity
    !> \(R\); positive without strain in a law that does not depend on the rate.
    class(flow_stress_t), intent(in) :: threshold
    type(radial_return_law_t), intent(out) :: law
    !> \(\Phi\); absent in a law that does not depend on the rate.
    class(overstress_t), intent(in), optional :: overstress
    !> Absent in a law without kinematic hardening.
    type(kinematic_hardening_t), intent(in), optional :: kinematic

    real(wp) :: slope

    law%label = label
    law%shear_modulus = elasticity%get_shear_modulus()
    allocate (law%threshold, source=threshold)
    if (present(overstress)) allocate (law%overstress, source=overstress)
    if (present(kinematic)) law%kinematic = kinematic
    law%stiffness = 3.0_wp * law%shear_modulus + law%kinematic%modulus
    call elasticity%describe(law)
    law%largest_strain = threshold%largest_strain
    law%largest_rate = threshold%largest_rate
    law%lowest_temperature = threshold%lowest_temperature
    law%highest_temperature = threshold%highest_temperature
    call threshold%evaluate(0.0_wp, threshold%reference_temperature, law%initial_flow_stress, &
                            slope)
    if (law%kinematic%modulus > 0.0_wp) then
      call law%publish_state(KINEMATIC_STATE)
    else
      call law%publish_state(PLASTIC_STATE)
    end if

  end subroutine radial_return_create

  !> See [[material_law_t:update]]. A point fails when its trial stress is not finite, and is left
  !> without stress, or when no increment is found, and is left with its trial stress.
  pure subroutine radial_return_update(self, batch, n_failed)
    class(radial_return_law_t), intent(in) :: self
    type(point_batch_t), intent(inout) :: batch
    integer, intent(out) :: n_failed

    integer :: first

    n_failed = 0
    do first = 1, batch%n_point, LANES
      call return_points(self, first, min(LANES, batch%n_point - first + 1), batch, n_failed)
    end do

  end subroutine radial_return_update

  !> Update up to `LANES` points.
  pure subroutine return_points(self, first, n, batch, n_failed)
    type(radial_return_law_t), intent(in) :: self
    !> First point, and how many.
    integer, intent(in) :: first, n
    type(point_batch_t), intent(inout) :: batch
    integer, intent(inout) :: n_failed

    type(flow_batch_t) :: flow
    type(returns_t) :: back
    type(search_t) :: search(LANES)
    real(wp) :: equivalent(LANES), trial(LANES, 6)
    integer :: i, n_search, p

    call find_trial(self, first, n, batch, trial, equivalent)
    flow%n_point = n
    do i = 1, n
      flow%strain(i) = batch%state_old(first + i - 1, ROW_STRAIN)
      flow%temperature(i) = batch%temperature_new(first + i - 1)
    end do
    call self%threshold%evaluate_points(flow)

    back%flow_stress(:n) = flow%stress(:n)
    n_search = 0
    do i = 1, n
      if (.not. is_finite(equivalent(i))) then
        ! Nothing may be computed with it
        trial(i, :) = 0.0_wp
        equivalent(i) = 0.0_wp
        n_failed = n_failed + 1
        call batch%fail(first + i - 1, 'the trial stress is not a finite number')
      else if (equivalent(i) > flow%stress(i) * (1.0_wp + ON_SURFACE)) then
        n_search = n_search + 1
        search(n_search) = search_t(place=i, trial=equivalent(i), strain_old=flow%strain(i), &
                                    temperature=flow%temperature(i), threshold_old=flow%stress(i))
      end if
    end do
    if (n_search > 0) then
      call find_increments(self, batch%dt, n_search, search, back)
      ! What still searches has found nothing
      do i = 1, n_search
        p = search(i)%place
        back%increment(p) = 0.0_wp
        back%resistance(p) = 1.0_wp
        back%flow_stress(p) = search(i)%threshold_old
        n_failed = n_failed + 1
        call batch%fail(first + p - 1, 'no plastic increment meets the yield condition')
      end do
    end if
    call set_results(self%shear_modulus, first, n, trial, equivalent, back, batch)
    if (self%kinematic%modulus > 0.0_wp) then
      call put_back_stress(self%kinematic, first, n, trial, equivalent, back%increment, batch)
    end if

  end subroutine return_points

  !> Trial deviator, without the back stress, and its equivalent stress.
  pure subroutine find_trial(self, first, n, batch, trial, equivalent)
    type(radial_return_law_t), intent(in) :: self
    integer, intent(in) :: first, n
    type(point_batch_t), intent(inout) :: batch
    real(wp), intent(out) :: trial(LANES, 6)
    real(wp), intent(out) :: equivalent(LANES)

    real(wp) :: mean, modulus
    integer :: i, k

    modulus = 2.0_wp * self%shear_modulus
    do k = 1, 6
      do i = 1, n
        trial(i, k) = batch%stress_old(first + i - 1, k) &
          + modulus * batch%strain_increment(first + i - 1, k)
      end do
    end do
    if (self%kinematic%modulus > 0.0_wp) call take_back_stress(first, n, batch, trial)
    do i = 1, n
      mean = (trial(i, 1) + trial(i, 2) + trial(i, 3)) / 3.0_wp
      trial(i, 1) = trial(i, 1) - mean
      trial(i, 2) = trial(i, 2) - mean
      trial(i, 3) = trial(i, 3) - mean
      equivalent(i) = sqrt(1.5_wp * (trial(i, 1)**2 + trial(i, 2)**2 + trial(i, 3)**2 &
                                     + trial(i, 4)**2 + trial(i, 5)**2 + trial(i, 6)**2))
    end do

  end subroutine find_trial

  !> Stress, tangent and history, from the increments.
  pure subroutine set_results(shear_modulus, first, n, trial, equivalent, back, batch)
    real(wp), intent(in) :: shear_modulus
    integer, intent(in) :: first, n
    real(wp), intent(in) :: trial(LANES, 6)
    real(wp), intent(in) :: equivalent(LANES)
    type(returns_t), intent(in) :: back
    type(point_batch_t), intent(inout) :: batch

    real(wp) :: loss(LANES), relaxation(LANES), size_of_trial
    integer :: i, k, last

    last = first + n - 1
    do i = 1, n
      size_of_trial = merge(equivalent(i), 1.0_wp, equivalent(i) > 0.0_wp)
      relaxation(i) = 1.0_wp - 3.0_wp * shear_modulus * back%increment(i) / size_of_trial
      ! Of the squared trial deviator; nothing is lost where nothing flows
      loss(i) = 3.0_wp * shear_modulus &
        * (3.0_wp * shear_modulus / back%resistance(i) - (1.0_wp - relaxation(i))) &
        / size_of_trial**2
      loss(i) = merge(loss(i), 0.0_wp, back%increment(i) > 0.0_wp)
    end do
    do k = 1, 6
      do i = 1, n
        batch%deviatoric_stress(first + i - 1, k) = relaxation(i) * trial(i, k)
        batch%tangent_direction(first + i - 1, k) = trial(i, k)
      end do
    end do
    batch%tangent_secant(first:last) = 2.0_wp * shear_modulus * relaxation(:n)
    batch%tangent_factor(first:last) = -loss(:n)
    batch%memory_modulus(first:last) = 2.0_wp * shear_modulus
    batch%flow_stress(first:last) = back%flow_stress(:n)
    batch%bubble_modulus(first:last) = 2.0_wp * shear_modulus &
      * max(relaxation(:n), LEAST_RELAXATION)
    batch%relaxation_factor(first:last) = relaxation(:n)
    batch%dissipated_power(first:last) = relaxation(:n) * equivalent(:n) * back%increment(:n) &
      / batch%dt
    batch%state_new(first:last, ROW_STRAIN) = batch%state_old(first:last, ROW_STRAIN) &
      + back%increment(:n)
    batch%state_new(first:last, ROW_RATE) = back%increment(:n) / batch%dt

  end subroutine set_results

  !> Solve \(f(x) = 0\) by Newton's method inside a bracket that only shrinks.
  !>
  !> The overstress, or a threshold that depends on the rate, is steep at rest and flat later, so
  !> the search starts on the steep side, from where Newton's method climbs without overshooting.
  pure subroutine find_increments(self, dt, n_search, search, back)
    type(radial_return_law_t), intent(in) :: self
    !> [time].
    real(wp), intent(in) :: dt
    !> Points above their threshold on entry, then those without a result.
    integer, intent(inout) :: n_search
    type(search_t), intent(inout) :: search(LANES)
    !> Set where an increment is found.
    type(returns_t), intent(inout) :: back

    type(flow_batch_t) :: flow
    type(overstress_batch_t) :: over
    real(wp) :: stiffness
    integer :: i, iteration, n_left
    logical :: done

    stiffness = self%stiffness
    call open_brackets(self, dt, n_search, search)
    over%dt = dt
    do iteration = 1, MAX_ITERATIONS

      flow%n_point = n_search
      do i = 1, n_search
        flow%strain(i) = search(i)%strain_old + search(i)%x
        flow%rate(i) = search(i)%x / dt
        flow%temperature(i) = search(i)%temperature
      end do
      call self%threshold%evaluate_points(flow)
      if (allocated(self%overstress)) then
        over%n_point = n_search
        do i = 1, n_search
          over%increment(i) = search(i)%x
          over%stress(i) = stress_at(search(i), stiffness)
          over%temperature(i) = search(i)%temperature
        end do
        call self%overstress%evaluate(over)
      end if

      n_left = 0
      do i = 1, n_search
        call advance(search(i), iteration, stiffness, flow%stress(i) + over%overstress(i), &
                     flow%by_strain(i) + flow%by_rate(i) / dt + over%by_increment(i), &
                     over%by_stress(i), back, done)
        if (done) cycle
        n_left = n_left + 1
        search(n_left) = search(i)
      end do
      n_search = n_left
      if (n_search == 0) exit

    end do

  end subroutine find_increments

  !> First increments to try, and brackets: a threshold that hardens ends the search before one
  !> that stays.
  pure subroutine open_brackets(self, dt, n_search, search)
    type(radial_return_law_t), intent(in) :: self
    real(wp), intent(in) :: dt
    integer, intent(in) :: n_search
    type(search_t), intent(inout) :: search(LANES)

    type(flow_batch_t) :: flow
    real(wp) :: starting_rate, stiffness
    integer :: i

    stiffness = self%stiffness
    starting_rate = self%threshold%starting_rate
    if (allocated(self%overstress)) starting_rate = self%overstress%starting_rate
    flow%n_point = n_search
    do i = 1, n_search
      search(i)%high = (search(i)%trial - search(i)%threshold_old) / stiffness
      flow%strain(i) = search(i)%strain_old + search(i)%high
      flow%rate(i) = search(i)%high / dt
      flow%temperature(i) = search(i)%temperature
    end do
    call self%threshold%evaluate_points(flow)
    do i = 1, n_search
      if (flow%stress(i) < search(i)%threshold_old) search(i)%high = search(i)%trial / stiffness
      search(i)%x = min(starting_rate * dt, 0.5_wp * search(i)%high)
    end do

  end subroutine open_brackets

  !> \(q\) at the increment of a search, kept positive.
  pure function stress_at(search, stiffness) result(stress)
    type(search_t), intent(in) :: search
    !> \(3G + C\) [stress].
    real(wp), intent(in) :: stiffness
    real(wp) :: stress

    stress = max(search%trial - stiffness * search%x, epsilon(1.0_wp) * search%trial)

  end function stress_at

  !> One step of a search.
  !>
  !> A bisection replaces a step that leaves the bracket or stands still, one after two that have
  !> not halved the residual, and, in a long search, every second one: it must not creep.
  pure subroutine advance(search, iteration, stiffness, flow_stress, slope, by_stress, back, done)
    type(search_t), intent(inout) :: search
    integer, intent(in) :: iteration
    !> \(3G + C\) [stress].
    real(wp), intent(in) :: stiffness
    !> \(R + \Phi\) [stress], its derivatives by the increment [stress] and the stress [1].
    real(wp), intent(in) :: flow_stress
    real(wp), intent(in) :: slope
    real(wp), intent(in) :: by_stress
    type(returns_t), intent(inout) :: back
    !> True when the increment is found, and stands in `back`.
    logical, intent(out) :: done

    real(wp) :: next, residual, resistance

    associate (x => search%x, low => search%low, high => search%high)
      residual = stress_at(search, stiffness) - flow_stress
      resistance = stiffness + slope / (1.0_wp - by_stress)
      next = x
      done = abs(residual) <= epsilon(1.0_wp) * search%trial .and. resistance > 0.0_wp
      if (.not. done) then
        if (residual > 0.0_wp) then
          low = x
        else
          high = x
        end if
        next = high
        if (resistance > 0.0_wp) then
          next = x + residual / (resistance * (1.0_wp - by_stress))
          ! The end of the bracket is the root of perfect plasticity, and rounding may pass it
          if (next > high .and. next <= high * (1.0_wp + 1.0e-12_wp)) next = high
          done = abs(next - x) <= STEP_TOLERANCE * x &
            .and. abs(residual) <= RESIDUAL_TOLERANCE * search%trial
        end if
      end if
      if (done) then
        back%increment(search%place) = next
        back%resistance(search%place) = resistance
        back%flow_stress(search%place) = flow_stress
        return
      end if

      if (resistance <= 0.0_wp .or. .not. (next > low .and. next <= high) .or. &
          abs(next - x) <= STEP_TOLERANCE * x .or. &
          abs(residual) > 0.5_wp * abs(search%residual_before) .or. &
          (iteration > PATIENCE .and. mod(iteration, 2) == 0)) then
        next = middle(low, high, search%trial / stiffness)
      end if
      search%residual_before = search%residual_last
      search%residual_last = residual
      x = next
    end associate

  end subroutine advance

  !> A point between two increments: in the middle of their logarithms while they are decades apart,
  !> or else of those of the elastic strains left, \(x_{end} - x\), or else of themselves.
  pure function middle(low, high, whole) result(x)
    real(wp), intent(in) :: low
    real(wp), intent(in) :: high
    !> \(x_{end}\), the increment that leaves no stress.
    real(wp), intent(in) :: whole
    real(wp) :: x

    real(wp) :: rest_high, rest_low

    rest_low = whole - low
    rest_high = max(whole - high, epsilon(1.0_wp) * whole)
    if (low > 0.0_wp .and. high > DECADES * low) then
      x = sqrt(low) * sqrt(high)
    else if (rest_low > DECADES * rest_high) then
      x = whole - sqrt(rest_low) * sqrt(rest_high)
    else
      x = 0.5_wp * (low + high)
    end if

  end function middle

end module swage_radial_return
