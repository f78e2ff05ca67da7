!> Contact of a body's surface with one rigid tool: nodal, with friction.
!>
!> A node that is inside the tool at the end of the step is pushed out along the tool's normal by
!> `(multiplier + penalty * penetration) * area`; it leaves as soon as that is tension. Its area is
!> its share of the surface, projected on the tool: a side facet that folds onto the tool counts
!> more and more. Areas are those of the start of the step, so the tangent has no term of theirs.
!> Friction acts on the slip against the material point of the tool that the node started from,
!> which makes a turning tool exact at any angle.
!>
!> What conditions of contact share with those between bodies is in [[swage_contact_state]].
module swage_tool_contact
  use swage_block_matrix, only: block_matrix_t
  use swage_contact_state, only: AUGMENTED_LAGRANGIAN, contact_state_create, contact_state_t, &
    contact_work_t, enforcement_t, ENFORCEMENT_NAMES, LAGRANGE, PENALTY
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_kinds, only: gp, wp
  use swage_rigid_tool, only: rigid_tool_t
  use swage_rotation, only: cross_product, dyadic, IDENTITY
  use swage_snapshot, only: snapshot_t
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: tool_contact_t, tool_contact_create, contact_work_t, enforcement_t, facet_normal
  public :: PENALTY, AUGMENTED_LAGRANGIAN, LAGRANGE, ENFORCEMENT_NAMES

  !> Smallest share of a facet's area that a node gets, whatever its inclination to the tool: a
  !> node about to fold must not be free to penetrate.
  real(wp), parameter :: MINIMUM_SHARE = 0.1_wp
  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)
  !> Share of the tool's normal that a node is free to follow, below which it is not.
  real(wp), parameter :: HELD = 1.0e-8_wp

  !> One pair of surface and tool: a condition for each of this rank's own nodes.
  type, extends(contact_state_t) :: tool_contact_t
    !> Place of the tool in the caller's list.
    integer :: tool = 0
    !> Boundary facets of this rank that may touch; shape (n_facet).
    integer, allocatable :: facet(:)
    !> Nodes of the surface; shape (n_contact).
    integer, allocatable :: node(:)
    !> Force on each node, and its derivative by the node's position, of which the last is only
    !> kept for tools that ask for it [force], [force/length]; shapes (3, :), (3, 3, :).
    real(wp), allocatable :: node_force(:, :), node_stiffness(:, :, :)
    !> What a secant of friction has more than that [force/length]; shape (3, 3, :).
    real(wp), allocatable :: node_secant(:, :, :)
    !> Force on each node by its pressure [length^2], and normal of the tool there, of active ones;
    !> shape (3, :).
    real(wp), allocatable :: node_push(:, :), node_normal(:, :)
    !> Derivative of the slip of each node by its place, of active ones [1]; shape (3, 3, :).
    real(wp), allocatable :: node_slip(:, :, :)
    !> Projection on the directions in which each node is free, for the caller to set; all are where
    !> it is not allocated; shape (3, 3, :).
    real(wp), allocatable :: freedom(:, :, :)
    !> Force on the tool and its torque about the tool's reference point, of this rank's nodes.
    real(wp) :: force(3) = 0.0_wp
    real(wp) :: torque(3) = 0.0_wp
  contains
    !> Areas of the facets of this rank, as nodal sums still to be added over the ranks.
    procedure :: gather_areas => tool_contact_gather_areas
    !> Take the nodal areas and flow stresses of the step.
    procedure :: begin_step => tool_contact_begin_step
    !> Forces, and tangent blocks, at given positions.
    procedure :: evaluate => tool_contact_evaluate
    !> Energies of the step, after the last evaluation and before `accept`.
    procedure :: work => tool_contact_work
    !> Once an iteration: take the secant of friction where its tangent leads nowhere, and hold
    !> nodes that alternate between contact and none.
    procedure :: watch => tool_contact_watch
    !> Judge converged iterations: go on with other multipliers or states, or be done.
    procedure :: augment => tool_contact_augment
    !> Put the state after the last accepted step into a snapshot, and take it back.
    procedure :: save => tool_contact_save
    procedure :: load => tool_contact_load
    !> What `evaluate` does at one node.
    procedure :: press => tool_contact_press
  end type tool_contact_t

