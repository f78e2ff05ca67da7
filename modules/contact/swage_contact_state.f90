!> The conditions of one contact and what they decide by: the same for rigid tools and for bodies.
!>
!> A condition is one place of a surface, most often a node, that may not enter what is opposite. It
!> is active, and carries the pressure `multiplier + penalty * penetration`, as long as that is
!> compression.
!>
!> Multipliers are 0 under the penalty alone. In the augmented Lagrangian (Uzawa; Simo and Laursen,
!> Computers and Structures 42, 1992) each one takes over the pressure whenever the iterations have
!> converged, so that the penetration goes to 0 with a penalty of any size; bonds of friction
!> likewise take over the traction, and their elastic slip goes to 0.
!>
!> Where the conditions are no more than multipliers can satisfy, these are unknowns of the Newton
!> iterations instead: each correction of the places comes with one of the multipliers that closes
!> what the active conditions leave open. With Lagrange multipliers the iterations end when nothing
!> is open, whatever the penalty, which then only decides, with the multiplier, what is active: a
!> primal-dual active set (Hintermüller, Ito and Kunisch, SIAM Journal on Optimization 13, 2002).
!>
!> A condition whose state alternates during the iterations is held in it until the others have
!> converged; if it contradicts its state then, it changes it, and the iterations go on.
module swage_contact_state
  use swage_friction, only: friction_law_t
  use swage_kinds, only: gp, wp
  use swage_sliding_inertia, only: sliding_inertia_create, sliding_inertia_t
  use swage_snapshot, only: OF_SOME_NODES, snapshot_t
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: contact_census_t, contact_state_t, contact_state_create, contact_work_t, enforcement_t
  public :: CENSUS_ITERATIONS
  public :: PENALTY, AUGMENTED_LAGRANGIAN, LAGRANGE, ENFORCEMENT_NAMES

  integer, parameter :: PENALTY = 1, AUGMENTED_LAGRANGIAN = 2, LAGRANGE = 3
  !> What the key `enforcement` calls them.
  character(len=*), parameter :: ENFORCEMENT_NAMES(*) = &
    [character(len=20) :: 'penalty', 'augmented_lagrangian', 'lagrange']

  !> A place this close to what is opposite, by its cell size, is in contact from the start when the
  !> contact cannot separate.
  real(wp), parameter :: TOUCHING = 1.0e-6_wp
  !> A place drawn on what is opposite is in contact although rounding may have put it outside, by
  !> this share of its cell size: a body that rests on a tool is held from the first iteration.
  real(wp), parameter :: ROUNDING = 1.0e-12_wp
  !> Changes of state during one step that a condition may make before it is held.
  integer, parameter :: FREE_CHANGES = 4
  !> Times that held conditions may be found wrong before the step is given up.
  integer, parameter :: MAXIMUM_RELEASES = 20
  !> An augmentation should leave at most this share of the penetration, or the penalty grows by
  !> this factor, up to so many times that of the start.
  real(wp), parameter :: EXPECTED_SHARE = 0.25_wp
  real(wp), parameter :: PENALTY_GROWTH = 5.0_wp
  real(wp), parameter :: LARGEST_GROWTH = 25.0_wp

  !> Iterations in which a change of state is of late.
  integer, parameter :: CENSUS_ITERATIONS = 5

  !> How a contact stands in the midst of iterations.
  type :: contact_census_t
    !> Conditions that touch, that changed their state of late, and all: of this rank, to be summed,
    !> and of all ranks.
    integer(gp) :: counts(3) = 0_gp
    integer :: n_active = 0
    integer :: n_changed = 0
    integer :: n = 0
    !> Deepest condition of this rank, 0 for none, and its penetration by the cell size [1].
    integer :: deepest = 0
    real(wp) :: share = 0.0_wp
    !> Positive when it was inside before the first step.
    real(wp) :: starts_inside = 0.0_wp
  end type contact_census_t

  !> How strictly a contact is enforced.
  type :: enforcement_t
    !> `PENALTY`, `AUGMENTED_LAGRANGIAN` or `LAGRANGE`.
    integer :: kind = PENALTY
    !> Largest penetration, by the cell size, that ends the augmentations [1].
    real(wp) :: penetration_tolerance = 1.0e-4_wp
    !> Largest change of pressure or bond in an augmentation, by the largest pressure [1].
    real(wp) :: multiplier_tolerance = 1.0e-2_wp
    !> Augmentations of a step after which it is taken as it is.
    integer :: maximum_augmentations = 20
    !> Multipliers are corrected with the places, for the caller to do.
    logical :: within_newton = .false.
    !> Stiffness of a cell by the penalty: by it counts what multipliers have not closed [1].
    real(wp) :: cell_share = 1.0_wp
  end type enforcement_t

  !> What a contact does during a step, by the trapezoidal rule: with the mean of the forces at its
  !> ends. The sum of the four is the work of the tool, force times motion, less that on the body;
  !> between bodies, the work that the contact takes from both.
  type :: contact_work_t
    !> Stored in penalty and bond [energy].
    real(wp) :: stored = 0.0_wp
    !> Work of friction against slip [energy].
    real(wp) :: friction = 0.0_wp
    !> Work against the inertia of sliding nodes [energy].
    real(wp) :: inertia = 0.0_wp
    !> What force times motion counts too much, for it takes the force to change halfway [energy]:
    !> nodes that do not touch yet, or no longer, and nodes that pass an edge of the tool.
    real(wp) :: excess = 0.0_wp
  end type contact_work_t

  !> How conditions stood at the end of an accepted step; a failed one leaves no trace.
  type :: standing_t
    real(wp), allocatable :: area(:), penetration(:), pressure(:)
    logical, allocatable :: active(:)
  end type standing_t

  !> Arrays have one entry a condition, vectors the shape (3, n_condition).
  type :: contact_state_t
    character(len=:), allocatable :: name
    class(friction_law_t), allocatable :: friction
    !> True when contact may end.
    logical :: separation = .true.
    !> True when conditions hold in all directions, from the start and for good; `slip` is then the
    !> whole distance along the surface.
    logical :: is_tied = .false.
    type(enforcement_t) :: enforcement
    !> Numbers that are unique over the ranks.
    integer(gp), allocatable :: tag(:)
    !> Cell size [length].
    real(wp), allocatable :: size(:)
    !> Pressure by penetration, and tangential traction by slip where friction bonds
    !> [stress/length].
    real(wp), allocatable :: penalty(:), tangential_stiffness(:)
    !> Area [length^2], and flow stress of the material [stress], of the step.
    real(wp), allocatable :: area(:), flow_stress(:)
    !> At the last evaluation: penetration [length], pressure [stress], positive in compression.
    real(wp), allocatable :: penetration(:), pressure(:)
    !> Part of the pressure that does not depend on the penetration, at the start of the step and
    !> now [stress].
    real(wp), allocatable :: multiplier_old(:), multiplier(:)
    !> The last correction of the multipliers, and what it starts from [stress].
    real(wp), allocatable :: multiplier_correction(:), multiplier_base(:)
    !> The same of bonds [stress]; and true where one holds at the last evaluation.
    real(wp), allocatable :: bond_correction(:, :), bond_base(:, :)
    logical, allocatable :: sticks(:)
    !> True where nothing that could open or close the condition is free to move.
    logical, allocatable :: stuck(:)
    !> Friction on the body at the start of the step and at the last evaluation [stress].
    real(wp), allocatable :: traction_old(:, :), traction(:, :)
    !> At the start of the step: penetration [length] and normal; pressure and friction times area
    !> [force].
    real(wp), allocatable :: penetration_old(:), normal_old(:, :), load_old(:), shear_old(:, :)
    !> Traction that bonds start from, as it was at the start of the step, and how much the last
    !> evaluation changed it [stress].
    real(wp), allocatable :: bond(:, :), bond_change(:)
    !> In contact at the last evaluation; bonded since an earlier step where it cannot separate.
    logical, allocatable :: active(:), bonded(:)
    !> Area, penetration, pressure and contact at the start of the step.
    type(standing_t) :: accepted
    !> Changes of state during the step, the state before the last correction, and whether the
    !> condition is held in its state.
    integer, allocatable :: n_change(:)
    logical, allocatable :: was_active(:), held(:)
    !> Iterations of the step, and the one in which each condition changed its state last, 0 for
    !> none.
    integer :: n_iteration = 0
    integer, allocatable :: changed_at(:)
    !> True once a step has been accepted.
    logical :: has_stepped = .false.
    !> True for a condition in contact at the start of the step; it stays so until the iterations
    !> have converged for the first time: then `keeping` ends when one of them pulls.
    logical, allocatable :: touched(:)
    logical :: keeping = .true.
    !> Slip of the step at the last evaluation, and slip and friction before the last correction
    !> [length], [stress].
    real(wp), allocatable :: slip(:, :), slip_was(:, :), traction_was(:, :)
    !> Friction has turned about since then.
    logical, allocatable :: turned_about(:)
    !> Secant of friction at the last evaluation, and the largest one of all shares of the last
    !> corrections, taken or not, for which it had turned about; 0 where there is none
    !> [stress/length].
    real(wp), allocatable :: secant(:), turn_secant(:)
    !> Resistance to a change of the sliding rate.
    type(sliding_inertia_t) :: inertia
    !> Factor on the penalties of the start, at the start of the step and now [1].
    real(wp) :: growth_old = 1.0_wp
    real(wp) :: growth = 1.0_wp
    !> Augmentations of the step, releases of held conditions, and the penetration by the cell size
    !> that the last augmentation met [1].
    integer :: n_augmentation = 0
    integer :: n_release = 0
    real(wp) :: penetration_before = huge(1.0_wp)
    !> Sum of the squared forces of this rank, for the size of the problem's forces.
    real(wp) :: force_square = 0.0_wp
  contains
    !> Forget the iterations of the last step.
    procedure :: renew => contact_state_renew
    !> Take what a condition finds opposite at the start of the step.
    procedure :: meet => contact_state_meet
    !> Whether a condition is in contact at a given penetration.
    procedure :: decide => contact_state_decide
    !> Prepare the multipliers for a correction, and take a share of it.
    procedure :: start_correction => contact_state_start_correction
    procedure :: move_multipliers => contact_state_move_multipliers
    !> What closes a condition, and what ends the slip of a bond.
    procedure :: stiffness_of => contact_state_stiffness_of
    procedure :: shear_stiffness_of => contact_state_shear_stiffness_of
    !> What is left open, as a force.
    procedure :: open_force_square => contact_state_open_force_square
    !> Once an iteration: hold conditions that alternate between contact and none.
    procedure :: hold => contact_state_hold
    !> Take the secant where friction has turned about.
    procedure :: turn_about => contact_state_turn_about
    !> How the conditions of this rank stand.
    procedure :: take_census => contact_state_take_census
    !> What `judge` decides by, of this rank's conditions.
    procedure :: measure => contact_state_measure
    !> Judge converged iterations: go on with other multipliers or states, or be done.
    procedure :: judge => contact_state_judge
    !> Add the energies of one condition in the step.
    procedure :: add_work => contact_state_add_work
    !> Make the last evaluation the start of the next step.
    procedure :: accept => contact_state_accept
    !> Forget the step.
    procedure :: reject => contact_state_reject
    !> Put the conditions of some nodes after the last accepted step into a snapshot, and take them
    !> back; and what all conditions share.
    procedure :: save_conditions => contact_state_save_conditions
    procedure :: load_conditions => contact_state_load_conditions
    procedure :: save_common => contact_state_save_common
    procedure :: load_common => contact_state_load_common
  end type contact_state_t

