!> Contact between deformable surfaces, whatever formulation makes its conditions.
!>
!> A condition with the penetration g and the multiplier m carries the pressure
!> \(\lambda = m + \rho g\) while that is compression, and puts \(\lambda\) times its `force` on its
!> nodes ([[contact_rows_t]]). Friction acts on the motion of the slave past the master,
!> \[ s = P \frac1A \sum_j w_j \Delta x_j, \]
!> w the shares of the nodes, Δx their displacements in the step, P the projection on the tangent
!> plane; the traction τ puts \(w_j \tau\) on node j: what the one body gets the other gives.
!>
!> Bonds turn with the master: by the shortest rotation of the normal, and about the normal by the
!> mean turn of the master's nodes. Conditions come with the geometry of the present iterate. That
!> their normals, areas and shares change with the nodes is left to the formulation for pressures,
!> and neglected for friction.
!>
!> Tied surfaces ([[tie_t]]) have the same conditions all the time. Each one holds in all directions
!> and carries tension: what would be friction is a bond of the stiffness of the penalty, which acts
!> on the whole distance along the surface, not on that of the step.
module swage_body_contact
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_contact_state, only: contact_state_create, contact_state_t, contact_work_t, &
    enforcement_t, PENALTY
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_kinds, only: gp, wp
  use swage_rotation, only: cross_product, dyadic, IDENTITY, rotation_matrix, skew_matrix
  use swage_snapshot, only: OF_SOME_NODES, snapshot_t
  use swage_status, only: status_t
  use swage_text, only: text
  use swage_tie, only: tie_create, tie_t
  implicit none(type, external)
  private

  public :: body_contact_t, body_contact_create, start_fit_t

  !> Cosine of the turn of a normal in a step below which bonds do not follow it.
  real(wp), parameter :: LARGEST_TURN = -0.5_wp
  !> Derivative of a normal that is taken for fixed [1/length].
  real(wp), parameter :: FIXED(3, 3) = 0.0_wp
  !> Turn of the master's nodes about the normal is known when so much of their spread remains [1].
  real(wp), parameter :: SMALLEST_SPREAD = 0.1_wp

  !> How bodies fit at the start, beside how they are drawn.
  type :: start_fit_t
    !> Gaps and overlaps up to this size count as none [length].
    real(wp) :: tolerance = 0.0_wp
    !> Overlap on top of what is drawn [length].
    real(wp) :: interference = 0.0_wp
    !> Time from the start over which this overlap, and that drawn beyond the tolerance, comes about
    !> evenly; 0: in the first step [time].
    real(wp) :: duration = 0.0_wp
  end type start_fit_t

  !> How the master of a condition turns about the normal.
  type :: spin_t
    !> Whether it is known; else it is 0.
    logical :: exists = .false.
    !> Mean position of the master's nodes at the start of the step [length].
    real(wp) :: centre(3) = 0.0_wp
    !> Sine and cosine of the angle, both times a positive number [length^4].
    real(wp) :: sine = 0.0_wp
    real(wp) :: cosine = 0.0_wp
    !> Shortest rotation of the normal, which goes before.
    real(wp) :: tilt(3, 3) = 0.0_wp
  end type spin_t

  !> What an active condition does.
  type :: response_t
    !> Traction of friction and inertia on the slave [stress].
    real(wp) :: traction(3) = 0.0_wp
    !> Pressure by penetration, by the area [stress/length^3].
    real(wp) :: by_gap = 0.0_wp
    !> Derivative of the traction by the motion of the slave past the master, by the area
    !> [stress/length^3].
    real(wp) :: by_motion(3, 3) = 0.0_wp
    !> Derivatives of the traction by area times penetration [stress/length^3], and by the angle
    !> that the master turns about the normal [stress]; whether there are any.
    real(wp) :: by_pressure(3) = 0.0_wp
    real(wp) :: by_angle(3) = 0.0_wp
    logical :: is_unsymmetric = .false.
    type(spin_t) :: spin
  end type response_t

  !> Entries of the conditions around each surface node, of those conditions that count.
  type :: incidence_t
    !> First entry in the list of each node, and one past the last of all; shape (n_node + 1).
    integer, allocatable :: first(:)
    !> Entry, and row that it belongs to.
    integer, allocatable :: entry(:), row(:)
  end type incidence_t

  !> One pair of surfaces: the conditions of the slave nodes that this rank owns. What one condition
  !> has is found under its place; those of one node need not follow each other.
  type, extends(contact_state_t) :: body_contact_t
    !> Surface node of each condition, and node of the mesh; shape (n_condition).
    integer, allocatable :: slave(:), node(:)
    !> Place of the condition with a key ([[contact_rows_t]]), 0 where it is not this rank's; shape
    !> (n_key).
    integer, allocatable :: place(:)
    !> Place of the first of the first conditions of all nodes, of the second ones, and so on, and
    !> one past the last; shape (most of a node on any rank + 1).
    integer, allocatable :: first(:)
    !> Distance that counts as none, as of bodies that are drawn apart or into each other, and
    !> overlap that comes about at the start of the run [length]; shape (n_condition).
    real(wp), allocatable :: shift(:), pending(:)
    type(start_fit_t) :: fit
    !> Share of the overlap that has not come about at the start and at the end of the step [1].
    real(wp) :: pending_share(2) = 0.0_wp
    !> How the master has turned in the step; shape (3, 3, n_condition).
    real(wp), allocatable :: turn(:, :, :)
    !> Forces on the surface nodes at the start of the step, of this rank's conditions [force];
    !> shape (3, n_surface_node).
    real(wp), allocatable :: nodal_load(:, :)
    !> Of each row at the last evaluation: its condition, 0 where it is not this rank's, its
    !> pressure, 0 without contact [stress], and what a secant of friction has more than the
    !> tangent [stress/length]; least shapes (n_row), (3, 3, n_row).
    integer, allocatable :: condition(:)
    real(wp), allocatable :: row_pressure(:), row_secant(:, :, :)
    !> Derivative of the friction of each row by its pressure [1]; least shape (3, n_row).
    real(wp), allocatable :: row_push(:, :)
    !> Projection on the directions in which the surface nodes are free, for the caller to set; all
    !> are where it is not allocated; shape (3, 3, n_surface_node).
    real(wp), allocatable :: freedom(:, :, :)
    !> What holds tied surfaces; not allocated where they are not.
    type(tie_t), allocatable :: tie
  contains
    !> Tie the surfaces by conditions that stay.
    procedure :: bind => body_contact_bind
    !> Take the distances at the start of the run for what the fit says of them.
    procedure :: adjust => body_contact_adjust
    !> Take the times of a step, before `begin_step`.
    procedure :: set_times => body_contact_set_times
    !> Take the conditions at the start of the step, and the flow stresses.
    procedure :: begin_step => body_contact_begin_step
    !> Forces, and tangent blocks, at given positions.
    procedure :: evaluate => body_contact_evaluate
    !> Forces of a change of pressures and bonds, and change of penetrations and slips by a motion.
    procedure :: push => body_contact_push
    procedure :: penetrate => body_contact_penetrate
    !> Energies of the step, after the last evaluation and before `accept`.
    procedure :: work => body_contact_work
    !> Once an iteration: take the secant of friction where its tangent leads nowhere, and hold
    !> conditions that alternate between contact and none.
    procedure :: watch => body_contact_watch
    !> Judge converged iterations: go on with other multipliers or states, or be done.
    procedure :: augment => body_contact_augment
    !> Means of the conditions of each slave node.
    procedure :: list_nodes => body_contact_list_nodes
    !> Put the state after the last accepted step into a snapshot, and take it back.
    procedure :: save => body_contact_save
    procedure :: load => body_contact_load
  end type body_contact_t

