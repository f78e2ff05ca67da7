!> Contact of a body's surface with one rigid tool: nodal, with friction.
!>
!> A node that is inside the tool at the end of the step is pushed out along the tool's normal by
!> `(multiplier + penalty * penetration) * area`; it leaves as soon as that is tension. Its area is
!> its share of the surface, projected on the tool: a side facet that folds onto the tool counts
!> more and more. Areas are those of the start of the step, so the tangent has no term of theirs.
!> Friction acts on the slip against the material point of the tool that the node started from,
!> which makes a turning tool exact at any angle.
!>
!> Multipliers are 0 under the penalty alone. In the augmented Lagrangian (Uzawa; Simo and Laursen,
!> Computers and Structures 42, 1992) each one takes over the pressure whenever the iterations have
!> converged, so that the penetration goes to 0 with a penalty of any size; bonds of friction
!> likewise take over the traction, and their elastic slip goes to 0.
!>
!> A node whose state alternates during the iterations is held in it until the others have
!> converged; if it contradicts its state then, it changes it, and the iterations go on.
module swage_tool_contact
  use swage_block_matrix, only: block_matrix_t
  use swage_friction, only: friction_law_t, friction_point_t
  use swage_kinds, only: gp, wp
  use swage_rigid_tool, only: rigid_tool_t
  use swage_rotation, only: cross_product, dyadic, IDENTITY
  use swage_sliding_inertia, only: sliding_inertia_create, sliding_inertia_t
  use swage_snapshot, only: OF_SOME_NODES, snapshot_t
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: tool_contact_t, tool_contact_create, contact_work_t, enforcement_t, facet_normal
  public :: PENALTY, AUGMENTED_LAGRANGIAN, ENFORCEMENT_NAMES

  integer, parameter :: PENALTY = 1, AUGMENTED_LAGRANGIAN = 2
  !> What the key `enforcement` calls them.
  character(len=*), parameter :: ENFORCEMENT_NAMES(*) = &
    [character(len=20) :: 'penalty', 'augmented_lagrangian']

  !> Smallest share of a facet's area that a node gets, whatever its inclination to the tool: a
  !> node about to fold must not be free to penetrate.
  real(wp), parameter :: MINIMUM_SHARE = 0.1_wp
  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)
  !> A node this close to the tool, by its cell size, is in contact from the start when the
  !> contact cannot separate.
  real(wp), parameter :: TOUCHING = 1.0e-6_wp
  !> A node drawn on the tool is in contact although rounding may have put it outside, by this
  !> share of its cell size: a body that rests on a tool is held from the first iteration.
  real(wp), parameter :: ROUNDING = 1.0e-12_wp
  !> Changes of state during one step that a node may make before it is held.
  integer, parameter :: FREE_CHANGES = 4
  !> Times that held nodes may be found wrong before the step is given up.
  integer, parameter :: MAXIMUM_RELEASES = 20
  !> An augmentation should leave at most this share of the penetration, or the penalty grows by
  !> this factor, up to so many times that of the start.
  real(wp), parameter :: EXPECTED_SHARE = 0.25_wp
  real(wp), parameter :: PENALTY_GROWTH = 5.0_wp
  real(wp), parameter :: LARGEST_GROWTH = 25.0_wp

  !> How strictly a contact is enforced.
  type :: enforcement_t
    !> `PENALTY` or `AUGMENTED_LAGRANGIAN`.
    integer :: kind = PENALTY
    !> Largest penetration, by the cell size, that ends the augmentations [1].
    real(wp) :: penetration_tolerance = 1.0e-4_wp
    !> Largest change of pressure or bond in an augmentation, by the largest pressure [1].
    real(wp) :: multiplier_tolerance = 1.0e-2_wp
    !> Augmentations of a step after which it is taken as it is.
    integer :: maximum_augmentations = 20
  end type enforcement_t

  !> What a contact does during a step, by the trapezoidal rule: with the mean of the forces at its
  !> ends. The sum of the four is the work of the tool, force times motion, less that on the body.
  type :: contact_work_t
    !> Stored in penalty and bond [energy].
    real(wp) :: stored = 0.0_wp
    !> Work of friction against slip [energy].
    real(wp) :: friction = 0.0_wp
    !> Work against the inertia of sliding nodes [energy].
    real(wp) :: inertia = 0.0_wp
    !> What force times motion of the tool counts too much, for it takes the force to change halfway
    !> [energy]: nodes that do not touch yet, or no longer, and nodes that pass an edge of the tool.
    real(wp) :: excess = 0.0_wp
  end type contact_work_t

  !> How nodes stood at the end of an accepted step; a failed one leaves no trace.
  type :: standing_t
    real(wp), allocatable :: area(:), penetration(:), pressure(:)
    logical, allocatable :: active(:)
  end type standing_t

  !> One pair of surface and tool. Node lists hold this rank's own nodes.
  type :: tool_contact_t
    character(len=:), allocatable :: name
    !> Place of the tool in the caller's list.
    integer :: tool = 0
    class(friction_law_t), allocatable :: friction
    !> True when nodes may leave the tool.
    logical :: separation = .true.
    !> Boundary facets of this rank that may touch; shape (n_facet).
    integer, allocatable :: facet(:)
    !> Nodes of the surface; shape (n_contact). What follows has one entry a node.
    integer, allocatable :: node(:)
    !> Numbers that are unique over the ranks.
    integer(gp), allocatable :: tag(:)
    !> Cell size [length].
    real(wp), allocatable :: size(:)
    !> Pressure by penetration, and tangential traction by slip where friction bonds
    !> [stress/length].
    real(wp), allocatable :: penalty(:), tangential_stiffness(:)
    type(enforcement_t) :: enforcement
    !> Area of the step [length^2].
    real(wp), allocatable :: area(:)
    !> Flow stress of the material of the step [stress].
    real(wp), allocatable :: flow_stress(:)
    !> At the last evaluation: penetration [length], pressure [stress], positive in compression.
    real(wp), allocatable :: penetration(:), pressure(:)
    !> Part of the pressure that does not depend on the penetration, at the start of the step and
    !> now [stress].
    real(wp), allocatable :: multiplier_old(:), multiplier(:)
    !> Friction on the body at the start of the step and at the last evaluation [stress]; (3, :).
    real(wp), allocatable :: traction_old(:, :), traction(:, :)
    !> At the start of the step: penetration [length] and normal out of the tool; pressure and
    !> friction times area [force]; vectors of shape (3, n_contact).
    real(wp), allocatable :: penetration_old(:), normal_old(:, :), load_old(:), shear_old(:, :)
    !> Traction that bonds start from, before the tool turns, and how much the last evaluation
    !> changed it [stress]; shapes (3, :), (:).
    real(wp), allocatable :: bond(:, :), bond_change(:)
    !> In contact at the last evaluation; bonded since an earlier step where it cannot separate.
    logical, allocatable :: active(:), bonded(:)
    !> Area, penetration, pressure and contact at the start of the step.
    type(standing_t) :: accepted
    !> Changes of state during the step, the state before the last correction, and whether the node
    !> is held in its state.
    integer, allocatable :: n_change(:)
    logical, allocatable :: was_active(:), held(:)
    !> True for a node in contact at the start of the step; it stays so until the iterations have
    !> converged for the first time: then `keeping` ends when one of them pulls.
    logical, allocatable :: touched(:)
    logical :: keeping = .true.
    !> Force on each node, and its derivative by the node's position, of which the last is only
    !> kept for tools that ask for it [force], [force/length]; shapes (3, :), (3, 3, :).
    real(wp), allocatable :: node_force(:, :), node_stiffness(:, :, :)
    !> What a secant of friction has more than that [force/length]; shape (3, 3, :).
    real(wp), allocatable :: node_secant(:, :, :)
    !> Slip of the step at the last evaluation, and slip and friction before the last correction
    !> [length], [stress]; shape (3, :).
    real(wp), allocatable :: slip(:, :), slip_was(:, :), traction_was(:, :)
    !> Friction has turned about since then.
    logical, allocatable :: turned_about(:)
    !> Resistance to a change of the sliding rate.
    type(sliding_inertia_t) :: inertia
    !> Factor on the penalties of the start, at the start of the step and now [1].
    real(wp) :: growth_old = 1.0_wp
    real(wp) :: growth = 1.0_wp
    !> Augmentations of the step, releases of held nodes, and the penetration by the cell size that
    !> the last augmentation met [1].
    integer :: n_augmentation = 0
    integer :: n_release = 0
    real(wp) :: penetration_before = huge(1.0_wp)
    !> Force on the tool and its torque about the tool's reference point, of this rank's nodes.
    real(wp) :: force(3) = 0.0_wp
    real(wp) :: torque(3) = 0.0_wp
    !> Sum of the squared nodal forces of this rank, for the size of the problem's forces.
    real(wp) :: force_square = 0.0_wp
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
    !> What `augment` decides by, of this rank's nodes.
    procedure :: measure => tool_contact_measure
    !> Judge converged iterations: go on with other multipliers or states, or be done.
    procedure :: augment => tool_contact_augment
    !> Make the last evaluation the start of the next step.
    procedure :: accept => tool_contact_accept
    !> Forget the step.
    procedure :: reject => tool_contact_reject
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

    contact%name = name
    contact%tool = tool
    allocate (contact%friction, source=friction)
    contact%separation = separation
    allocate (contact%facet, source=facet)
    allocate (contact%node, source=node)
    allocate (contact%tag, source=tag)
    allocate (contact%size, source=size)
    allocate (contact%penalty, source=penalty)
    allocate (contact%tangential_stiffness, source=tangential_stiffness)
    n = ubound(node, 1)
    contact%enforcement = enforcement
    allocate (contact%area(n), contact%flow_stress(n), contact%penetration(n), &
              contact%pressure(n), contact%multiplier_old(n), contact%multiplier(n), &
              contact%bond_change(n), contact%penetration_old(n), contact%load_old(n), &
              source=0.0_wp)
    allocate (contact%traction_old(3, n), contact%traction(3, n), contact%shear_old(3, n), &
              contact%normal_old(3, n), contact%bond(3, n), contact%node_force(3, n), &
              contact%node_stiffness(3, 3, n), contact%node_secant(3, 3, n), &
              contact%slip(3, n), contact%slip_was(3, n), &
              contact%traction_was(3, n), source=0.0_wp)
    allocate (contact%active(n), contact%bonded(n), contact%was_active(n), contact%held(n), &
              contact%touched(n), contact%turned_about(n), source=.false.)
    allocate (contact%n_change(n), source=0)
    call sliding_inertia_create(inertia, n, contact%inertia)
    call remember_standing(contact)

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

  !> The old positions say whether a contact that cannot separate exists from the start.
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

    self%multiplier = self%multiplier_old
    self%bond = self%traction_old
    self%growth = self%growth_old
    self%held = .false.
    self%keeping = .true.
    self%traction_was = 0.0_wp
    self%was_active = self%active
    self%n_change = 0
    self%n_augmentation = 0
    self%n_release = 0
    self%penetration_before = huge(1.0_wp)
    do i = 1, size(self%node)
      self%area(i) = area(self%node(i))
      self%flow_stress(i) = flow_stress(self%node(i))
      point = 0.0_wp
      point(:size(x, 1)) = x(:, self%node(i))
      call tool_old%project(point, penetration, normal, hessian)
      self%penetration_old(i) = penetration
      self%normal_old(:, i) = normal
      self%touched(i) = self%multiplier(i) > 0.0_wp .or. penetration > 0.0_wp
      if (self%separation) cycle
      self%bonded(i) = self%bonded(i) .or. penetration > -TOUCHING * self%size(i)
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

    real(wp) :: bond(3), depth, hessian(3, 3), load, load_new, normal(3), normal_force(3), &
      penetration, point(3), shear(3), slip(3), springing, stored, turn(3, 3)
    integer :: i, n

    n = size(x_new, 1)
    turn = tool%rotation_increment
    do i = 1, size(self%node)
      if (.not. (self%active(i) .or. abs(self%load_old(i)) > 0.0_wp)) cycle
      point = 0.0_wp
      point(:n) = x_old(:, self%node(i))
      slip = -tool%carry(point)
      slip(:n) = slip(:n) + x_new(:, self%node(i))

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
      point(:n) = x_new(:, self%node(i))
      call tool%project(point, penetration, normal, hessian)
      normal_force = 0.5_wp * (self%load_old(i) * matmul(turn, self%normal_old(:, i)) &
                               + load_new * normal)
      stored = load * depth
      work%excess = work%excess - dot_product(normal_force, slip) - stored

      shear = 0.5_wp * (matmul(turn, self%shear_old(:, i)) + self%area(i) * self%traction(:, i))
      springing = 0.0_wp
      if (self%friction%has_history .and. self%tangential_stiffness(i) > 0.0_wp) then
        bond = matmul(turn, self%bond(:, i))
        springing = dot_product(shear, self%traction(:, i) - bond) &
          / (self%growth * self%tangential_stiffness(i))
      end if
      work%stored = work%stored + stored + springing
      work%friction = work%friction - dot_product(shear, slip) - springing
      work%inertia = work%inertia + self%inertia%work(i, self%area(i), slip)
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
    self%penetration(i) = penetration
    if (self%keeping .and. self%touched(i)) then
      ! A tool that goes away lets go
      self%touched(i) = dot_product(x_old - tool%carry(x_old), self%normal_old(:, i)) &
        <= max(self%penetration_old(i), 0.0_wp)
    end if
    if (.not. self%held(i)) then
      self%active(i) = self%bonded(i) .or. (self%keeping .and. self%touched(i)) .or. &
        self%multiplier(i) + penalty * (penetration + ROUNDING * self%size(i)) > 0.0_wp
    end if
    self%pressure(i) = 0.0_wp
    self%traction(:, i) = 0.0_wp
    self%bond_change(i) = 0.0_wp
    self%turned_about(i) = .false.
    if (.not. self%active(i)) return

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
    self%turned_about(i) = dot_product(point%traction, self%traction_was(:, i)) < 0.0_wp
    if (self%turned_about(i)) then
      point%secant = norm2(point%traction - self%traction_was(:, i)) &
        / norm2(point%slip - self%slip_was(:, i))
    end if
    secant = -self%area(i) * matmul(point%d_slip + point%secant * IDENTITY, d_slip)
    if (self%pressure(i) > 0.0_wp) column = self%area(i) * dyadic(point%d_pressure, d_pressure)

  end subroutine tool_contact_press

  !> The tangent of a point that slides at the limit has no stiffness along the slip: where all do,
  !> a body that friction alone moves would fly away in one correction. A secant takes it along with
  !> the tool. Where friction has turned about in the last correction, the secant between both
  !> states leads to where it vanishes.
  subroutine tool_contact_watch(self, takes_secants, matrix)
    class(tool_contact_t), intent(inout) :: self
    !> For all nodes; else only for those whose friction has turned about.
    logical, intent(in) :: takes_secants
    !> As [[tool_contact_t:evaluate]] left it.
    type(block_matrix_t), intent(inout) :: matrix

    integer :: i, n

    n = matrix%n_slot - 1
    do i = 1, size(self%node)
      if (self%active(i) .and. (takes_secants .or. self%turned_about(i))) then
        associate (block => matrix%values(:n, :n, matrix%diagonal(self%node(i))))
          block = block - self%node_secant(:n, :n, i)
        end associate
        self%node_stiffness(:, :, i) = self%node_stiffness(:, :, i) + self%node_secant(:, :, i)
      end if
      if (self%active(i) .neqv. self%was_active(i)) self%n_change(i) = self%n_change(i) + 1
      self%was_active(i) = self%active(i)
      if (self%n_change(i) > FREE_CHANGES) self%held(i) = .true.
    end do
    self%slip_was = self%slip
    self%traction_was = self%traction

  end subroutine tool_contact_watch

  !> Maxima over this rank's nodes, to be made those of all ranks.
  pure subroutine tool_contact_measure(self, measures)
    class(tool_contact_t), intent(in) :: self
    !> Largest penetration or gap of a node that is pressed, by its cell size [1]; largest change of
    !> multipliers and bonds that an augmentation would make; largest pressure [stress]; the
    !> precedence of the first held node that contradicts its state, 0 when there is none.
    real(wp), intent(out) :: measures(4)

    integer :: i

    measures = 0.0_wp
    do i = 1, size(self%node)
      if (self%active(i)) then
        measures(1) = max(measures(1), abs(self%penetration(i)) / self%size(i))
      end if
      measures(2) = max(measures(2), abs(self%pressure(i) - self%multiplier(i)), &
                        self%bond_change(i))
      measures(3) = max(measures(3), abs(self%pressure(i)))
      if (contradicts(self, i)) measures(4) = max(measures(4), precedence(self%tag(i)))
    end do

  end subroutine tool_contact_measure

  !> Positive, larger for smaller numbers.
  elemental function precedence(tag)
    integer(gp), intent(in) :: tag
    real(wp) :: precedence

    precedence = 2.0_wp**digits(1.0_wp) - real(tag, wp)

  end function precedence

  !> True for a node that is held in a state that is not its own.
  pure function contradicts(self, i) result(wrong)
    type(tool_contact_t), intent(in) :: self
    integer, intent(in) :: i
    logical :: wrong

    real(wp) :: penalty

    wrong = .false.
    if (.not. (self%held(i) .or. (self%keeping .and. self%touched(i)))) return
    if (self%bonded(i)) return
    penalty = self%growth * self%penalty(i)
    wrong = self%active(i) .neqv. &
      self%multiplier(i) + penalty * (self%penetration(i) + ROUNDING * self%size(i)) > 0.0_wp

  end function contradicts

  !> Held nodes that contradict their state change it all at once; from the second time on the first
  !> one alone, in a fixed order, which cannot cycle where the whole problem has one solution
  !> (K. G. Murty, Opsearch 11, 1974).
  pure subroutine tool_contact_augment(self, tool, measures, done, gives_up)
    class(tool_contact_t), intent(inout) :: self
    !> At the end of the step.
    type(rigid_tool_t), intent(in) :: tool
    !> Of [[tool_contact_t:measure]], maxima over all ranks.
    real(wp), intent(in) :: measures(4)
    !> False when the iterations must go on.
    logical, intent(out) :: done
    !> True when nodes were found wrong too often: the step must be cut.
    logical, intent(out) :: gives_up

    integer :: i

    done = .true.
    gives_up = .false.
    if (measures(4) > 0.0_wp) then
      done = .false.
      if (self%keeping) then
        self%keeping = .false.
        return
      end if
      self%n_release = self%n_release + 1
      gives_up = self%n_release > MAXIMUM_RELEASES
      do i = 1, size(self%node)
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
      self%multiplier = self%pressure
      do i = 1, size(self%node)
        self%bond(:, i) = matmul(self%traction(:, i), tool%rotation_increment)
      end do
      if (measures(1) > rule%penetration_tolerance &
          .and. measures(1) > EXPECTED_SHARE * self%penetration_before) then
        self%growth = min(self%growth * PENALTY_GROWTH, LARGEST_GROWTH)
      end if
      self%penetration_before = measures(1)
    end associate

  end subroutine tool_contact_augment

  subroutine tool_contact_accept(self)
    class(tool_contact_t), intent(inout) :: self

    call remember_forces(self)
    call self%inertia%accept(self%area, self%active .and. norm2(self%traction, dim=1) > 0.0_wp, &
                             self%slip)
    self%traction_old = self%traction
    if (self%enforcement%kind == AUGMENTED_LAGRANGIAN) self%multiplier_old = self%pressure
    self%growth_old = self%growth
    if (.not. self%separation) self%bonded = self%bonded .or. self%active
    call remember_standing(self)

  end subroutine tool_contact_accept

  subroutine tool_contact_reject(self)
    class(tool_contact_t), intent(inout) :: self

    self%area = self%accepted%area
    self%penetration = self%accepted%penetration
    self%pressure = self%accepted%pressure
    self%active = self%accepted%active
    self%traction = self%traction_old

  end subroutine tool_contact_reject

  pure subroutine remember_standing(self)
    class(tool_contact_t), intent(inout) :: self

    self%accepted%area = self%area
    self%accepted%penetration = self%penetration
    self%accepted%pressure = self%pressure
    self%accepted%active = self%active

  end subroutine remember_standing

  !> Make the forces of the last evaluation those of the start of the next step.
  pure subroutine remember_forces(self)
    class(tool_contact_t), intent(inout) :: self

    integer :: i

    self%traction_old = self%traction
    self%load_old = self%area * self%pressure
    do i = 1, size(self%node)
      self%shear_old(:, i) = self%area(i) * self%traction(:, i)
    end do

  end subroutine remember_forces

  subroutine tool_contact_save(self, snapshot)
    class(tool_contact_t), intent(in) :: self
    type(snapshot_t), intent(inout) :: snapshot

    character(len=:), allocatable :: title

    title = 'contact '//self%name//': '
    call snapshot%put(title//'bonded', self%bonded, OF_SOME_NODES, self%node)
    associate (now => self%accepted)
      call snapshot%put(title//'active', now%active, OF_SOME_NODES, self%node)
      call snapshot%put(title//'area', now%area, OF_SOME_NODES, self%node)
      call snapshot%put(title//'penetration', now%penetration, OF_SOME_NODES, self%node)
      call snapshot%put(title//'pressure', now%pressure, OF_SOME_NODES, self%node)
    end associate
    call snapshot%put(title//'traction', self%traction_old, OF_SOME_NODES, self%node)
    call snapshot%put(title//'multiplier', self%multiplier_old, OF_SOME_NODES, self%node)
    call snapshot%put(title//'penalty growth', self%growth_old)
    call self%inertia%save(title, self%node, snapshot)

  end subroutine tool_contact_save

  subroutine tool_contact_load(self, snapshot, status)
    class(tool_contact_t), intent(inout) :: self
    type(snapshot_t), intent(in) :: snapshot
    !> `STATUS_ERROR` on this rank when something is missing.
    type(status_t), intent(inout) :: status

    character(len=:), allocatable :: title

    title = 'contact '//self%name//': '
    call snapshot%get(title//'bonded', self%bonded, status, OF_SOME_NODES, self%node)
    call snapshot%get(title//'active', self%active, status, OF_SOME_NODES, self%node)
    call snapshot%get(title//'area', self%area, status, OF_SOME_NODES, self%node)
    call snapshot%get(title//'penetration', self%penetration, status, OF_SOME_NODES, self%node)
    call snapshot%get(title//'pressure', self%pressure, status, OF_SOME_NODES, self%node)
    call snapshot%get(title//'traction', self%traction, status, OF_SOME_NODES, self%node)
    call remember_forces(self)
    call snapshot%get(title//'traction', self%traction_old, status, OF_SOME_NODES, self%node)
    call snapshot%get(title//'multiplier', self%multiplier_old, status, OF_SOME_NODES, self%node)
    call snapshot%get(title//'penalty growth', self%growth_old, status)
    call self%inertia%load(title, self%node, snapshot, status)
    self%traction = self%traction_old
    call remember_standing(self)

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