contains

  !> Conditions without area yet, that have not touched.
  subroutine contact_state_create(name, friction, separation, tag, size_of_cell, penalties, &
                                  tangential_stiffness, enforcement, inertia, state)
    character(len=*), intent(in) :: name
    class(friction_law_t), intent(in) :: friction
    logical, intent(in) :: separation
    !> A positive number of each condition, unique over the ranks; shape (n_condition).
    integer(gp), intent(in) :: tag(:)
    !> [length]; shape of `tag`.
    real(wp), intent(in) :: size_of_cell(:)
    !> [stress/length]; shape of `tag`.
    real(wp), intent(in) :: penalties(:), tangential_stiffness(:)
    type(enforcement_t), intent(in) :: enforcement
    !> Resistance to a change of slip, by the flow stress on the cell size [1].
    real(wp), intent(in) :: inertia
    type(contact_state_t), intent(out) :: state

    integer :: n

    state%name = name
    allocate (state%friction, source=friction)
    state%separation = separation
    allocate (state%tag, source=tag)
    allocate (state%size, source=size_of_cell)
    allocate (state%penalty, source=penalties)
    allocate (state%tangential_stiffness, source=tangential_stiffness)
    n = ubound(tag, 1)
    state%enforcement = enforcement
    allocate (state%area(n), state%flow_stress(n), state%penetration(n), state%pressure(n), &
              state%multiplier_old(n), state%multiplier(n), state%multiplier_correction(n), &
              state%multiplier_base(n), state%bond_change(n), &
              state%penetration_old(n), state%load_old(n), state%secant(n), state%turn_secant(n), &
              source=0.0_wp)
    allocate (state%traction_old(3, n), state%traction(3, n), state%shear_old(3, n), &
              state%normal_old(3, n), state%bond(3, n), state%slip(3, n), state%slip_was(3, n), &
              state%traction_was(3, n), state%bond_correction(3, n), state%bond_base(3, n), &
              source=0.0_wp)
    allocate (state%active(n), state%bonded(n), state%was_active(n), state%held(n), &
              state%touched(n), state%turned_about(n), state%stuck(n), state%sticks(n), &
              source=.false.)
    allocate (state%n_change(n), state%changed_at(n), source=0)
    call sliding_inertia_create(inertia, n, state%inertia)
    call remember_standing(state)

  end subroutine contact_state_create

  pure subroutine contact_state_renew(self)
    class(contact_state_t), intent(inout) :: self

    self%multiplier = self%multiplier_old
    self%bond = self%traction_old
    self%growth = self%growth_old
    self%held = .false.
    self%keeping = .true.
    self%traction_was = 0.0_wp
    self%turn_secant = 0.0_wp
    self%was_active = self%active
    self%n_change = 0
    self%n_iteration = 0
    self%changed_at = 0
    self%n_augmentation = 0
    self%n_release = 0
    self%penetration_before = huge(1.0_wp)

  end subroutine contact_state_renew

  !> It says whether a contact that cannot separate exists from the start.
  pure subroutine contact_state_meet(self, i, penetration, normal)
    class(contact_state_t), intent(inout) :: self
    !> Place of the condition.
    integer, intent(in) :: i
    !> [length]
    real(wp), intent(in) :: penetration
    real(wp), intent(in) :: normal(3)

    self%penetration_old(i) = penetration
    self%normal_old(:, i) = normal
    self%touched(i) = self%multiplier(i) > 0.0_wp .or. penetration > 0.0_wp
    if (self%separation) return
    self%bonded(i) = self%bonded(i) .or. self%is_tied &
      .or. penetration > -TOUCHING * self%size(i)

  end subroutine contact_state_meet

  !> What follows from contact is left at that of none.
  pure subroutine contact_state_decide(self, i, penetration)
    class(contact_state_t), intent(inout) :: self
    integer, intent(in) :: i
    !> [length]
    real(wp), intent(in) :: penetration

    self%penetration(i) = penetration
    if (.not. self%held(i)) then
      self%active(i) = self%bonded(i) .or. (self%keeping .and. self%touched(i)) &
        .or. is_pressed(self, i)
    end if
    self%pressure(i) = 0.0_wp
    self%traction(:, i) = 0.0_wp
    self%bond_change(i) = 0.0_wp
    self%turned_about(i) = .false.

  end subroutine contact_state_decide

  !> True where the pressure is compression.
  pure function is_pressed(self, i) result(pressed)
    class(contact_state_t), intent(in) :: self
    integer, intent(in) :: i
    logical :: pressed

    real(wp) :: stiffness

    stiffness = self%growth * self%penalty(i)
    pressed = self%multiplier(i) &
      + stiffness * (self%penetration(i) + ROUNDING * self%size(i)) > 0.0_wp

  end function is_pressed

  !> A condition that is not active has no multiplier.
  pure subroutine contact_state_start_correction(self)
    class(contact_state_t), intent(inout) :: self

    self%multiplier_correction = 0.0_wp
    self%bond_correction = 0.0_wp
    if (.not. self%enforcement%within_newton) return
    self%bond_base = self%bond
    where (.not. self%active) self%multiplier = 0.0_wp
    self%multiplier_base = self%multiplier

  end subroutine contact_state_start_correction

  pure subroutine contact_state_move_multipliers(self, step_length)
    class(contact_state_t), intent(inout) :: self
    !> 1 for the whole correction.
    real(wp), intent(in) :: step_length

    if (.not. self%enforcement%within_newton) return
    self%multiplier = self%multiplier_base + step_length * self%multiplier_correction
    self%bond = self%bond_base + step_length * self%bond_correction

  end subroutine contact_state_move_multipliers

  !> Zero where multipliers are not corrected with the places.
  pure function contact_state_stiffness_of(self, i) result(stiffness)
    class(contact_state_t), intent(in) :: self
    integer, intent(in) :: i
    !> [force/length]
    real(wp) :: stiffness

    stiffness = 0.0_wp
    if (.not. self%enforcement%within_newton) return
    if (self%active(i) .and. .not. self%stuck(i)) then
      stiffness = self%growth * self%penalty(i) * self%area(i)
    end if

  end function contact_state_stiffness_of

  !> Zero where there is no bond that holds.
  pure function contact_state_shear_stiffness_of(self, i) result(stiffness)
    class(contact_state_t), intent(in) :: self
    integer, intent(in) :: i
    !> [force/length]
    real(wp) :: stiffness

    stiffness = 0.0_wp
    if (.not. self%enforcement%within_newton) return
    if (self%active(i) .and. self%sticks(i)) then
      stiffness = self%growth * self%tangential_stiffness(i) * self%area(i)
    end if

  end function contact_state_shear_stiffness_of

  !> Sum over this rank's conditions of the squared forces that cells would make of penetrations and
  !> gaps where Lagrange multipliers shall leave none.
  pure function contact_state_open_force_square(self) result(total)
    class(contact_state_t), intent(in) :: self
    real(wp) :: total

    integer :: i

    total = 0.0_wp
    if (self%enforcement%kind /= LAGRANGE) return
    do i = 1, ubound(self%tag, 1)
      total = total + (self%stiffness_of(i) * self%penetration(i))**2
    end do
    total = total * (self%enforcement%cell_share / self%growth)**2

  end function contact_state_open_force_square

  pure subroutine contact_state_hold(self, keeps_turns)
    class(contact_state_t), intent(inout) :: self
    !> True when the secants of turns shall last for one more correction.
    logical, intent(in) :: keeps_turns

    integer :: i

    self%n_iteration = self%n_iteration + 1
    do i = 1, ubound(self%tag, 1)
      if (self%active(i) .neqv. self%was_active(i)) then
        self%n_change(i) = self%n_change(i) + 1
        self%changed_at(i) = self%n_iteration
      end if
      self%was_active(i) = self%active(i)
      if (self%n_change(i) > FREE_CHANGES) self%held(i) = .true.
    end do
    self%slip_was = self%slip
    self%traction_was = self%traction
    if (.not. keeps_turns) self%turn_secant = 0.0_wp

  end subroutine contact_state_hold

  !> Take the secant where friction has turned about since the last correction: it leads to where
  !> friction vanishes.
  pure subroutine contact_state_turn_about(self, i, secant)
    class(contact_state_t), intent(inout) :: self
    !> Place of the condition, whose slip and traction are those of the present iterate.
    integer, intent(in) :: i
    !> That of the friction law; replaced by the one of the turn where there is one
    !> [stress/length].
    real(wp), intent(inout) :: secant

    real(wp) :: way

    self%turned_about(i) = dot_product(self%traction(:, i), self%traction_was(:, i)) < 0.0_wp
    if (self%turned_about(i)) then
      way = max(norm2(self%slip(:, i) - self%slip_was(:, i)), tiny(1.0_wp))
      secant = norm2(self%traction(:, i) - self%traction_was(:, i)) / way
      self%turn_secant(i) = max(self%turn_secant(i), secant)
    end if
    self%secant(i) = secant

  end subroutine contact_state_turn_about

  !> The first iteration finds contact where there was none: that is no change of late.
  pure subroutine contact_state_take_census(self, census)
    class(contact_state_t), intent(in) :: self
    type(contact_census_t), intent(out) :: census

    real(wp) :: share
    integer :: i

    do i = 1, ubound(self%tag, 1)
      if (self%active(i)) census%counts(1) = census%counts(1) + 1_gp
      if (self%changed_at(i) > max(1, self%n_iteration - CENSUS_ITERATIONS)) then
        census%counts(2) = census%counts(2) + 1_gp
      end if
      share = self%penetration(i) / self%size(i)
      if (.not. self%active(i) .or. share <= census%share) cycle
      census%share = share
      census%deepest = i
      census%starts_inside = 0.0_wp
      if (.not. self%has_stepped) then
        census%starts_inside = max(self%penetration_old(i) - 0.5_wp * self%penetration(i), 0.0_wp)
      end if
    end do
    census%counts(3) = ubound(self%tag, 1, gp)

  end subroutine contact_state_take_census

  !> Maxima over this rank's conditions, to be made those of all ranks.
  pure subroutine contact_state_measure(self, measures)
    class(contact_state_t), intent(in) :: self
    !> Largest penetration or gap of a condition that is pressed, by its cell size [1]; largest
    !> change of multipliers and bonds that an augmentation would make; largest pressure, of tied
    !> surfaces or traction along them [stress];
    !> the precedence of the first held condition that contradicts its state, 0 when there is none.
    real(wp), intent(out) :: measures(4)

    integer :: i

    measures = 0.0_wp
    do i = 1, ubound(self%tag, 1)
      if (self%active(i) .and. .not. self%stuck(i)) then
        measures(1) = max(measures(1), abs(self%penetration(i)) / self%size(i))
        if (self%is_tied) then
          measures(1) = max(measures(1), norm2(self%slip(:, i)) / self%size(i))
          measures(3) = max(measures(3), norm2(self%traction(:, i)))
        end if
      end if
      measures(2) = max(measures(2), self%bond_change(i))
      if (.not. self%stuck(i)) then
        measures(2) = max(measures(2), abs(self%pressure(i) - self%multiplier(i)))
      end if
      measures(3) = max(measures(3), abs(self%pressure(i)))
      if (contradicts(self, i)) measures(4) = max(measures(4), precedence(self%tag(i)))
    end do

  end subroutine contact_state_measure

  !> Positive, larger for smaller numbers.
  elemental function precedence(tag)
    integer(gp), intent(in) :: tag
    real(wp) :: precedence

    precedence = 2.0_wp**digits(1.0_wp) - real(tag, wp)

  end function precedence

  !> True for a condition that is held in a state that is not its own.
  pure function contradicts(self, i) result(wrong)
    class(contact_state_t), intent(in) :: self
    integer, intent(in) :: i
    logical :: wrong

    wrong = .false.
    if (.not. (self%held(i) .or. (self%keeping .and. self%touched(i)))) return
    if (self%bonded(i)) return
    wrong = self%active(i) .neqv. is_pressed(self, i)

  end function contradicts

  !> Held conditions that contradict their state change it all at once; from the second time on the
  !> first one alone, in a fixed order, which cannot cycle where the whole problem has one solution
  !> (K. G. Murty, Opsearch 11, 1974).
  pure subroutine contact_state_judge(self, measures, done, gives_up, augmented)
    class(contact_state_t), intent(inout) :: self
    !> Of [[contact_state_t:measure]], maxima over all ranks.
    real(wp), intent(in) :: measures(4)
    !> False when the iterations must go on.
    logical, intent(out) :: done
    !> True when conditions were found wrong too often: the step must be cut.
    logical, intent(out) :: gives_up
    !> True when multipliers have taken over the pressure, or will do so in the next correction:
    !> bonds are still to take over the traction, turned back to the start of the step.
    logical, intent(out) :: augmented

    integer :: i

    done = .true.
    gives_up = .false.
    augmented = .false.
    if (measures(4) > 0.0_wp) then
      done = .false.
      if (self%keeping) then
        self%keeping = .false.
        return
      end if
      self%n_release = self%n_release + 1
      gives_up = self%n_release > MAXIMUM_RELEASES
      do i = 1, ubound(self%tag, 1)
        if (.not. contradicts(self, i)) cycle
        if (self%n_release > 1 .and. precedence(self%tag(i)) < measures(4)) cycle
        self%active(i) = .not. self%active(i)
        self%was_active(i) = self%active(i)
      end do
      return
    end if

    associate (rule => self%enforcement)
      if (rule%kind == PENALTY) return
      done = measures(1) <= rule%penetration_tolerance .and. &
        measures(2) <= rule%multiplier_tolerance * measures(3)
      if (done .or. self%n_augmentation >= rule%maximum_augmentations) then
        done = .true.
        return
      end if
      self%n_augmentation = self%n_augmentation + 1
      augmented = .true.
      if (rule%within_newton) then
        ! The next correction knows the multipliers better, and bonds need not change with them
        augmented = measures(2) > rule%multiplier_tolerance * measures(3)
        return
      end if
      self%multiplier = self%pressure
      if (measures(1) > rule%penetration_tolerance &
          .and. measures(1) > EXPECTED_SHARE * self%penetration_before) then
        self%growth = min(self%growth * PENALTY_GROWTH, LARGEST_GROWTH)
      end if
      self%penetration_before = measures(1)
    end associate

  end subroutine contact_state_judge

  !> By the trapezoidal rule.
  pure subroutine contact_state_add_work(self, i, turn, slip, pressed, work)
    class(contact_state_t), intent(in) :: self
    integer, intent(in) :: i
    !> How what is opposite turns in the step.
    real(wp), intent(in) :: turn(3, 3)
    !> Motion of the body past it in the step [length].
    real(wp), intent(in) :: slip(3)
    !> What the penalty stores [energy].
    real(wp), intent(out) :: pressed
    !> Without its excess.
    type(contact_work_t), intent(inout) :: work

    real(wp) :: bond(3), depth, load, load_new, shear(3), springing

    ! The spring is as long as the penetration while there is contact, outside it has none
    depth = self%penetration(i)
    if (.not. self%active(i)) depth = max(depth, 0.0_wp)
    if (abs(self%load_old(i)) > 0.0_wp) then
      depth = depth - self%penetration_old(i)
    else
      depth = depth - max(self%penetration_old(i), 0.0_wp)
    end if
    load_new = self%area(i) * self%pressure(i)
    load = 0.5_wp * (self%load_old(i) + load_new)
    pressed = load * depth

    shear = 0.5_wp * (matmul(turn, self%shear_old(:, i)) + self%area(i) * self%traction(:, i))
    springing = 0.0_wp
    if (self%friction%has_history .and. self%tangential_stiffness(i) > 0.0_wp) then
      bond = matmul(turn, self%bond(:, i))
      springing = dot_product(shear, self%traction(:, i) - bond) &
        / (self%growth * self%tangential_stiffness(i))
    end if
    work%stored = work%stored + pressed + springing
    work%friction = work%friction - dot_product(shear, slip) - springing
    work%inertia = work%inertia + self%inertia%work(i, self%area(i), slip)

  end subroutine contact_state_add_work

  subroutine contact_state_accept(self)
    class(contact_state_t), intent(inout) :: self

    call remember_forces(self)
    call self%inertia%accept(self%area, self%active .and. norm2(self%traction, dim=1) > 0.0_wp, &
                             self%slip)
    self%traction_old = self%traction
    if (self%enforcement%kind /= PENALTY) then
      self%multiplier_old = self%pressure
      ! What is open counts once
      if (self%enforcement%within_newton) self%multiplier_old = self%multiplier
      where (.not. self%active .or. self%stuck) self%multiplier_old = 0.0_wp
    end if
    self%growth_old = self%growth
    self%has_stepped = .true.
    if (.not. self%separation) self%bonded = self%bonded .or. self%active
    call remember_standing(self)

  end subroutine contact_state_accept

  subroutine contact_state_reject(self)
    class(contact_state_t), intent(inout) :: self

    self%area = self%accepted%area
    self%penetration = self%accepted%penetration
    self%pressure = self%accepted%pressure
    self%active = self%accepted%active
    self%traction = self%traction_old

  end subroutine contact_state_reject

  pure subroutine remember_standing(self)
    class(contact_state_t), intent(inout) :: self

    self%accepted%area = self%area
    self%accepted%penetration = self%penetration
    self%accepted%pressure = self%pressure
    self%accepted%active = self%active

  end subroutine remember_standing

  !> Make the forces of the last evaluation those of the start of the next step.
  pure subroutine remember_forces(self)
    class(contact_state_t), intent(inout) :: self

    integer :: i

    self%traction_old = self%traction
    self%load_old = self%area * self%pressure
    do i = 1, ubound(self%tag, 1)
      self%shear_old(:, i) = self%area(i) * self%traction(:, i)
    end do

  end subroutine remember_forces

  subroutine contact_state_save_conditions(self, title, first, node, snapshot)
    class(contact_state_t), intent(in) :: self
    !> What the names of the arrays begin with.
    character(len=*), intent(in) :: title
    !> Place of the condition of the first node; those of the others follow.
    integer, intent(in) :: first
    !> Of the mesh, one entry a condition.
    integer, intent(in) :: node(:)
    type(snapshot_t), intent(inout) :: snapshot

    integer :: last

    last = first + ubound(node, 1) - 1
    call snapshot%put(title//'bonded', self%bonded(first:last), OF_SOME_NODES, node)
    associate (now => self%accepted)
      call snapshot%put(title//'active', now%active(first:last), OF_SOME_NODES, node)
      call snapshot%put(title//'area', now%area(first:last), OF_SOME_NODES, node)
      call snapshot%put(title//'penetration', now%penetration(first:last), OF_SOME_NODES, node)
      call snapshot%put(title//'pressure', now%pressure(first:last), OF_SOME_NODES, node)
    end associate
    call snapshot%put(title//'traction', self%traction_old(:, first:last), OF_SOME_NODES, node)
    call snapshot%put(title//'multiplier', self%multiplier_old(first:last), OF_SOME_NODES, node)

  end subroutine contact_state_save_conditions

  subroutine contact_state_load_conditions(self, title, first, node, snapshot, status)
    class(contact_state_t), intent(inout) :: self
    character(len=*), intent(in) :: title
    integer, intent(in) :: first
    integer, intent(in) :: node(:)
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` on this rank when something is missing.
    type(status_t), intent(inout) :: status

    integer :: last

    last = first + ubound(node, 1) - 1
    call snapshot%get(title//'bonded', self%bonded(first:last), status, OF_SOME_NODES, node)
    call snapshot%get(title//'active', self%active(first:last), status, OF_SOME_NODES, node)
    call snapshot%get(title//'area', self%area(first:last), status, OF_SOME_NODES, node)
    call snapshot%get(title//'penetration', self%penetration(first:last), status, OF_SOME_NODES, &
                      node)
    call snapshot%get(title//'pressure', self%pressure(first:last), status, OF_SOME_NODES, node)
    call snapshot%get(title//'traction', self%traction(:, first:last), status, OF_SOME_NODES, node)
    call snapshot%get(title//'multiplier', self%multiplier_old(first:last), status, &
                      OF_SOME_NODES, node)

  end subroutine contact_state_load_conditions

  subroutine contact_state_save_common(self, title, snapshot)
    class(contact_state_t), intent(in) :: self
    character(len=*), intent(in) :: title
    type(snapshot_t), intent(inout) :: snapshot

    call snapshot%put(title//'penalty growth', self%growth_old)

  end subroutine contact_state_save_common

  !> After the conditions.
  subroutine contact_state_load_common(self, title, snapshot, status)
    class(contact_state_t), intent(inout) :: self
    character(len=*), intent(in) :: title
    type(snapshot_t), intent(in) :: snapshot
    type(status_t), intent(inout) :: status

    call snapshot%get(title//'penalty growth', self%growth_old, status)
    self%has_stepped = .true.
    call remember_forces(self)
    call remember_standing(self)

  end subroutine contact_state_load_common

end module swage_contact_state