contains

  !> A contact that has not touched yet.
  subroutine body_contact_create(name, friction, separation, owner, is_own, mesh_node, &
                                 size_of_cell, penalty, tangential_stiffness, enforcement, &
                                 inertia, contact)
    character(len=*), intent(in) :: name
    class(friction_law_t), intent(in) :: friction
    logical, intent(in) :: separation
    !> Slave node of the condition of each key, 0 where no condition has it; the same on all ranks;
    !> shape (n_key).
    integer, intent(in) :: owner(:)
    !> Whether this rank owns each surface node, and its node of the mesh here, which counts where
    !> it does; shape (n_surface_node).
    logical, intent(in) :: is_own(:)
    integer, intent(in) :: mesh_node(:)
    !> Of the surface nodes [length]; shape (n_surface_node).
    real(wp), intent(in) :: size_of_cell(:)
    !> Of the surface nodes [stress/length]; shape (n_surface_node).
    real(wp), intent(in) :: penalty(:), tangential_stiffness(:)
    type(enforcement_t), intent(in) :: enforcement
    !> Resistance to a change of slip, by the flow stress on the cell size [1].
    real(wp), intent(in) :: inertia
    type(body_contact_t), intent(out) :: contact

    integer, allocatable :: key(:)
    integer :: i, n

    call order_conditions(owner, is_own, key, contact%first)
    n = size(key)
    allocate (contact%slave(n), contact%node(n))
    contact%slave = owner(key)
    contact%node = mesh_node(contact%slave)
    call contact_state_create(name, friction, separation, int(key, gp), &
                              size_of_cell(contact%slave), penalty(contact%slave), &
                              tangential_stiffness(contact%slave), enforcement, inertia, &
                              contact%contact_state_t)
    allocate (contact%place(size(owner)), source=0)
    do i = 1, n
      contact%place(key(i)) = i
    end do
    allocate (contact%shift(n), contact%pending(n), contact%turn(3, 3, n), &
              contact%nodal_load(3, size(mesh_node)), source=0.0_wp)
    allocate (contact%condition(0), contact%row_pressure(0), contact%row_secant(3, 3, 0), &
              contact%row_push(3, 0))

  end subroutine body_contact_create

  !> First conditions of all nodes first, then second ones, and so on.
  pure subroutine order_conditions(owner, is_own, key, first)
    !> As in [[body_contact_create]].
    integer, intent(in) :: owner(:)
    logical, intent(in) :: is_own(:)
    !> Key of each condition of this rank; shape (n_condition).
    integer, allocatable, intent(out) :: key(:)
    !> First condition of each turn, and one past the last; shape (most of a node + 1), the same on
    !> all ranks.
    integer, allocatable, intent(out) :: first(:)

    integer :: met(size(is_own)), turn(size(owner))
    integer, allocatable :: next(:)
    integer :: i

    met = 0
    turn = 0
    do i = 1, size(owner)
      if (owner(i) == 0) cycle
      met(owner(i)) = met(owner(i)) + 1
      turn(i) = met(owner(i))
    end do
    allocate (first(max(maxval(met), 1) + 1), source=0)
    first(1) = 1
    do i = 1, size(owner)
      if (owner(i) == 0) cycle
      if (is_own(owner(i))) first(turn(i) + 1) = first(turn(i) + 1) + 1
    end do
    do i = 2, size(first)
      first(i) = first(i - 1) + first(i)
    end do
    allocate (next, source=first)
    allocate (key(first(size(first)) - 1))
    do i = 1, size(owner)
      if (owner(i) == 0) cycle
      if (.not. is_own(owner(i))) cycle
      key(next(turn(i))) = i
      next(turn(i)) = next(turn(i)) + 1
    end do

  end subroutine order_conditions

  !> The friction law must be one that sticks, and the contact one that cannot separate.
  pure subroutine body_contact_bind(self, n_dim, rows, x)
    class(body_contact_t), intent(inout) :: self
    integer, intent(in) :: n_dim
    !> Where the bodies are drawn; from now on `tie` alone changes them.
    type(contact_rows_t), intent(in) :: rows
    !> Of the surface nodes, there [length]; shape (3, n_surface_node).
    real(wp), intent(in) :: x(:, :)

    allocate (self%tie)
    call tie_create(n_dim, rows, x, self%tie)
    self%is_tied = .true.

  end subroutine body_contact_bind

  !> A condition that finds nothing opposite at the start has the overlap of the fit alone.
  pure subroutine body_contact_adjust(self, rows, fit)
    class(body_contact_t), intent(inout) :: self
    !> Where the bodies are drawn.
    type(contact_rows_t), intent(in) :: rows
    type(start_fit_t), intent(in) :: fit

    integer :: i, row

    self%fit = fit
    self%shift = -fit%interference
    self%pending = fit%interference
    call find_conditions(self, rows)
    do row = 1, rows%n_row
      i = self%condition(row)
      if (i == 0) cycle
      if (abs(rows%gap(row)) <= fit%tolerance) then
        self%shift(i) = self%shift(i) + rows%gap(row)
      else if (rows%gap(row) > 0.0_wp) then
        self%pending(i) = self%pending(i) + rows%gap(row)
      end if
    end do

  end subroutine body_contact_adjust

  pure subroutine body_contact_set_times(self, time, time_new)
    class(body_contact_t), intent(inout) :: self
    !> Start and end of the step, from the start of the run [time].
    real(wp), intent(in) :: time, time_new

    self%pending_share = [share_at(time), share_at(time_new)]

  contains

    pure function share_at(now) result(share)
      real(wp), intent(in) :: now
      real(wp) :: share

      if (self%fit%duration > 0.0_wp) then
        share = max(1.0_wp - now / self%fit%duration, 0.0_wp)
      else
        share = merge(0.0_wp, 1.0_wp, now > 0.0_wp)
      end if

    end function share_at

  end subroutine body_contact_set_times

  !> Which condition of this rank each row is.
  pure subroutine find_conditions(self, rows)
    class(body_contact_t), intent(inout) :: self
    type(contact_rows_t), intent(in) :: rows

    integer :: room

    if (size(self%condition) < rows%n_row) then
      room = 2 * rows%n_row
      deallocate (self%condition, self%row_pressure, self%row_secant, self%row_push)
      allocate (self%condition(room), self%row_pressure(room), self%row_secant(3, 3, room), &
                self%row_push(3, room))
    end if
    if (rows%n_row == 0) return
    self%condition(:rows%n_row) = self%place(rows%key(:rows%n_row))
    self%row_pressure(:rows%n_row) = 0.0_wp

  end subroutine find_conditions

  pure subroutine body_contact_begin_step(self, rows, flow_stress)
    class(body_contact_t), intent(inout) :: self
    !> At the start of the step.
    type(contact_rows_t), intent(in) :: rows
    !> Of the surface nodes [stress]; shape (n_surface_node).
    real(wp), intent(in) :: flow_stress(:)

    real(wp) :: shear(3)
    integer :: entry, i, row

    call self%renew()
    call find_conditions(self, rows)
    self%flow_stress = flow_stress(self%slave)
    self%penetration_old = -self%size
    self%normal_old = 0.0_wp
    self%touched = .false.
    self%nodal_load = 0.0_wp
    do row = 1, rows%n_row
      i = self%condition(row)
      if (i == 0) cycle
      call self%meet(i, fitted_gap(self, i, rows%gap(row), 1), rows%normal(:, row))
      shear = self%shear_old(:, i) + self%inertia%force_old(:, i)
      do entry = rows%first(row), rows%first(row + 1) - 1
        associate (load => self%nodal_load(:, rows%node(entry)))
          load = load + (self%load_old(i) * rows%force(:, entry) + rows%share(entry) * shear) &
            / rows%area(row)
        end associate
      end do
    end do
    ! A bond of the penalty alone is that of the distance
    if (self%is_tied .and. self%enforcement%kind == PENALTY) self%bond = 0.0_wp

  end subroutine body_contact_begin_step

  !> Adds the contact forces with the sign of internal forces: the residual is internal minus
  !> external force. Blocks are derivatives of what is added.
  pure subroutine body_contact_evaluate(self, rows, x_start, x_moved, dt, default_velocity, &
                                        residual, blocks, unsymmetric)
    class(body_contact_t), intent(inout) :: self
    !> At the end of the step; rows of other ranks are left out.
    type(contact_rows_t), intent(in) :: rows
    !> Positions of the surface nodes at both ends of the step [length]; shape (3, n_surface_node).
    real(wp), intent(in) :: x_start(:, :), x_moved(:, :)
    !> [time]
    real(wp), intent(in) :: dt
    !> Slip rate of the regularisation where the law has none of its own [length/time].
    real(wp), intent(in) :: default_velocity
    !> [force]; shape (3, n_surface_node).
    real(wp), intent(inout) :: residual(:, :)
    !> Added to: the tangent, but for what follows.
    type(contact_blocks_t), intent(inout) :: blocks
    !> Added to: how friction follows the pressure and turns with the master, which a symmetric
    !> factor leaves out.
    type(contact_blocks_t), intent(inout) :: unsymmetric

    type(response_t) :: response(rows%n_row)
    real(wp) :: force(3), velocity
    integer :: entry, i, row
    logical :: counts(rows%n_row)

    velocity = default_velocity
    if (self%friction%regularisation_velocity > 0.0_wp) then
      velocity = self%friction%regularisation_velocity
    end if
    call find_conditions(self, rows)
    call leave_all(self, rows)
    ! Rates are not turned: within a step that is a small share of them
    call self%inertia%begin_step(dt, IDENTITY)
    self%force_square = 0.0_wp
    counts = .false.
    do row = 1, rows%n_row
      i = self%condition(row)
      if (i == 0) cycle
      call press(self, row, i, rows, x_start, x_moved, dt, velocity, response(row))
      counts(row) = self%active(i)
      if (.not. counts(row)) cycle

      self%row_pressure(row) = self%pressure(i)
      do entry = rows%first(row), rows%first(row + 1) - 1
        associate (f => residual(:, rows%node(entry)))
          f = f - self%pressure(i) * rows%force(:, entry) &
            - rows%share(entry) * response(row)%traction
        end associate
      end do
      force = rows%area(row) * (self%pressure(i) * rows%normal(:, row) - response(row)%traction)
      self%force_square = self%force_square + dot_product(force, force)
    end do
    call add_blocks(rows, counts, size(residual, 2), response, blocks)
    call add_unsymmetric_blocks(rows, counts .and. response%is_unsymmetric, x_start, response, &
                                unsymmetric)

  end subroutine body_contact_evaluate

  !> What holds for a condition with nothing opposite: it is a cell away.
  pure subroutine leave_all(self, rows)
    class(body_contact_t), intent(inout) :: self
    type(contact_rows_t), intent(in) :: rows

    logical :: is_opposed(size(self%active))
    integer :: i, row

    is_opposed = .false.
    do row = 1, rows%n_row
      if (self%condition(row) > 0) is_opposed(self%condition(row)) = .true.
    end do
    do i = 1, size(self%active)
      if (is_opposed(i)) cycle
      self%active(i) = .false.
      self%penetration(i) = -self%size(i)
      self%pressure(i) = 0.0_wp
      self%traction(:, i) = 0.0_wp
      self%bond_change(i) = 0.0_wp
      self%turned_about(i) = .false.
      self%slip(:, i) = 0.0_wp
      self%turn(:, :, i) = IDENTITY
    end do

  end subroutine leave_all

  !> True when boundaries hold all that could open or close a condition.
  pure function is_stuck(self, rows, row) result(stuck)
    class(body_contact_t), intent(in) :: self
    type(contact_rows_t), intent(in) :: rows
    integer, intent(in) :: row
    logical :: stuck

    !> Share of the derivative of a penetration that counts as none.
    real(wp), parameter :: NONE = 1.0e-8_wp

    real(wp) :: slope(3)
    integer :: entry

    stuck = .false.
    if (.not. allocated(self%freedom)) return
    do entry = rows%first(row), rows%first(row + 1) - 1
      slope = matmul(self%freedom(:, :, rows%node(entry)), rows%slope(:, entry))
      if (norm2(slope) > NONE * rows%area(row)) return
    end do
    stuck = .true.

  end function is_stuck

  !> Friction follows the pressure.
  pure subroutine body_contact_push(self, rows, change, force)
    class(body_contact_t), intent(in) :: self
    !> Of the last evaluation.
    type(contact_rows_t), intent(in) :: rows
    !> Of the pressures, and of the tractions of bonds [stress]; shape (4, n_condition).
    real(wp), intent(in) :: change(:, :)
    !> On the surface nodes [force]; shape (3, n_surface_node); added to.
    real(wp), intent(inout) :: force(:, :)

    real(wp) :: traction(3)
    integer :: entry, i, row

    do row = 1, rows%n_row
      i = self%condition(row)
      if (i == 0) cycle
      if (.not. self%active(i)) cycle
      traction = change(1, i) * self%row_push(:, row) + change(2:, i)
      do entry = rows%first(row), rows%first(row + 1) - 1
        associate (f => force(:, rows%node(entry)))
          f = f + change(1, i) * rows%force(:, entry) + rows%share(entry) * traction
        end associate
      end do
    end do

  end subroutine body_contact_push

  pure subroutine body_contact_penetrate(self, rows, motion, change)
    class(body_contact_t), intent(in) :: self
    !> Of the last evaluation.
    type(contact_rows_t), intent(in) :: rows
    !> Of the surface nodes [length]; shape (3, n_surface_node).
    real(wp), intent(in) :: motion(:, :)
    !> Of the penetrations of active conditions, and the opposite of their slip [length]; of others
    !> it is left alone; shape (4, n_condition).
    real(wp), intent(inout) :: change(:, :)

    real(wp) :: past(3)
    integer :: entry, i, row

    do row = 1, rows%n_row
      i = self%condition(row)
      if (i == 0) cycle
      if (.not. self%active(i)) cycle
      change(1, i) = 0.0_wp
      past = 0.0_wp
      do entry = rows%first(row), rows%first(row + 1) - 1
        associate (moved => motion(:, rows%node(entry)))
          change(1, i) = change(1, i) + dot_product(rows%slope(:, entry), moved) / rows%area(row)
          past = past + rows%share(entry) / rows%area(row) * moved
        end associate
      end do
      change(2:, i) = rows%normal(:, row) * dot_product(rows%normal(:, row), past) - past
    end do

  end subroutine body_contact_penetrate

  !> State of one condition, and how it responds where it is active.
  pure subroutine press(self, row, i, rows, x_start, x_moved, dt, velocity, response)
    class(body_contact_t), intent(inout) :: self
    integer, intent(in) :: row
    !> Place of the condition.
    integer, intent(in) :: i
    type(contact_rows_t), intent(in) :: rows
    real(wp), intent(in) :: x_start(:, :), x_moved(:, :)
    real(wp), intent(in) :: dt
    !> Slip rate of the regularisation [length/time].
    real(wp), intent(in) :: velocity
    type(response_t), intent(out) :: response

    type(friction_point_t) :: point
    real(wp) :: d_inertia(3, 3), flat(3, 3), motion(3), normal(3), penalty, turned(3)
    integer :: entry

    normal = rows%normal(:, row)
    flat = IDENTITY - dyadic(normal, normal)
    motion = 0.0_wp
    do entry = rows%first(row), rows%first(row + 1) - 1
      associate (node => rows%node(entry))
        motion = motion + rows%share(entry) * (x_moved(:, node) - x_start(:, node))
      end associate
    end do
    motion = motion / rows%area(row)
    if (self%is_tied) motion = self%tie%apart(:, row)
    point%slip = matmul(flat, motion)
    self%slip(:, i) = point%slip
    self%area(i) = rows%area(row)
    call find_tilt(self%normal_old(:, i), normal, response%spin%tilt)
    self%turn(:, :, i) = response%spin%tilt
    if (self%friction%has_history .and. .not. self%is_tied) then
      call add_spin(rows, row, x_start, x_moved, self%turn(:, :, i), response%spin)
    end if
    call self%decide(i, fitted_gap(self, i, rows%gap(row), 2))
    self%row_push(:, row) = 0.0_wp
    if (.not. self%active(i)) return
    self%stuck(i) = is_stuck(self, rows, row)

    penalty = self%growth * self%penalty(i)
    self%pressure(i) = self%multiplier(i) + penalty * self%penetration(i)
    ! A bond turns with the master and lies in the tangent plane
    turned = matmul(self%turn(:, :, i), self%bond(:, i))
    point%traction_old = matmul(flat, turned)
    point%dt = dt
    point%pressure = max(self%pressure(i), 0.0_wp)
    point%flow_stress = self%flow_stress(i)
    point%regularisation_velocity = velocity
    point%tangential_stiffness = self%growth * self%tangential_stiffness(i)
    call self%friction%traction(point)
    self%traction(:, i) = point%traction
    self%sticks(i) = self%friction%has_history .and. point%sticking
    if (self%friction%has_history) then
      self%bond_change(i) = norm2(point%traction - point%traction_old)
    end if
    call self%inertia%resist(i, self%flow_stress(i), self%size(i), normal, FIXED, point%slip, &
                             flat, d_inertia)

    response%traction = point%traction + self%inertia%traction(:, i)
    response%by_gap = penalty / rows%area(row)
    response%by_motion = matmul(point%d_slip, flat)
    response%by_motion = (response%by_motion + d_inertia) / rows%area(row)
    if (self%pressure(i) > 0.0_wp) then
      self%row_push(:, row) = point%d_pressure
      response%by_pressure = response%by_gap * point%d_pressure
    end if
    if (response%spin%exists) then
      turned = cross_product(normal, turned)
      response%by_angle = matmul(point%d_traction_old, turned)
    end if
    response%is_unsymmetric = norm2(response%by_pressure) + norm2(response%by_angle) > 0.0_wp
    call self%turn_about(i, point%secant)
    self%row_secant(:, :, row) = matmul(point%d_slip + point%secant * IDENTITY, flat)

  end subroutine press

  !> Penetration that counts.
  pure function fitted_gap(contact, i, gap, step_end) result(fitted)
    type(body_contact_t), intent(in) :: contact
    !> Place of the condition.
    integer, intent(in) :: i
    !> [length]
    real(wp), intent(in) :: gap
    !> 1 at the start of the step, 2 at its end.
    integer, intent(in) :: step_end
    real(wp) :: fitted

    fitted = gap - contact%shift(i) - contact%pending_share(step_end) * contact%pending(i)

  end function fitted_gap

  !> The shortest rotation from one unit vector to another.
  pure subroutine find_tilt(from, to, tilt)
    !> Zero where nothing was opposite at the start of the step.
    real(wp), intent(in) :: from(3)
    real(wp), intent(in) :: to(3)
    !> The unit matrix when the turn is too large to make sense.
    real(wp), intent(out) :: tilt(3, 3)

    real(wp) :: cosine, w(3, 3)

    tilt = IDENTITY
    cosine = dot_product(from, to)
    if (.not. norm2(from) > 0.0_wp .or. cosine < LARGEST_TURN) return
    w = skew_matrix(cross_product(from, to))
    tilt = matmul(w, w)
    tilt = IDENTITY + w + tilt / (1.0_wp + cosine)

  end subroutine find_tilt

  !> Mean rotation of the master's nodes about the normal.
  pure subroutine add_spin(rows, row, x_start, x_moved, turn, spin)
    type(contact_rows_t), intent(in) :: rows
    integer, intent(in) :: row
    real(wp), intent(in) :: x_start(:, :), x_moved(:, :)
    !> The tilt on entry.
    real(wp), intent(inout) :: turn(3, 3)
    !> Its tilt counts.
    type(spin_t), intent(inout) :: spin

    real(wp) :: about(3, 3), centre_moved(3), from(3), normal(3), spread, to(3), total, weight
    integer :: entry

    normal = rows%normal(:, row)
    total = 0.0_wp
    centre_moved = 0.0_wp
    do entry = rows%first(row), rows%first(row + 1) - 1
      weight = max(-rows%share(entry), 0.0_wp)
      total = total + weight
      spin%centre = spin%centre + weight * x_start(:, rows%node(entry))
      centre_moved = centre_moved + weight * x_moved(:, rows%node(entry))
    end do
    if (.not. total > 0.0_wp) return
    spin%centre = spin%centre / total
    centre_moved = centre_moved / total
    spread = 0.0_wp
    do entry = rows%first(row), rows%first(row + 1) - 1
      weight = max(-rows%share(entry), 0.0_wp)
      from = x_start(:, rows%node(entry)) - spin%centre
      from = matmul(spin%tilt, from)
      to = x_moved(:, rows%node(entry)) - centre_moved
      spin%sine = spin%sine + weight * dot_product(to, cross_product(normal, from))
      spin%cosine = spin%cosine + weight &
        * (dot_product(from, to) - dot_product(from, normal) * dot_product(to, normal))
      spread = spread + weight * dot_product(from, from)
    end do
    spin%exists = spread > 0.0_wp .and. &
      hypot(spin%sine, spin%cosine) > SMALLEST_SPREAD * spread
    if (.not. spin%exists) return
    about = rotation_matrix(normal, atan2(spin%sine, spin%cosine))
    turn = matmul(about, turn)

  end subroutine add_spin

  !> Derivative of the angle of a spin by the position of a node of the master [1/length].
  pure function spin_slope(spin, normal, weight, x_start) result(slope)
    type(spin_t), intent(in) :: spin
    real(wp), intent(in) :: normal(3)
    !> Of the node in the mean.
    real(wp), intent(in) :: weight
    real(wp), intent(in) :: x_start(3)
    real(wp) :: slope(3)

    real(wp) :: from(3)

    from = x_start - spin%centre
    from = matmul(spin%tilt, from)
    slope = weight * (spin%cosine * cross_product(normal, from) &
                      - spin%sine * (from - normal * dot_product(normal, from))) &
      / (spin%sine**2 + spin%cosine**2)

  end function spin_slope

  !> Entries around each node.
  pure subroutine find_incidence(rows, counts, n_node, around)
    type(contact_rows_t), intent(in) :: rows
    !> Rows that do; shape (n_row).
    logical, intent(in) :: counts(:)
    integer, intent(in) :: n_node
    type(incidence_t), intent(out) :: around

    integer, allocatable :: next(:)
    integer :: i, k, row

    allocate (around%first(n_node + 1), source=0)
    around%first(1) = 1
    do row = 1, size(counts)
      if (.not. counts(row)) cycle
      do k = rows%first(row), rows%first(row + 1) - 1
        i = rows%node(k) + 1
        around%first(i) = around%first(i) + 1
      end do
    end do
    do i = 2, n_node + 1
      around%first(i) = around%first(i - 1) + around%first(i)
    end do
    allocate (next, source=around%first)
    allocate (around%entry(next(n_node + 1) - 1), around%row(next(n_node + 1) - 1))
    do row = 1, size(counts)
      if (.not. counts(row)) cycle
      do k = rows%first(row), rows%first(row + 1) - 1
        i = rows%node(k)
        around%entry(next(i)) = k
        around%row(next(i)) = row
        next(i) = next(i) + 1
      end do
    end do

  end subroutine find_incidence

  !> Blocks of pressure by penetration, and of friction by slip, one for each pair of nodes.
  pure subroutine add_blocks(rows, counts, n_node, response, blocks)
    type(contact_rows_t), intent(in) :: rows
    !> Rows that do; shape (n_row).
    logical, intent(in) :: counts(:)
    !> Surface nodes.
    integer, intent(in) :: n_node
    !> Shape (n_row).
    type(response_t), intent(in) :: response(:)
    type(contact_blocks_t), intent(inout) :: blocks

    real(wp) :: force(3), part(3, 3), share
    type(incidence_t) :: around
    integer :: entry, j, k, p, place(n_node), row, seen_by(n_node)

    call find_incidence(rows, counts, n_node, around)
    seen_by = 0
    do j = 1, n_node
      do p = around%first(j), around%first(j + 1) - 1
        entry = around%entry(p)
        row = around%row(p)
        force = -response(row)%by_gap * rows%force(:, entry)
        share = -rows%share(entry)
        do k = rows%first(row), rows%first(row + 1) - 1
          part = dyadic(force, rows%slope(:, k)) &
            + (share * rows%share(k)) * response(row)%by_motion
          call add_part(j, rows%node(k), part, seen_by, place, blocks)
        end do
      end do
    end do

  end subroutine add_blocks

  !> The same of friction by pressure, and by the turn of the master.
  pure subroutine add_unsymmetric_blocks(rows, counts, x_start, response, blocks)
    type(contact_rows_t), intent(in) :: rows
    logical, intent(in) :: counts(:)
    real(wp), intent(in) :: x_start(:, :)
    type(response_t), intent(in) :: response(:)
    type(contact_blocks_t), intent(inout) :: blocks

    real(wp), allocatable :: by_place(:, :, :)
    real(wp) :: part(3, 3), slope(3)
    type(incidence_t) :: around
    integer :: entry, j, k, p, place(size(x_start, 2)), row, seen_by(size(x_start, 2))

    if (.not. any(counts)) return
    allocate (by_place(3, 3, rows%count_entries()))
    do row = 1, size(counts)
      if (.not. counts(row)) cycle
      do k = rows%first(row), rows%first(row + 1) - 1
        by_place(:, :, k) = dyadic(response(row)%by_pressure, rows%slope(:, k))
        if (rows%share(k) < 0.0_wp .and. response(row)%spin%exists) then
          slope = spin_slope(response(row)%spin, rows%normal(:, row), -rows%share(k), &
                             x_start(:, rows%node(k)))
          by_place(:, :, k) = by_place(:, :, k) + dyadic(response(row)%by_angle, slope)
        end if
      end do
    end do

    call find_incidence(rows, counts, size(x_start, 2), around)
    seen_by = 0
    do j = 1, size(x_start, 2)
      do p = around%first(j), around%first(j + 1) - 1
        entry = around%entry(p)
        row = around%row(p)
        do k = rows%first(row), rows%first(row + 1) - 1
          part = -rows%share(entry) * by_place(:, :, k)
          call add_part(j, rows%node(k), part, seen_by, place, blocks)
        end do
      end do
    end do

  end subroutine add_unsymmetric_blocks

  !> Add to the block of two nodes, which appears with its first mention.
  pure subroutine add_part(row, column, part, seen_by, place, blocks)
    !> Those of one row come one after the other.
    integer, intent(in) :: row
    integer, intent(in) :: column
    real(wp), intent(in) :: part(3, 3)
    !> Last row that had each column, and where; shape (n_node).
    integer, intent(inout) :: seen_by(:)
    integer, intent(inout) :: place(:)
    type(contact_blocks_t), intent(inout) :: blocks

    if (seen_by(column) == row) then
      associate (block => blocks%block(:, :, place(column)))
        block = block + part
      end associate
    else
      call blocks%add(row, column, part)
      seen_by(column) = row
      place(column) = blocks%n
    end if

  end subroutine add_part

  !> By the trapezoidal rule; what stored energy and friction leave of it is excess.
  pure subroutine body_contact_work(self, rows, x_start, x_moved, work)
    class(body_contact_t), intent(in) :: self
    !> Of the last evaluation.
    type(contact_rows_t), intent(in) :: rows
    !> Positions at both ends of the step [length]; shape (3, n_surface_node).
    real(wp), intent(in) :: x_start(:, :), x_moved(:, :)
    !> Of this rank's conditions.
    type(contact_work_t), intent(out) :: work

    real(wp) :: done, force(3), ignored, traction(3)
    integer :: entry, i, row

    do i = 1, size(self%active)
      if (.not. (self%active(i) .or. abs(self%load_old(i)) > 0.0_wp)) cycle
      call self%add_work(i, self%turn(:, :, i), self%slip(:, i), ignored, work)
    end do

    done = 0.5_wp * sum(self%nodal_load * (x_moved - x_start))
    do row = 1, rows%n_row
      i = self%condition(row)
      if (i == 0) cycle
      if (.not. self%active(i)) cycle
      traction = self%traction(:, i) + self%inertia%traction(:, i)
      do entry = rows%first(row), rows%first(row + 1) - 1
        associate (node => rows%node(entry))
          force = self%pressure(i) * rows%force(:, entry) + rows%share(entry) * traction
          done = done + 0.5_wp * dot_product(force, x_moved(:, node) - x_start(:, node))
        end associate
      end do
    end do
    if (self%is_tied) then
      work = contact_work_t()
      work%stored = -done
    end if
    work%excess = -done - work%stored - work%friction - work%inertia

  end subroutine body_contact_work

  !> See [[tool_contact_t:watch]].
  pure subroutine body_contact_watch(self, takes_secants, takes_turns, rows, blocks)
    class(body_contact_t), intent(inout) :: self
    !> For all conditions; else only for those whose friction has turned about.
    logical, intent(in) :: takes_secants
    !> For those whose friction had turned about for any share of the last correction.
    logical, intent(in) :: takes_turns
    !> Of the last evaluation.
    type(contact_rows_t), intent(in) :: rows
    !> Added to.
    type(contact_blocks_t), intent(inout) :: blocks

    type(response_t) :: response(rows%n_row)
    integer :: i, row
    logical :: counts(rows%n_row)
    real(wp) :: secant(3, 3)

    counts = .false.
    do row = 1, rows%n_row
      i = self%condition(row)
      if (i == 0) cycle
      counts(row) = self%active(i) .and. (takes_secants .or. self%turned_about(i) .or. &
                                          (takes_turns .and. self%turn_secant(i) > 0.0_wp))
      if (.not. counts(row)) cycle
      secant = self%row_secant(:, :, row)
      if (takes_turns .and. self%turn_secant(i) > 0.0_wp) then
        secant = secant + (self%turn_secant(i) - self%secant(i)) &
          * (IDENTITY - dyadic(rows%normal(:, row), rows%normal(:, row)))
      end if
      counts(row) = norm2(secant) > 0.0_wp
      response(row)%by_motion = -secant / rows%area(row)
    end do
    if (any(counts)) call add_blocks(rows, counts, size(self%nodal_load, 2), response, blocks)
    call self%hold(takes_secants)

  end subroutine body_contact_watch

  !> See [[contact_state_t:judge]].
  pure subroutine body_contact_augment(self, measures, done, gives_up)
    class(body_contact_t), intent(inout) :: self
    !> Of [[contact_state_t:measure]], maxima over all ranks.
    real(wp), intent(in) :: measures(4)
    !> False when the iterations must go on.
    logical, intent(out) :: done
    !> True when conditions were found wrong too often: the step must be cut.
    logical, intent(out) :: gives_up

    integer :: i
    logical :: augmented

    call self%judge(measures, done, gives_up, augmented)
    if (.not. augmented) return
    do i = 1, size(self%active)
      self%bond(:, i) = matmul(self%traction(:, i), self%turn(:, :, i))
    end do

  end subroutine body_contact_augment

  !> For output; one entry for each slave node of this rank.
  pure subroutine body_contact_list_nodes(self, node, area, penetration, pressure, traction, active)
    class(body_contact_t), intent(in) :: self
    !> Of the mesh.
    integer, allocatable, intent(out) :: node(:)
    !> Of its active conditions [length^2].
    real(wp), allocatable, intent(out) :: area(:)
    !> Largest penetration [length], mean pressure [stress]; mean friction [stress] of shape (3, :).
    real(wp), allocatable, intent(out) :: penetration(:), pressure(:), traction(:, :)
    !> True where a condition is active.
    logical, allocatable, intent(out) :: active(:)

    integer :: i, j, n, of_slave(ubound(self%nodal_load, 2))

    n = self%first(2) - 1
    allocate (node(n), area(n), penetration(n), pressure(n), traction(3, n), active(n))
    node = self%node(:n)
    of_slave = 0
    do j = 1, n
      of_slave(self%slave(j)) = j
      area(j) = 0.0_wp
      penetration(j) = self%penetration(j)
      pressure(j) = 0.0_wp
      traction(:, j) = 0.0_wp
      active(j) = .false.
    end do
    do i = 1, size(self%active)
      j = of_slave(self%slave(i))
      penetration(j) = max(penetration(j), self%penetration(i))
      if (.not. self%active(i)) cycle
      active(j) = .true.
      area(j) = area(j) + self%area(i)
      pressure(j) = pressure(j) + self%area(i) * self%pressure(i)
      traction(:, j) = traction(:, j) + self%area(i) * self%traction(:, i)
    end do
    do j = 1, n
      if (area(j) > 0.0_wp) then
        pressure(j) = pressure(j) / area(j)
        traction(:, j) = traction(:, j) / area(j)
      end if
    end do

  end subroutine body_contact_list_nodes

  subroutine body_contact_save(self, snapshot)
    class(body_contact_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    character(len=:), allocatable :: title
    integer :: first, k, last

    title = 'contact '//self%name//': '
    call self%save_common(title, snapshot)
    do k = 1, size(self%first) - 1
      if (k > 1) title = 'contact '//self%name//', condition '//text(k)//': '
      first = self%first(k)
      last = self%first(k + 1) - 1
      call self%save_conditions(title, first, self%node(first:last), snapshot)
      call snapshot%put(title//'shift', self%shift(first:last), OF_SOME_NODES, &
                        self%node(first:last))
      call snapshot%put(title//'pending overlap', self%pending(first:last), OF_SOME_NODES, &
                        self%node(first:last))
      call self%inertia%save(title, first, self%node(first:last), snapshot)
    end do

  end subroutine body_contact_save

  subroutine body_contact_load(self, snapshot, status)
    class(body_contact_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` on this rank when something is missing.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: title
    integer :: first, k, last

    do k = 1, size(self%first) - 1
      title = 'contact '//self%name//': '
      if (k > 1) title = 'contact '//self%name//', condition '//text(k)//': '
      first = self%first(k)
      last = self%first(k + 1) - 1
      call self%load_conditions(title, first, self%node(first:last), snapshot, status)
      call snapshot%get(title//'shift', self%shift(first:last), status, OF_SOME_NODES, &
                        self%node(first:last))
      call snapshot%get(title//'pending overlap', self%pending(first:last), status, OF_SOME_NODES, &
                        self%node(first:last))
      call self%inertia%load(title, first, self%node(first:last), snapshot, status)
    end do
    call self%load_common('contact '//self%name//': ', snapshot, status)

  end subroutine body_contact_load

end module swage_body_contact
