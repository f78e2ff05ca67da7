!> Quasi-static deformation of bodies on one mesh, in contact with rigid tools and with each other.
!>
!> The unknowns of a step are the displacement increments and the pressures at its end; the
!> residual is internal minus external force, then the volume equation. What belongs to the end of
!> the step is kept apart from what belongs to its start until `accept_step`, so a rejected step
!> leaves no trace.
module swage_mechanics
  use swage_block_matrix, only: block_matrix_t
  use swage_body_contact, only: body_contact_t
  use swage_boundary, only: boundary_t
  use swage_cell_geometry, only: AXISYMMETRIC, cell_volume, THREE_DIMENSIONAL
  use swage_comm, only: comm_t
  use swage_constraints, only: constraints_t
  use swage_contact_formulation, only: contact_formulation_t
  use swage_contact_pair, only: contact_pair_t
  use swage_contact_rows, only: contact_blocks_t, contact_rows_t
  use swage_deck, only: deck_t
  use swage_energy_balance, only: energy_balance_t
  use swage_field_list, only: field_list_t
  use swage_kinds, only: gp, wp
  use swage_linear_solver, only: linear_solver_t
  use swage_material_law, only: material_law_t
  use swage_mesh, only: mesh_t
  use swage_mini_element, only: mini_batch_t
  use swage_newton, only: newton_problem_t
  use swage_phase_times, only: phase_times_t, PHASE_CELLS, PHASE_CONTACT
  use swage_point_batch, only: LANES, point_batch_t
  use swage_rigid_tool, only: rigid_tool_t
  use swage_shared_surface, only: shared_surface_t
  use swage_snapshot, only: snapshot_t
  use swage_status, only: EXIT_CONVERGENCE, status_t, STATUS_RETRY
  use swage_text, only: near, text
  use swage_tool_contact, only: tool_contact_t
  use swage_unknowns, only: unknowns_t
  implicit none(type, external)
  private

  public :: mechanics_t, mechanics_settings_t, mechanics_create, mechanics_explain
  public :: material_entry_t, body_entry_t

  !> Forces below this share of the cells' own are noise: the least reference of the equilibrium.
  real(wp), parameter :: FORCE_FLOOR = 1.0e-4_wp
  !> The least reference by the largest of the run: a body that has been released carries nothing.
  real(wp), parameter :: RELEASED = 1.0e-3_wp
  !> Stiffness against displacement that only the tangent has, by its diagonal: a body that has
  !> lost all contact stays where it is, and the residual does not know.
  real(wp), parameter :: STABILISATION = 1.0e-12_wp
  !> The least strain of a step that forces and volumes are measured by: what a motion of the whole
  !> leaves in the cells is rounding.
  real(wp), parameter :: LEAST_STRAIN = 1.0e-7_wp
  !> A step that does less work than this share of the largest so far, as one that only turns a
  !> body, is held to that [1].
  real(wp), parameter :: WORK_SHARE = 0.1_wp
  !> Residuals that do no work that counts, by the scale of the force and by the least force, of
  !> which rounding is a part: a body without stress that turns [1].
  real(wp), parameter :: NEGLIGIBLE = 1.0e-9_wp
  real(wp), parameter :: RESIDUAL_ROUNDING = 1.0e-5_wp
  !> Share of its volume at which a cell counts as flattened by a first guess, and halvings of the
  !> guess that prevent it.
  real(wp), parameter :: FLATTENED = 0.2_wp
  integer, parameter :: RATE_HALVINGS = 3
  !> Longest correction that is trusted, by the cell size and by the motion of the step so far.
  real(wp), parameter :: TRUSTED_CELLS = 0.25_wp
  real(wp), parameter :: TRUSTED_MOTION = 1.0_wp
  !> Prescribed motion still to be imposed counts as none below this share of the mesh's cell size.
  real(wp), parameter :: IMPOSED = 1.0e-13_wp

  !> Numbers of the method.
  type :: mechanics_settings_t
    !> `PLANE_STRAIN`, `AXISYMMETRIC` or `THREE_DIMENSIONAL`.
    integer :: kind = THREE_DIMENSIONAL
    !> True when coordinates never move (small strain).
    logical :: fixed_geometry = .false.
    !> One of [[linear_solver_names]].
    character(len=:), allocatable :: linear_solver
    !> Factor on the bubble's stabilising block [1].
    real(wp) :: bubble_factor = 1.0_wp
    !> Grad-div modulus by the flow stress [1].
    real(wp) :: grad_div = 1.0_wp
    !> Kelvin [temperature].
    real(wp) :: initial_temperature = 293.15_wp
  end type mechanics_settings_t

  !> A law with the name of its group.
  type :: material_entry_t
    character(len=:), allocatable :: name
    class(material_law_t), allocatable :: law
    !> True once a warning has said that strain or rate are beyond what the law knows.
    logical :: told_strain = .false., told_rate = .false.
  end type material_entry_t

  !> A body: the cells of a group, made of a material.
  type :: body_entry_t
    character(len=:), allocatable :: name
    integer :: material = 0
    !> Group of the mesh.
    integer :: group = 0
  end type body_entry_t

  !> Consecutive cells of `cell_order` that share a material.
  type :: cell_range_t
    integer :: first = 0
    integer :: last = 0
    integer :: material = 0
  end type cell_range_t

  !> What the errors of a step are measured by: sums over the cells, of each place in a batch.
  type :: step_size_t
    !> Of the squared nodal forces.
    real(wp) :: force(LANES) = 0.0_wp
    !> Of volume times equivalent strain increment.
    real(wp) :: strained_volume(LANES) = 0.0_wp
    !> Of the size of the work in the step, as the forces at its end do it [energy].
    real(wp) :: work(LANES) = 0.0_wp
  end type step_size_t

  !> A boundary with its place in the mesh.
  type :: boundary_place_t
    type(boundary_t) :: boundary
    !> Start of messages about it.
    character(len=:), allocatable :: title
    !> Local nodes and boundary facets.
    integer, allocatable :: node(:), facet(:)
    !> Of a symmetry plane.
    real(wp) :: normal(3) = 0.0_wp
    !> Nodal force of a unit traction: areas [length^2]; shape (n_node of the mesh).
    real(wp), allocatable :: area(:)
  end type boundary_place_t

  !> Two surfaces of bodies that may touch.
  type :: body_pair_t
    type(contact_pair_t) :: surfaces
    class(contact_formulation_t), allocatable :: formulation
    type(body_contact_t) :: contact
    !> Conditions of the last evaluation, their stiffness, and the part of it that a symmetric
    !> factor leaves out.
    type(contact_rows_t) :: rows
    type(contact_blocks_t) :: blocks, unsymmetric
    !> For the log: why the slave is the slave, and what is wrong with it; empty for nothing.
    character(len=:), allocatable :: choice, warning
  end type body_pair_t

  !> Coordinates of tools that follow from forces, those of all tools in one list.
  type :: controls_t
    integer :: n = 0
    !> Place of the tool, and of the control in the tool; shape (n).
    integer, allocatable :: tool(:), place(:)
    !> Tools with a node in contact at the last evaluation; shape (n_tool).
    logical, allocatable :: touches(:)
    !> True when a tool that touches nothing is driven by a force.
    logical :: falls = .false.
    !> Action of the bodies less that from outside [force], or [torque]; shape (n).
    real(wp), allocatable :: residual(:)
    !> Its derivative by the coordinates at fixed nodes; shape (n, n).
    real(wp), allocatable :: tangent(:, :)
    !> Stiffness of the penalties against each coordinate; shape (n).
    real(wp), allocatable :: stiffness(:)
    !> Largest lever of the surface: 1 for translations, a length for rotations; shape (n).
    real(wp), allocatable :: reach(:)
    !> The last correction, and the coordinates it starts from; shape (n).
    real(wp), allocatable :: correction(:), base(:)
    !> Of the last correction: how the nodes give way to each coordinate, derivatives of the
    !> residuals by the nodes, both along the local axes of the constraints, and the system left for
    !> the coordinates; shapes (n_dim + 1, n_node, n), (n, n).
    real(wp), allocatable :: response(:, :, :), row(:, :, :), system(:, :)
  end type controls_t

  type, extends(newton_problem_t) :: mechanics_t
    type(comm_t) :: comm
    type(mechanics_settings_t) :: settings
    !> Name of the unit system.
    character(len=:), allocatable :: units
    !> Coordinates are those of the start of the step.
    type(mesh_t) :: mesh
    type(unknowns_t) :: unknowns
    type(material_entry_t), allocatable :: materials(:)
    type(body_entry_t), allocatable :: bodies(:)
    type(boundary_place_t), allocatable :: boundaries(:)
    type(rigid_tool_t), allocatable :: tools(:)
    type(tool_contact_t), allocatable :: contacts(:)
    type(controls_t) :: controls
    type(body_pair_t), allocatable :: pairs(:)
    !> Surfaces of the pairs, and where their nodes are at both ends of the step [length]; shape
    !> (3, n_node of the surfaces).
    type(shared_surface_t) :: surface
    real(wp), allocatable :: surface_start(:, :), surface_moved(:, :)
    !> The last tangent had the secants of friction of all conditions.
    logical :: has_secants = .false.
    !> Place in `materials` and `bodies`; shape (n_cell).
    integer, allocatable :: material_of_cell(:), body_of_cell(:)

    !> Time of the start and end of the step [time].
    real(wp) :: time = 0.0_wp
    real(wp) :: time_new = 0.0_wp
    !> Length of the last accepted step [time], 0 before the first.
    real(wp) :: dt_last = 0.0_wp
    !> Length of the step before [time], 0 when its rate has nothing to do with the last one's.
    real(wp) :: dt_before = 0.0_wp

    ! Nodes

    !> Positions before the first step [length]; shape (n_dim, n_node).
    real(wp), allocatable :: initial_coordinates(:, :)
    !> Displacement increments of the step, of the last one and the one before [length]; shape
    !> (n_dim, n_node).
    real(wp), allocatable :: increment(:, :), increment_last(:, :), increment_before(:, :)
    !> Pressures of the end and the start of the step, and of the starts of the last one and the one
    !> before [stress]; shape (n_node of the unknowns).
    real(wp), allocatable :: pressure_new(:), pressure(:), pressure_last(:), pressure_before(:)
    !> Displacement since the start of the run [length]; shape (n_dim, n_node).
    real(wp), allocatable :: displacement(:, :)
    !> Kelvin [temperature]; shape (n_node).
    real(wp), allocatable :: temperature(:)

    ! Cells


    !> Deviator at the start and end of the step, Mandel [stress]; shape (6, n_cell).
    real(wp), allocatable :: deviator(:, :), deviator_new(:, :)
    !> ln(V/V0) likewise [1]; shape (n_cell).
    real(wp), allocatable :: log_volume(:), log_volume_new(:)
    !> Volume at the end, and before the first step [length^3]; shape (n_cell).
    real(wp), allocatable :: volume_new(:), initial_volume(:)
    !> History at both ends; shape (n_state, n_cell).
    real(wp), allocatable :: state(:, :), state_new(:, :)
    !> Mean stress at the start and the end, grad-div included [stress]; shape (n_cell).
    real(wp), allocatable :: mean_stress_old(:), mean_stress(:)
    !> Frozen over the step: 2µ and θ of the bubble, flow stress; shape (n_cell).
    real(wp), allocatable :: bubble_modulus(:), relaxation(:), flow_stress(:)
    !> What the law says at the end of the step; shape (n_cell).
    real(wp), allocatable :: bubble_modulus_new(:), relaxation_new(:), flow_stress_new(:)
    !> Cells in the order of their batches, and the batches.
    integer, allocatable :: cell_order(:)
    type(cell_range_t), allocatable :: batches(:)
    type(mini_batch_t), allocatable :: element
    type(point_batch_t) :: points

    ! Equations

    type(constraints_t) :: constraints
    type(block_matrix_t) :: matrix
    class(linear_solver_t), allocatable :: solver
    !> Internal minus external forces, then the volume equation; shape (n_dim + 1, n_node of the
    !> unknowns).
    real(wp), allocatable :: residual(:, :)
    !> The last correction, and the unknowns it starts from; shape (n_dim + 1, n_node of the
    !> unknowns).
    real(wp), allocatable :: correction(:, :), base(:, :)
    !> Largest size of the forces at the accepted steps.
    real(wp) :: largest_force_scale = 0.0_wp
    !> Size of the reactions, contact forces and loads at the last evaluation.
    real(wp) :: carried_force = 0.0_wp
    !> False when the last step left the bodies without any force: its rate was that of the release.
    logical :: carries = .true.
    !> Norm of the nodal forces that `LEAST_STRAIN` makes [force].
    real(wp) :: least_force = 0.0_wp
    !> The step starts from rest, not from the rate of the last one.
    logical :: starts_from_rest = .true.
    !> Evaluations of this step, and of the run.
    integer :: n_evaluation = 0
    !> Mean cell size of the mesh [length].
    real(wp) :: cell_size = 0.0_wp
    !> Slip rate of the regularisation of friction, where a law has none of its own [length/time].
    real(wp) :: slip_rate = 0.0_wp
    !> Shortest step that a law recommends [time].
    real(wp) :: recommended_step = huge(1.0_wp)
    !> The own node where the forces are most out of balance, 0 for none, and their square there.
    integer :: worst_node = 0
    real(wp) :: worst_force = -1.0_wp
    !> Lines for the log.
    character(len=:), allocatable :: notes
    !> At the last accepted step.
    type(energy_balance_t) :: energies
    !> Force of the prescribed motion on each node there, 0 where it is free; (n_dim, n_node).
    real(wp), allocatable :: support_force(:, :)
    !> What bodies add to the residual of each own node where they touch, at the last accepted step
    !> and at the last evaluation [force]; not allocated without such contact; (n_dim, n_node).
    real(wp), allocatable :: contact_force(:, :), contact_force_new(:, :)
    !> Power-conjugate forces at the last accepted step: tools (6), boundaries (3); see history.
    real(wp), allocatable :: tool_force(:, :), reaction(:, :), load_force(:, :)
    !> Time spent on cells and contact; that of equations is in `solver`.
    type(phase_times_t) :: times
  contains
    procedure :: evaluate => mechanics_evaluate
    procedure :: correct => mechanics_correct
    procedure :: move => mechanics_move
    procedure :: describe_worst => mechanics_describe_worst
    !> Collective. What the contacts may have to do with the failure of a step.
    procedure :: blame_contact => mechanics_blame_contact
    procedure :: augment => mechanics_augment
    procedure :: trusted_share => mechanics_trusted_share
    !> Collective. Prepare a step: motion to impose, areas of contact, first guess.
    procedure :: begin_step => mechanics_begin_step
    !> Collective. Make the end of the step the start of the next.
    procedure :: accept_step => mechanics_accept_step
    !> Forget the step.
    procedure :: reject_step => mechanics_reject_step
    !> Kinematics of a batch of cells, from the unknowns at hand.
    procedure :: gather => mechanics_gather
    !> Where the nodes are at the start of the step [length]; shape (n_dim, n_node).
    procedure :: positions => mechanics_positions
    !> Next kink of a motion or load.
    procedure :: next_event => mechanics_next_event
    !> True when the rate of the last step tells nothing about the next.
    procedure :: changes_course => mechanics_changes_course
    !> Longest step that the laws recommend.
    procedure :: suggested_time_step => mechanics_suggested_time_step
    !> Names and dimensions of what [[mechanics_t:history_values]] returns.
    procedure :: history_columns => mechanics_history_columns
    !> Collective. Forces, motion, contact, mass error and energies at the last accepted step.
    procedure :: history_values => mechanics_history_values
    !> Collective. Fields at the last accepted step.
    procedure :: collect_fields => mechanics_collect_fields
    !> Collective. The tools as they stand, for pictures: on rank 0, empty elsewhere.
    procedure :: tool_surface => mechanics_tool_surface
    !> What of the input works and may still be a mistake; lines for a warning, empty for none.
    procedure :: doubts => mechanics_doubts
    !> Collective. What was read and built, for the log.
    procedure :: summary => mechanics_summary
    !> Collective. A snapshot of this problem, still empty.
    procedure :: start_snapshot => mechanics_start_snapshot
    !> Put the state after the last accepted step into a snapshot.
    procedure :: save => mechanics_save
    !> Collective. Take it back; the problem has been created from the same input.
    procedure :: load => mechanics_load
    !> Collective. The next warning about strains and rates of the last accepted step that are
    !> beyond what the laws know, each once for a material.
    procedure :: find_extrapolation => mechanics_find_extrapolation
    !> Lines for the log since the last call.
    procedure :: take_report => mechanics_take_report
    !> Release the factors.
    procedure :: finish => mechanics_finish
  end type mechanics_t

  interface
    !> Collective. Read bodies, materials, boundaries, tools and contacts from the deck, check them
    !> against the mesh, and build the equations.
    module subroutine mechanics_create(comm, deck, units, mesh, settings, mechanics, status)
      implicit none(type, external)
      type(comm_t), intent(in) :: comm
      type(deck_t), intent(in) :: deck
      !> Name of the unit system.
      character(len=*), intent(in) :: units
      !> Moved into `mechanics`: empty afterwards.
      type(mesh_t), intent(inout) :: mesh
      type(mechanics_settings_t), intent(in) :: settings
      type(mechanics_t), intent(inout) :: mechanics
      !> `STATUS_ERROR`, the same on all ranks.
      type(status_t), intent(inout) :: status
    end subroutine mechanics_create

    !> Collective. Read the contacts, with tools and between bodies.
    module subroutine read_contacts(self, deck, status)
      implicit none(type, external)
      type(mechanics_t), intent(inout) :: self
      type(deck_t), intent(in) :: deck
      !> `STATUS_ERROR`.
      type(status_t), intent(inout) :: status
    end subroutine read_contacts

    !> Place of a group that must exist and hold something; a fault goes to the input group.
    module function checked_group(self, group, key, name, n_dim) result(place)
      use swage_group, only: group_t
      implicit none(type, external)
      type(mechanics_t), intent(in) :: self
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      character(len=*), intent(in) :: name
      !> Dimension of the entities that are meant; any when negative.
      integer, intent(in) :: n_dim
      integer :: place
    end function checked_group

    !> Record the keys of `&body`, `&interface`, `&boundary` or `&contact` in a group made for
    !> explaining.
    module subroutine mechanics_explain(kind, group)
      use swage_group, only: group_t
      implicit none(type, external)
      character(len=*), intent(in) :: kind
      type(group_t), intent(inout) :: group
    end subroutine mechanics_explain

    !> Collective. Axis, boundaries taken together, support.
    module subroutine check_whole(self, deck, status)
      implicit none(type, external)
      type(mechanics_t), intent(inout) :: self
      type(deck_t), intent(in) :: deck
      !> `STATUS_ERROR`, the same on all ranks.
      type(status_t), intent(inout) :: status
    end subroutine check_whole

    !> Directions and increments that the boundaries impose in this step.
    module subroutine prescribe_motion(self, status)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      type(status_t), intent(inout) :: status
    end subroutine prescribe_motion

    !> Order the cells and make room for their batches.
    module subroutine build_batches(self, n_state)
      implicit none(type, external)
      type(mechanics_t), intent(inout) :: self
      !> Largest of the laws.
      integer, intent(in) :: n_state
    end subroutine build_batches

    !> Residual and tangent of a batch of cells, and what belongs to the end of the step.
    module subroutine evaluate_batch(self, range, size_of_step, status)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      type(cell_range_t), intent(in) :: range
      type(step_size_t), intent(inout) :: size_of_step
      !> `STATUS_RETRY` when a cell is inverted or the law fails.
      type(status_t), intent(inout) :: status
    end subroutine evaluate_batch

    !> Kinematics of a batch of cells, from the unknowns at hand, and all that its law asks for.
    module subroutine mechanics_gather(self, range)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      type(cell_range_t), intent(in) :: range
    end subroutine mechanics_gather

    !> Tractions and pressures of the boundaries.
    module subroutine apply_loads(self, moved)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Positions at the end of the step.
      real(wp), intent(in) :: moved(:, :)
    end subroutine apply_loads

    !> Part of a facet's vector that each of its nodes gets, with the turn in axial symmetry.
    pure module function facet_share(self, x) result(part)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      !> Vertices [length]; shape (n_dim, n_dim).
      real(wp), intent(in) :: x(:, :)
      !> [1], in axial symmetry [length].
      real(wp) :: part(size(x, 2))
    end function facet_share

    !> Collective. Give the multipliers of the contacts what the penalties carry, until that is
    !> nothing; release nodes that are held in a wrong state.
    module subroutine mechanics_augment(self, done, status)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      logical, intent(out) :: done
      type(status_t), intent(inout) :: status
    end subroutine mechanics_augment

    !> List the coordinates of tools that follow from forces.
    module subroutine create_controls(self)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
    end subroutine create_controls

    !> Collective. Move all tools to the step; controlled ones go on as in the last step, and as far
    !> as the bodies.
    module subroutine begin_tools(self, share)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Of the last step's increments that the first guess repeats [1].
      real(wp), intent(in) :: share
    end subroutine begin_tools

    !> Collective. Residual and tangent of the controlled coordinates, after the contacts.
    module subroutine balance_tools(self, moved)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Positions of the nodes at the end of the step [length].
      real(wp), intent(in) :: moved(:, :)
    end subroutine balance_tools

    !> Collective. Correct the tools with the nodes: changes `correction`, along the local axes of
    !> the constraints, from that of fixed tools to that of both.
    module subroutine correct_tools(self, weight, status)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Of the slots of a residual, for the linear solver; shape (n_dim + 1).
      real(wp), contiguous, intent(in) :: weight(:)
      type(status_t), intent(inout) :: status
    end subroutine correct_tools

    !> Collective. Let the controlled tools follow forces and a motion of the nodes.
    module subroutine follow_with_tools(self, force, motion, step)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      !> Along the controlled coordinates, all ranks together; shape (n of the controls).
      real(wp), intent(in) :: force(:)
      !> Of the nodes with fixed tools on entry, with both on return; along the local axes.
      real(wp), intent(inout) :: motion(:, :)
      !> Of the coordinates; shape of `force`.
      real(wp), intent(out) :: step(:)
    end subroutine follow_with_tools

    !> Collective. Where boundaries hold the nodes, for the contacts that ask.
    module subroutine share_freedom(self)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
    end subroutine share_freedom

    !> Collective. Correct the multipliers with the nodes: changes `correction`, along the local
    !> axes of the constraints, from that of held multipliers to that of both.
    module subroutine correct_multipliers(self, weight, status)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Of the slots of a residual, for the linear solver; shape (n_dim + 1).
      real(wp), contiguous, intent(in) :: weight(:)
      type(status_t), intent(inout) :: status
    end subroutine correct_multipliers

    !> Set the controlled coordinates to their base plus a share of the correction.
    module subroutine move_tools(self, step_length)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      real(wp), intent(in) :: step_length
    end subroutine move_tools

    !> The controlled tool that makes most of the error, for messages; empty when none does.
    module function out_of_balance(self) result(words)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      character(len=:), allocatable :: words
    end function out_of_balance

    !> Collective. Where forces are most out of balance.
    module function mechanics_describe_worst(self) result(place)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      character(len=:), allocatable :: place
    end function mechanics_describe_worst

    !> Collective. What the contacts may have to do with the failure of a step.
    module subroutine mechanics_blame_contact(self, words)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      !> To be appended to the message; empty where there is nothing to say.
      character(len=:), allocatable, intent(out) :: words
    end subroutine mechanics_blame_contact

    !> Collective. Conditions between bodies at the start of the step.
    module subroutine begin_pairs(self, flow_stress)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Of the nodes of the mesh [stress]; shape (1, n_node).
      real(wp), intent(in) :: flow_stress(:, :)
    end subroutine begin_pairs

    !> Collective. Forces between bodies, and their stiffness.
    module subroutine evaluate_pairs(self, moved)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Positions of the nodes at the end of the step [length].
      real(wp), intent(in) :: moved(:, :)
    end subroutine evaluate_pairs

    !> Collective. As the constraints do with the matrix of the cells.
    module subroutine constrain_coupling(self, rest, load)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Along the local axes; shape (n_dim + 1, n_node of the unknowns).
      real(wp), intent(in) :: rest(:, :)
      !> On every copy; shape of `rest`.
      real(wp), intent(inout) :: load(:, :)
    end subroutine constrain_coupling

    !> Once an iteration: hold nodes that alternate between contact and none; take the secant of
    !> friction where its tangent leads nowhere.
    module subroutine prepare_contacts(self)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
    end subroutine prepare_contacts

    module subroutine mechanics_find_extrapolation(self, warning)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      !> Empty when there is no more.
      character(len=:), allocatable, intent(out) :: warning
    end subroutine mechanics_find_extrapolation

    !> Collective. Forces of the step, and the works since the last one.
    module subroutine collect_work(self)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
    end subroutine collect_work

    !> Collective. The linear solver, made when it is first needed.
    module subroutine create_solver(self, status)
      implicit none(type, external)
      type(mechanics_t), intent(inout) :: self
      type(status_t), intent(inout) :: status
    end subroutine create_solver

    module subroutine mechanics_history_columns(self, names, dimensions)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      character(len=64), allocatable, intent(out) :: names(:)
      character(len=64), allocatable, intent(out) :: dimensions(:)
    end subroutine mechanics_history_columns

    module subroutine mechanics_history_values(self, values)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: values(:)
    end subroutine mechanics_history_values

    module subroutine mechanics_collect_fields(self, fields)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      type(field_list_t), intent(out) :: fields
    end subroutine mechanics_collect_fields

    module subroutine mechanics_tool_surface(self, points, connectivity, offsets, types)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      !> Shape (3, n_point).
      real(wp), allocatable, intent(out) :: points(:, :)
      !> Points of all cells, from 0.
      integer(gp), allocatable, intent(out) :: connectivity(:)
      !> Where each cell starts in `connectivity`, and the end.
      integer(gp), allocatable, intent(out) :: offsets(:)
      !> VTK cell types.
      integer, allocatable, intent(out) :: types(:)
    end subroutine mechanics_tool_surface

    module subroutine mechanics_start_snapshot(self, snapshot)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      type(snapshot_t), intent(out) :: snapshot
    end subroutine mechanics_start_snapshot

    module subroutine mechanics_save(self, snapshot)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      type(snapshot_t), intent(inout) :: snapshot
    end subroutine mechanics_save

    module subroutine mechanics_load(self, snapshot, status)
      implicit none(type, external)
      class(mechanics_t), intent(inout) :: self
      type(snapshot_t), intent(in) :: snapshot
      !> `STATUS_ERROR`, the same on all ranks, when something is missing.
      type(status_t), intent(inout) :: status
    end subroutine mechanics_load

    module subroutine mechanics_doubts(self, text)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: text
    end subroutine mechanics_doubts

    module subroutine mechanics_summary(self, text)
      implicit none(type, external)
      class(mechanics_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: text
    end subroutine mechanics_summary
  end interface

contains

  subroutine mechanics_begin_step(self, time_old, time_new, extrapolate, status)
    class(mechanics_t), intent(inout) :: self
    real(wp), intent(in) :: time_old
    real(wp), intent(in) :: time_new
    !> Start from the rate of the last step; else from rest.
    logical, intent(in) :: extrapolate
    !> `STATUS_ERROR` when boundaries contradict each other at a node.
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: area(:, :), flow_stress(:, :)
    type(rigid_tool_t) :: tool_old
    real(wp) :: share
    integer :: i

    self%time = time_old
    self%time_new = time_new
    self%n_evaluation = 0
    call prescribe_motion(self, status)
    call self%comm%agree(status)
    if (status%failed()) return

    if (self%changes_course(time_old)) call expect_elasticity(self)
    if (extrapolate .and. self%carries .and. self%dt_last > 0.0_wp) then
      call extrapolate_rate(self, time_new - time_old, share)
    else
      share = 0.0_wp
      self%increment = 0.0_wp
      self%pressure_new = self%pressure
    end if

    self%starts_from_rest = .not. share > 0.0_wp
    call share_freedom(self)
    call self%times%begin(PHASE_CONTACT)
    call begin_tools(self, share)
    allocate (area(1, self%mesh%n_node))
    if (size(self%contacts) + size(self%pairs) > 0) call nodal_flow_stress(self, flow_stress)
    do i = 1, size(self%contacts)
      associate (contact => self%contacts(i), tool => self%tools(self%contacts(i)%tool))
        tool_old = tool
        call tool_old%begin_step(time_old, time_old)
        call contact%gather_areas(tool, self%settings%kind == AXISYMMETRIC, &
                                  self%mesh%facet_node, self%mesh%coordinates, area)
        call self%mesh%halo%accumulate(area)
        contact%inertia%is_steady = self%carries .and. self%dt_last > 0.0_wp &
          .and. .not. self%changes_course(time_old)
        call contact%begin_step(tool_old, self%positions(), area(1, :), flow_stress(1, :))
      end associate
    end do
    if (size(self%pairs) > 0) call begin_pairs(self, flow_stress(1:1, :))
    call self%times%end(PHASE_CONTACT)

  end subroutine mechanics_begin_step

  !> With a fixed geometry coordinates stand still, but tools meet the displaced nodes.
  pure function mechanics_positions(self) result(x)
    class(mechanics_t), intent(in) :: self
    real(wp), allocatable :: x(:, :)

    allocate (x, source=self%mesh%coordinates)
    if (self%settings%fixed_geometry) x = x + self%displacement

  end function mechanics_positions

  !> Collective. Continue the rate of the last steps, halved as long as it would flatten a cell:
  !> those at the edge of a tool shrink fast and slow down by themselves.
  subroutine extrapolate_rate(self, dt, share)
    class(mechanics_t), intent(inout) :: self
    !> Length of the step [time].
    real(wp), intent(in) :: dt
    !> Of the last step's increments that are repeated [1].
    real(wp), intent(out) :: share

    real(wp), allocatable :: move(:, :), rise(:)
    real(wp) :: before(self%mesh%dimension, self%mesh%dimension + 1), remaining
    integer :: cell, halving

    share = dt / self%dt_last
    allocate (move, source=self%increment_last)
    allocate (rise, source=self%pressure - self%pressure_last)
    if (self%dt_before > 0.0_wp) then
      ! The change of the rate from the middle of one step to that of the next
      associate (change => (dt + self%dt_last) / (self%dt_last + self%dt_before), &
                 ratio => self%dt_last / self%dt_before)
        move = move + change * (move - ratio * self%increment_before)
        rise = rise + change * (rise - ratio * (self%pressure_last - self%pressure_before))
      end associate
    end if
    do halving = 0, RATE_HALVINGS
      self%increment = share * move
      if (self%settings%fixed_geometry) exit
      remaining = huge(1.0_wp)
      do cell = 1, self%mesh%n_cell
        associate (node => self%mesh%cell_node(:, cell), kind => self%settings%kind)
          before = self%mesh%coordinates(:, node)
          remaining = min(remaining, cell_volume(kind, before + self%increment(:, node)) &
                          / cell_volume(kind, before))
        end associate
      end do
      call self%comm%min(remaining)
      if (remaining > FLATTENED) exit
      if (halving < RATE_HALVINGS) share = 0.5_wp * share
    end do
    self%pressure_new = self%pressure + share * rise

  end subroutine extrapolate_rate

  !> Where motion or load changes its rate a body may unload: the bubble, whose modulus is frozen
  !> over the step, is then elastic. One that goes on flowing is a little too stiff for a step.
  pure subroutine expect_elasticity(self)
    class(mechanics_t), intent(inout) :: self

    integer :: cell

    do cell = 1, self%mesh%n_cell
      associate (law => self%materials(self%material_of_cell(cell))%law)
        if (law%fluid) cycle
        self%bubble_modulus(cell) = law%reference_modulus
        self%relaxation(cell) = law%initial_relaxation
      end associate
    end do

  end subroutine expect_elasticity

  !> Volume-weighted mean of the flow stress of the cells around each node.
  subroutine nodal_flow_stress(self, flow_stress)
    class(mechanics_t), intent(in) :: self
    !> First row the mean [stress], second the weights; shape (2, n_node).
    real(wp), allocatable, intent(out) :: flow_stress(:, :)

    integer :: a, cell

    allocate (flow_stress(2, self%mesh%n_node), source=0.0_wp)
    do cell = 1, self%mesh%n_cell
      do a = 1, size(self%mesh%cell_node, 1)
        associate (node => flow_stress(:, self%mesh%cell_node(a, cell)))
          node(1) = node(1) + self%initial_volume(cell) * self%flow_stress(cell)
          node(2) = node(2) + self%initial_volume(cell)
        end associate
      end do
    end do
    call self%mesh%halo%accumulate(flow_stress)
    flow_stress(1, :) = flow_stress(1, :) / flow_stress(2, :)

  end subroutine nodal_flow_stress

  subroutine mechanics_evaluate(self, status)
    class(mechanics_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: moved(:, :), rest(:, :), start(:, :)
    type(step_size_t) :: size_of_step
    real(wp) :: largest
    integer :: i

    call self%times%begin(PHASE_CELLS)
    self%n_evaluation = self%n_evaluation + 1
    self%residual = 0.0_wp
    call self%matrix%renew()
    self%recommended_step = huge(1.0_wp)
    do i = 1, size(self%batches)
      call evaluate_batch(self, self%batches(i), size_of_step, status)
      if (status%failed()) exit
    end do
    call self%times%end(PHASE_CELLS)
    call self%comm%agree(status)
    if (status%failed()) return
    call self%comm%min(self%recommended_step)

    call self%times%begin(PHASE_CONTACT)
    allocate (start, source=self%positions())
    allocate (moved, source=start + self%increment)
    do i = 1, size(self%contacts)
      call self%contacts(i)%evaluate(self%tools(self%contacts(i)%tool), self%time_new - self%time, &
                                     self%slip_rate, start, moved, self%residual, self%matrix)
    end do
    if (size(self%pairs) > 0) call evaluate_pairs(self, moved)
    call apply_loads(self, moved)
    call balance_tools(self, moved)
    call self%times%end(PHASE_CONTACT)
    call self%unknowns%halo%accumulate(self%residual)

    allocate (rest(self%unknowns%n_slot, self%unknowns%n_node))
    call self%constraints%pending(self%increment, self%unknowns%mesh_node, rest, largest)
    call self%comm%max(largest)
    self%has_safe_tangent = size(self%contacts) + size(self%pairs) > 0
    self%has_pending_values = largest > IMPOSED * self%cell_size .or. self%controls%falls
    call measure_errors(self, size_of_step)

  end subroutine mechanics_evaluate

  !> Collective. Errors by the size of the forces and volume changes of the step.
  subroutine measure_errors(self, size_of_step)
    class(mechanics_t), intent(inout) :: self
    type(step_size_t), intent(in) :: size_of_step

    real(wp), allocatable :: free(:, :)
    real(wp) :: largest, sums(9)
    integer :: i, n, node

    n = self%mesh%dimension
    allocate (free, source=self%residual)
    call self%constraints%remove_from(free)
    sums = 0.0_wp
    largest = -1.0_wp
    node = 0
    do i = 1, self%mesh%n_own_node
      sums(1) = sums(1) + sum(free(:n, i)**2)
      sums(2) = sums(2) + free(n + 1, i)**2
      sums(7) = sums(7) + dot_product(free(:n, i), self%increment(:, i))
      ! Reactions
      sums(3) = sums(3) + sum((self%residual(:n, i) - free(:n, i))**2)
      if (sum(free(:n, i)**2) > largest) then
        largest = sum(free(:n, i)**2)
        node = i
      end if
    end do
    ! Further pressures
    sums(2) = sums(2) + sum(free(n + 1, self%mesh%n_own_node + 1:self%unknowns%n_own_node)**2)
    do i = 1, size(self%contacts)
      sums(3) = sums(3) + self%contacts(i)%force_square
      sums(9) = sums(9) + self%contacts(i)%open_force_square()
    end do
    do i = 1, size(self%pairs)
      sums(3) = sums(3) + self%pairs(i)%contact%force_square
      sums(9) = sums(9) + self%pairs(i)%contact%open_force_square()
    end do
    do i = 1, size(self%boundaries)
      sums(3) = sums(3) + sum(self%load_force(:, i)**2) &
        / max(1, size(self%boundaries(i)%node))
    end do
    sums(4) = sum(size_of_step%force)
    sums(5) = sum(size_of_step%strained_volume)
    sums(8) = sum(size_of_step%work)
    sums(6) = sum(self%volume_new)
    call self%comm%sum(sums)

    if (self%controls%n > 0) then
      sums(1) = sums(1) + sum((self%controls%residual / self%controls%reach)**2)
    end if
    self%carried_force = sqrt(sums(3))
    self%scales(1) = max(self%carried_force, FORCE_FLOOR * sqrt(sums(4)), &
                         RELEASED * self%largest_force_scale, self%least_force)
    self%scales(2) = max(sums(5), LEAST_STRAIN * sums(6)) &
      / sqrt(real(self%unknowns%n_node_global, wp))
    ! What Lagrange multipliers have not closed yet counts as the forces it would make
    self%errors = sqrt([sums(1) + sums(9), sums(2)]) / self%scales
    self%work_error = 0.0_wp
    if (sqrt(sums(1)) > max(NEGLIGIBLE * self%scales(1), RESIDUAL_ROUNDING * self%least_force)) then
      self%work_error = abs(sums(7)) / max(sums(8), WORK_SHARE * self%energies%largest, &
                                           self%energies%least)
    end if
    self%worst_node = node
    self%worst_force = largest

  end subroutine measure_errors

  subroutine mechanics_correct(self, status)
    class(mechanics_t), intent(inout) :: self
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: load(:, :), rest(:, :), right_hand_side(:, :), weight(:)
    real(wp) :: largest
    integer :: i, k, n

    n = self%mesh%dimension
    self%base(:n, self%unknowns%of_node) = self%increment
    self%base(n + 1, :) = self%pressure_new
    call prepare_contacts(self)

    allocate (rest(n + 1, self%unknowns%n_node), load(n + 1, self%unknowns%n_node))
    call self%constraints%pending(self%increment, self%unknowns%mesh_node, rest, largest)
    do i = 1, self%unknowns%n_node
      associate (block => self%matrix%values(:, :, self%matrix%diagonal(i)))
        do k = 1, n
          block(k, k) = block(k, k) * (1.0_wp + STABILISATION)
        end do
      end associate
    end do
    call self%constraints%impose(self%matrix, self%unknowns%n_own_node, rest, load)
    call self%matrix%complete()
    call self%unknowns%halo%accumulate(load)
    if (size(self%pairs) > 0) call constrain_coupling(self, rest, load)
    allocate (right_hand_side, source=self%residual)
    call self%constraints%to_local(right_hand_side)
    right_hand_side = -right_hand_side - load
    ! What is imposed is known: it has no part in the norms of the solver
    do i = 1, self%constraints%n_constrained
      right_hand_side(:self%constraints%n_direction(i), self%constraints%node(i)) = 0.0_wp
    end do

    if (.not. allocated(self%solver)) call create_solver(self, status)
    if (status%failed()) return
    call self%solver%factorise(self%matrix, status)
    call self%comm%agree(status)
    if (status%failed()) return
    allocate (weight(n + 1), source=1.0_wp / self%scales(1))
    weight(n + 1) = 1.0_wp / self%scales(2)
    call self%solver%solve(self%matrix, right_hand_side, weight, self%linear_tolerance, &
                           self%correction, status)
    call self%comm%agree(status)
    if (status%failed()) return
    do i = 1, self%constraints%n_constrained
      do k = 1, self%constraints%n_direction(i)
        self%correction(k, self%constraints%node(i)) = rest(k, self%constraints%node(i))
      end do
    end do
    call correct_tools(self, weight, status)
    if (status%failed()) return
    call correct_multipliers(self, weight, status)
    if (status%failed()) return
    call self%constraints%to_global(self%correction)

  end subroutine mechanics_correct

  !> Corrections much longer than cells and than the motion of the step come from a tangent that
  !> holds a body hardly or not at all.
  function mechanics_trusted_share(self) result(share)
    class(mechanics_t), intent(in) :: self
    real(wp) :: share

    real(wp) :: largest, moved
    integer :: i, n

    n = self%mesh%dimension
    largest = 0.0_wp
    moved = 0.0_wp
    do i = 1, self%mesh%n_own_node
      largest = max(largest, norm2(self%correction(:n, i)))
      moved = max(moved, norm2(self%base(:n, i)))
    end do
    call self%comm%max(largest)
    call self%comm%max(moved)
    share = max(TRUSTED_CELLS * self%cell_size, TRUSTED_MOTION * moved)
    share = min(1.0_wp, share / max(largest, tiny(1.0_wp)))

  end function mechanics_trusted_share

  subroutine mechanics_move(self, step_length)
    class(mechanics_t), intent(inout) :: self
    real(wp), intent(in) :: step_length

    integer :: i, n

    n = self%mesh%dimension
    associate (node => self%unknowns%of_node)
      self%increment = self%base(:n, node) + step_length * self%correction(:n, node)
    end associate
    self%pressure_new = self%base(n + 1, :) + step_length * self%correction(n + 1, :)
    call move_tools(self, step_length)
    do i = 1, size(self%contacts)
      call self%contacts(i)%move_multipliers(step_length)
    end do
    do i = 1, size(self%pairs)
      call self%pairs(i)%contact%move_multipliers(step_length)
    end do

  end subroutine mechanics_move

  subroutine mechanics_accept_step(self)
    class(mechanics_t), intent(inout) :: self

    call collect_work(self)
    self%largest_force_scale = max(self%largest_force_scale, self%carried_force)
    self%carries = self%carried_force > RELEASED * self%largest_force_scale
    self%dt_before = self%dt_last
    if (self%changes_course(self%time)) self%dt_before = 0.0_wp
    self%dt_last = self%time_new - self%time
    self%increment_before = self%increment_last
    self%increment_last = self%increment
    self%pressure_before = self%pressure_last
    self%pressure_last = self%pressure
    self%pressure = self%pressure_new
    self%displacement = self%displacement + self%increment
    if (.not. self%settings%fixed_geometry) then
      self%mesh%coordinates = self%mesh%coordinates + self%increment
    end if
    self%deviator = self%deviator_new
    self%mean_stress_old = self%mean_stress
    self%log_volume = self%log_volume_new
    self%state = self%state_new
    self%bubble_modulus = self%bubble_modulus_new
    self%relaxation = self%relaxation_new
    self%flow_stress = self%flow_stress_new
    call accept_contacts(self)
    self%time = self%time_new

  end subroutine mechanics_accept_step

  !> Contacts and tools.
  subroutine accept_contacts(self)
    class(mechanics_t), intent(inout) :: self

    integer :: i

    do i = 1, size(self%contacts)
      call self%contacts(i)%accept()
    end do
    do i = 1, size(self%pairs)
      call self%pairs(i)%contact%accept()
    end do
    do i = 1, size(self%tools)
      call self%tools(i)%accept()
    end do

  end subroutine accept_contacts

  subroutine mechanics_reject_step(self)
    class(mechanics_t), intent(inout) :: self

    integer :: i

    self%increment = 0.0_wp
    self%pressure_new = self%pressure
    self%mean_stress = self%mean_stress_old
    self%time_new = self%time
    do i = 1, size(self%tools)
      call self%tools(i)%begin_step(self%time, self%time)
    end do
    do i = 1, size(self%contacts)
      call self%contacts(i)%reject()
    end do
    do i = 1, size(self%pairs)
      call self%pairs(i)%contact%reject()
    end do

  end subroutine mechanics_reject_step

  pure function mechanics_next_event(self, time) result(event)
    class(mechanics_t), intent(in) :: self
    real(wp), intent(in) :: time
    real(wp) :: event

    integer :: i

    event = huge(1.0_wp)
    do i = 1, size(self%tools)
      event = min(event, self%tools(i)%next_event(time))
    end do
    do i = 1, size(self%boundaries)
      event = min(event, self%boundaries(i)%boundary%next_event(time))
    end do
    do i = 1, size(self%pairs)
      associate (fit => self%pairs(i)%contact%fit)
        if (time < fit%duration) event = min(event, fit%duration)
      end associate
    end do

  end function mechanics_next_event

  !> A kink of a motion or load is where rates change.
  pure function mechanics_changes_course(self, time) result(changes)
    class(mechanics_t), intent(in) :: self
    real(wp), intent(in) :: time
    logical :: changes

    real(wp) :: event

    event = self%next_event(time - 1.0e-6_wp * max(abs(time), self%dt_last))
    changes = abs(event - time) <= 2.0e-6_wp * max(abs(time), self%dt_last)

  end function mechanics_changes_course

  pure function mechanics_suggested_time_step(self) result(step)
    class(mechanics_t), intent(in) :: self
    real(wp) :: step

    step = self%recommended_step

  end function mechanics_suggested_time_step

  subroutine mechanics_take_report(self, text)
    class(mechanics_t), intent(inout) :: self
    character(len=:), allocatable, intent(out) :: text

    character(len=:), allocatable :: decisions

    text = self%notes
    self%notes = ''
    if (.not. allocated(self%solver)) return
    call self%solver%report(decisions)
    if (text /= '' .and. decisions /= '') text = text//new_line('a')
    text = text//decisions

  end subroutine mechanics_take_report

  subroutine mechanics_finish(self)
    class(mechanics_t), intent(inout) :: self

    if (allocated(self%solver)) call self%solver%free()

  end subroutine mechanics_finish

end module swage_mechanics