contains

  !> A contact without area yet. The surface is given as facets, its nodes as this rank's own.
  subroutine tool_contact_create(name, tool, friction, separation, facet, node, tag, size, &
                                 penalty, tangential_stiffness, enforcement, inertia, contact)
    character(len=*), intent(in) :: name
    integer, intent(in) :: tool
    class(friction_law_t), intent(in) :: friction
    logical, intent(in) :: separation
    integer, intent(in) :: facet(:)
    integer, intent(in) :: node(:)
    !> A positive number of each node, unique over the ranks; shape of `node`.
    integer(gp), intent(in) :: tag(:)
    !> [length]; shape of `node`.
    real(wp), intent(in) :: size(:)
    !> [stress/length]; shape of `node`.
    real(wp), intent(in) :: penalty(:), tangential_stiffness(:)
    type(enforcement_t), intent(in) :: enforcement
    !> Resistance to a change of slip, by the flow stress on the cell size [1].
    real(wp), intent(in) :: inertia
    type(tool_contact_t), intent(out) :: contact

    integer :: n

    call contact_state_create(name, friction, separation, tag, size, penalty, &
                              tangential_stiffness, enforcement, inertia, contact%contact_state_t)
    contact%tool = tool
    allocate (contact%facet, source=facet)
    allocate (contact%node, source=node)
    n = ubound(node, 1)
    allocate (contact%node_force(3, n), contact%node_stiffness(3, 3, n), &
              contact%node_secant(3, 3, n), contact%node_push(3, n), contact%node_normal(3, n), &
              contact%node_slip(3, 3, n), source=0.0_wp)

  end subroutine tool_contact_create

  !> Each facet gives each of its nodes a share of its area, by its inclination to the tool there.
  subroutine tool_contact_gather_areas(self, tool, axisymmetric, facet_node, x, area)
    class(tool_contact_t), intent(in) :: self
    !> At the end of the step.
    type(rigid_tool_t), intent(in) :: tool
    logical, intent(in) :: axisymmetric
    !> Outward oriented; shape (n_dim, n_facet).
    integer, intent(in) :: facet_node(:, :)
    !> Positions at the start of the step [length]; shape (n_dim, n_node).
    real(wp), intent(in) :: x(:, :)
    !> Nodal areas [length^2]; shape (1, n_node).
    real(wp), contiguous, intent(out) :: area(:, :)

    real(wp) :: hessian(3, 3), normal(3), penetration, point(3), share, tool_normal(3), weight(3)
    integer :: a, i, n_dim

    n_dim = size(x, 1)
    area = 0.0_wp
    do i = 1, size(self%facet)
      associate (nodes => facet_node(:, self%facet(i)))
        call facet_normal(x(:, nodes), normal)
        weight = norm2(normal) / n_dim
        normal = normal / norm2(normal)
        if (axisymmetric) then
          weight(1:2) = weight(1:2) * TWO_PI / 3.0_wp &
            * [2.0_wp * x(1, nodes(1)) + x(1, nodes(2)), x(1, nodes(1)) + 2.0_wp * x(1, nodes(2))]
        end if
        do a = 1, n_dim
          point = 0.0_wp
          point(:n_dim) = x(:, nodes(a))
          call tool%project(point, penetration, tool_normal, hessian)
          share = max(-dot_product(normal, tool_normal), MINIMUM_SHARE)
          area(1, nodes(a)) = area(1, nodes(a)) + share * weight(a)
        end do
      end associate
    end do

  end subroutine tool_contact_gather_areas

  subroutine tool_contact_begin_step(self, tool_old, x, area, flow_stress)
    class(tool_contact_t), intent(inout) :: self
    !> Where the tool is at the start of the step.
    type(rigid_tool_t), intent(in) :: tool_old
    !> Positions at the start of the step [length]; shape (n_dim, n_node).
    real(wp), intent(in) :: x(:, :)
    !> Complete nodal areas [length^2]; shape (n_node).
    real(wp), intent(in) :: area(:)
    !> Nodal [stress]; shape (n_node).
    real(wp), intent(in) :: flow_stress(:)

    real(wp) :: hessian(3, 3), normal(3), penetration, point(3)
    integer :: i

    call self%renew()
    do i = 1, size(self%node)
      self%area(i) = area(self%node(i))
      self%flow_stress(i) = flow_stress(self%node(i))
      point = 0.0_wp
      point(:size(x, 1)) = x(:, self%node(i))
      call tool_old%project(point, penetration, normal, hessian)
      call self%meet(i, penetration, normal)
    end do

  end subroutine tool_contact_begin_step

  !> Adds the contact forces with the sign of internal forces: the residual is internal minus
  !> external force.
  subroutine tool_contact_evaluate(self, tool, dt, default_velocity, x_old, x_new, residual, matrix)
    class(tool_contact_t), intent(inout) :: self
    !> At the end of the step.
    type(rigid_tool_t), intent(in) :: tool
    !> [time]
    real(wp), intent(in) :: dt
    !> Slip rate of the regularisation where the law has none of its own [length/time].
    real(wp), intent(in) :: default_velocity
    !> Positions at both ends of the step [length]; shape (n_dim, n_node).
    real(wp), intent(in) :: x_old(:, :), x_new(:, :)
    !> Shape (n_dim + 1, n_node).
    real(wp), intent(inout) :: residual(:, :)
    !> The tangent, to which that of the contact is added.
    type(block_matrix_t), intent(inout) :: matrix

    real(wp) :: column(3, 3), force(3), stiffness(3, 3), velocity, x(3), x_start(3)
    integer :: i, n

    n = size(x_new, 1)
    velocity = default_velocity
    if (self%friction%regularisation_velocity > 0.0_wp) then
      velocity = self%friction%regularisation_velocity
    end if
    self%force = 0.0_wp
    self%torque = 0.0_wp
    self%force_square = 0.0_wp
    call self%inertia%begin_step(dt, tool%rotation_increment)
    x = 0.0_wp
    x_start = 0.0_wp
    do i = 1, size(self%node)
      associate (node => self%node(i))
        x(:n) = x_new(:, node)
        x_start(:n) = x_old(:, node)
        call self%press(i, tool, dt, velocity, x_start, x, force, stiffness, column, &
                        self%node_secant(:, :, i))
        self%node_force(:, i) = force
        self%node_stiffness(:, :, i) = stiffness + column
        if (.not. self%active(i)) cycle

        residual(:n, node) = residual(:n, node) - force(:n)
        associate (block => matrix%values(:n, :n, matrix%diagonal(node)))
          block = block - stiffness(:n, :n)
        end associate
        ! How friction grows with the pressure belongs to one triangle alone
        call matrix%add_unsymmetric(matrix%diagonal(node), -column(:n, :n))
        self%force = self%force - force
        self%torque = self%torque - cross_product(x - tool%reference_point, force)
        self%force_square = self%force_square + dot_product(force, force)
      end associate
    end do

  end subroutine tool_contact_evaluate

  !> Forces and slips are those of the nodes, friction of the start turned with the tool.
  subroutine tool_contact_work(self, tool, x_old, x_new, work)
    class(tool_contact_t), intent(in) :: self
    !> At the end of the step.
    type(rigid_tool_t), intent(in) :: tool
    !> Positions at both ends of the step [length]; shape (n_dim, n_node).
    real(wp), intent(in) :: x_old(:, :), x_new(:, :)
    !> Of this rank's nodes.
    type(contact_work_t), intent(out) :: work

    real(wp) :: hessian(3, 3), normal(3), normal_force(3), penetration, point(3), pressed, &
      slip(3), turn(3, 3)
    integer :: i, n

    n = size(x_new, 1)
    turn = tool%rotation_increment
    do i = 1, size(self%node)
      if (.not. (self%active(i) .or. abs(self%load_old(i)) > 0.0_wp)) cycle
      point = 0.0_wp
      point(:n) = x_old(:, self%node(i))
      slip = -tool%carry(point)
      slip(:n) = slip(:n) + x_new(:, self%node(i))
      point(:n) = x_new(:, self%node(i))
      call tool%project(point, penetration, normal, hessian)
      normal_force = 0.5_wp * (self%load_old(i) * matmul(turn, self%normal_old(:, i)) &
                               + self%area(i) * self%pressure(i) * normal)
      call self%add_work(i, turn, slip, pressed, work)
      work%excess = work%excess - dot_product(normal_force, slip) - pressed
    end do

  end subroutine tool_contact_work

  !> State of one node, the force of the tool on it, and the derivatives of the force by its place.
  pure subroutine tool_contact_press(self, i, tool, dt, velocity, x_old, x, force, stiffness, &
                                     column, secant)
    class(tool_contact_t), intent(inout) :: self
    !> Place of the node in the list.
    integer, intent(in) :: i
    !> At the end of the step.
    type(rigid_tool_t), intent(in) :: tool
    !> [time]
    real(wp), intent(in) :: dt
    !> Slip rate of the regularisation [length/time].
    real(wp), intent(in) :: velocity
    !> Where the node is at both ends of the step [length].
    real(wp), intent(in) :: x_old(3), x(3)
    real(wp), intent(out) :: force(3)
    !> The derivative [force/length], but for how friction follows the pressure.
    real(wp), intent(out) :: stiffness(3, 3)
    !> That part of the derivative.
    real(wp), intent(out) :: column(3, 3)
    !> What the secant of friction would add [force/length].
    real(wp), intent(out) :: secant(3, 3)

    type(friction_point_t) :: point
    real(wp) :: d_inertia(3, 3), d_normal(3, 3), d_pressure(3), d_slip(3, 3), d_turned(3, 3), &
      from_tool(3), hessian(3, 3), normal(3), penalty, penetration, turned(3)

    force = 0.0_wp
    stiffness = 0.0_wp
    column = 0.0_wp
    secant = 0.0_wp
    call tool%project(x, penetration, normal, hessian)
    penalty = self%growth * self%penalty(i)
    if (self%keeping .and. self%touched(i)) then
      ! A tool that goes away lets go
      self%touched(i) = dot_product(x_old - tool%carry(x_old), self%normal_old(:, i)) &
        <= max(self%penetration_old(i), 0.0_wp)
    end if
    call self%decide(i, penetration)
    if (.not. self%active(i)) return

    self%stuck(i) = .false.
    if (allocated(self%freedom)) then
      self%stuck(i) = norm2(matmul(self%freedom(:, :, i), normal)) < HELD
    end if
    self%pressure(i) = self%multiplier(i) + penalty * penetration
    ! Derivatives by the position; the penetration's is -normal, the normal's -hessian
    d_pressure = -penalty * normal
    d_normal = -hessian

    ! Slip against the tool's own point, in the tangent plane
    from_tool = x - tool%carry(x_old)
    point%slip = from_tool - normal * dot_product(normal, from_tool)
    d_slip = IDENTITY - dyadic(normal, normal) - dot_product(normal, from_tool) * d_normal &
      - dyadic(normal, matmul(transpose(d_normal), from_tool))
    ! A bond turns with the tool and lies down in the new tangent plane
    turned = matmul(tool%rotation_increment, self%bond(:, i))
    point%traction_old = turned - normal * dot_product(normal, turned)
    d_turned = -dot_product(normal, turned) * d_normal &
      - dyadic(normal, matmul(transpose(d_normal), turned))
    point%dt = dt
    point%pressure = max(self%pressure(i), 0.0_wp)
    point%flow_stress = self%flow_stress(i)
    point%regularisation_velocity = velocity
    point%tangential_stiffness = self%growth * self%tangential_stiffness(i)
    call self%friction%traction(point)
    self%traction(:, i) = point%traction
    if (self%friction%has_history) then
      self%bond_change(i) = norm2(point%traction - point%traction_old)
    end if

    call self%inertia%resist(i, self%flow_stress(i), self%size(i), normal, d_normal, point%slip, &
                             d_slip, d_inertia)
    force = self%area(i) * (self%pressure(i) * normal + point%traction &
                            + self%inertia%traction(:, i))
    stiffness = self%area(i) * (dyadic(normal, d_pressure) + self%pressure(i) * d_normal &
                                + matmul(point%d_slip, d_slip) &
                                + matmul(point%d_traction_old, d_turned) + d_inertia)
    self%slip(:, i) = point%slip
    call self%turn_about(i, point%secant)
    secant = -self%area(i) * matmul(point%d_slip + point%secant * IDENTITY, d_slip)
    ! A bond that boundaries hold stays as it is
    self%sticks(i) = self%friction%has_history .and. point%sticking
    if (allocated(self%freedom)) then
      self%sticks(i) = self%sticks(i) .and. &
        norm2(matmul(self%freedom(:, :, i), point%slip)) > HELD * norm2(point%slip)
    end if
    self%node_slip(:, :, i) = d_slip
    self%node_normal(:, i) = normal
    self%node_push(:, i) = self%area(i) * normal
    if (self%pressure(i) > 0.0_wp) then
      self%node_push(:, i) = self%area(i) * (normal + point%d_pressure)
      column = self%area(i) * dyadic(point%d_pressure, d_pressure)
    end if

  end subroutine tool_contact_press

  !> The tangent of a point that slides at the limit has no stiffness along the slip: where all do,
  !> a body that friction alone moves would fly away in one correction. A secant takes it along with
  !> the tool. Where friction has turned about in the last correction, the secant between both
  !> states leads to where it vanishes.
  subroutine tool_contact_watch(self, takes_secants, takes_turns, matrix)
    class(tool_contact_t), intent(inout) :: self
    !> For all nodes; else only for those whose friction has turned about.
    logical, intent(in) :: takes_secants
    !> For those whose friction had turned about for any share of the last correction.
    logical, intent(in) :: takes_turns
    !> As [[tool_contact_t:evaluate]] left it.
    type(block_matrix_t), intent(inout) :: matrix

    real(wp) :: secant(3, 3)
    integer :: i, n

    n = matrix%n_slot - 1
    do i = 1, size(self%node)
      if (.not. self%active(i)) cycle
      if (.not. (takes_secants .or. self%turned_about(i) .or. &
                 (takes_turns .and. self%turn_secant(i) > 0.0_wp))) cycle
      secant = self%node_secant(:, :, i)
      if (takes_turns .and. self%turn_secant(i) > 0.0_wp) then
        secant = secant - self%area(i) * (self%turn_secant(i) - self%secant(i)) &
          * self%node_slip(:, :, i)
      end if
      associate (block => matrix%values(:n, :n, matrix%diagonal(self%node(i))))
        block = block - secant(:n, :n)
      end associate
      self%node_stiffness(:, :, i) = self%node_stiffness(:, :, i) + secant
    end do
    call self%hold(takes_secants)

  end subroutine tool_contact_watch

  !> See [[contact_state_t:judge]].
  pure subroutine tool_contact_augment(self, tool, measures, done, gives_up)
    class(tool_contact_t), intent(inout) :: self
    !> At the end of the step.
    type(rigid_tool_t), intent(in) :: tool
    !> Of [[contact_state_t:measure]], maxima over all ranks.
    real(wp), intent(in) :: measures(4)
    !> False when the iterations must go on.
    logical, intent(out) :: done
    !> True when nodes were found wrong too often: the step must be cut.
    logical, intent(out) :: gives_up

    integer :: i
    logical :: augmented

    call self%judge(measures, done, gives_up, augmented)
    if (.not. augmented) return
    do i = 1, size(self%node)
      self%bond(:, i) = matmul(self%traction(:, i), tool%rotation_increment)
    end do

  end subroutine tool_contact_augment

  subroutine tool_contact_save(self, snapshot)
    class(tool_contact_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    character(len=:), allocatable :: title

    title = 'contact '//self%name//': '
    call self%save_conditions(title, 1, self%node, snapshot)
    call self%save_common(title, snapshot)
    call self%inertia%save(title, 1, self%node, snapshot)

  end subroutine tool_contact_save

  subroutine tool_contact_load(self, snapshot, status)
    class(tool_contact_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` on this rank when something is missing.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: title

    title = 'contact '//self%name//': '
    call self%load_conditions(title, 1, self%node, snapshot, status)
    call self%load_common(title, snapshot, status)
    call self%inertia%load(title, 1, self%node, snapshot, status)

  end subroutine tool_contact_load

  !> Normal of a facet, of the length of its area (3D) or length (2D), outward.
  pure subroutine facet_normal(x, normal)
    !> Outward oriented vertices [length]; shape (n_dim, n_dim).
    real(wp), intent(in) :: x(:, :)
    !> In 3D [length^2], in 2D [length].
    real(wp), intent(out) :: normal(3)

    if (size(x, 1) == 3) then
      normal = 0.5_wp * cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
    else
      ! The body lies to the left of the way from the first vertex to the second
      normal = [x(2, 2) - x(2, 1), x(1, 1) - x(1, 2), 0.0_wp]
    end if

  end subroutine facet_normal

end module swage_tool_contact
