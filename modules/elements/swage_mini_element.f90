!> The P1+/P1 (MINI) element in velocity and pressure: triangle (plane strain, axisymmetric) and
!> tetrahedron, one point a cell, the bubble condensed in the cell.
!>
!> Unknowns are the displacement increment of the step and the pressure at its end, positive in
!> compression. Equilibrium is written on the configuration at the end of the step; the strain
!> increment and the spin are those of the middle (Hughes and Winget, 1980), the strain turned by
!> half of the rotation, without which the update is of first order only. The volume equation
!> takes the exact increment of the cell's volume against that of V0 exp(-p/kappa).
!>
!> The bubble (cubic in 2D, quartic in 3D) is a Maxwell element: its stress relaxes by the factor
!> θ of the cell, with the modulus 2Gθ. Both are frozen over the step, and so is its geometry,
!> hence the stabilising block is constant in the step and Newton stays quadratic. In axial
!> symmetry the bubble strains the cell in the mean (block K_lb): the law then gets the strain
!> of the linear part plus this mean.
!>
!> The term `gamma (ln(V/V0) + p_old/kappa)` keeps single cells from collapsing where
!> incompressibility, imposed in the mean around nodes, would let them.
!>
!> Fixed geometry (small strain) is the same element without spin, turning and geometric terms.
!>
!> Cells are computed side by side, see [[swage_cell_geometry]]. The vertex functions add up to one,
!> which saves a quarter of the work: columns of the first vertex are minus the sum of the others,
!> but for the hoop strain of axial symmetry, which is alike for all vertices.
module swage_mini_element
  use swage_cell_geometry, only: AXISYMMETRIC, find_gradients, THREE_DIMENSIONAL
  use swage_cell_strain, only: add_spin, add_turning, find_axes, find_displacement_gradient, &
                               find_rotation, find_spin_rates, find_strain_derivative, &
                               find_symmetric_part
  use swage_kinds, only: wp
  use swage_mandel, only: rotate_tensors, SQRT2
  use swage_mini_bubble, only: add_bubble_force, add_bubble_strain, find_bubble_blocks, move_bubble
  use swage_point_batch, only: LANES, point_batch_t
  implicit none(type, external)
  private

  public :: mini_batch_t, mini_batch_create

  real(wp), parameter :: ROOT = 1.0_wp / SQRT2

  !> Up to `LANES` cells of one material: what is gathered, what is computed. Room that has no cell
  !> repeats the last one; in 2D the third component and the fourth vertex are zero.
  type :: mini_batch_t
    !> `PLANE_STRAIN`, `AXISYMMETRIC` or `THREE_DIMENSIONAL`.
    integer :: kind = THREE_DIMENSIONAL
    !> Space dimension and vertices of a cell.
    integer :: n_dim = 3, n_vertex = 4
    !> True when coordinates never move.
    logical :: fixed_geometry = .false.
    integer :: n_cell = 0
    !> Factor on the stabilising block of the bubble [1]; 1 is the element itself.
    real(wp) :: bubble_factor = 1.0_wp
    !> 1/κ [1/stress].
    real(wp) :: inverse_bulk_modulus = 0.0_wp

    ! In, gathered by the caller

    !> Coordinates at the start of the step [length], by cell, component and vertex.
    real(wp) :: coordinates(LANES, 3, 4) = 0.0_wp
    !> Displacement increment [length], likewise.
    real(wp) :: displacement(LANES, 3, 4) = 0.0_wp
    !> Pressure at both ends of the step [stress], by cell and vertex.
    real(wp) :: pressure_old(LANES, 4) = 0.0_wp
    real(wp) :: pressure_new(LANES, 4) = 0.0_wp
    !> Deviator at the start of the step, Mandel [stress].
    real(wp) :: deviator_old(LANES, 6) = 0.0_wp
    !> ln(V/V0) at the start of the step [1].
    real(wp) :: log_volume_old(LANES) = 0.0_wp
    !> Secant 2µ and θ of the last step, and the grad-div modulus [stress, 1, stress].
    real(wp) :: bubble_modulus(LANES) = 1.0_wp
    real(wp) :: relaxation(LANES) = 0.0_wp
    real(wp) :: grad_div_modulus(LANES) = 0.0_wp

    ! Computed by `start`

    !> Volume at the start, the middle and the end of the step [length^3]: per unit thickness in
    !> plane strain, of the full turn in axial symmetry.
    real(wp) :: volume_old(LANES) = 0.0_wp
    real(wp) :: volume_mid(LANES) = 0.0_wp
    real(wp) :: volume_new(LANES) = 0.0_wp
    !> ln(V/V0) at the end of the step [1].
    real(wp) :: log_volume_new(LANES) = 0.0_wp
    !> Gradients of the vertex functions [1/length], by cell, component and vertex.
    real(wp) :: gradient_old(LANES, 3, 4) = 0.0_wp
    real(wp) :: gradient_mid(LANES, 3, 4) = 0.0_wp
    real(wp) :: gradient_new(LANES, 3, 4) = 0.0_wp
    !> Hoop strain of a unit radial displacement of one vertex [1/length], 0 unless axisymmetric.
    real(wp) :: hoop_old(LANES) = 0.0_wp
    real(wp) :: hoop_mid(LANES) = 0.0_wp
    real(wp) :: hoop_new(LANES) = 0.0_wp
    !> Gradient of the displacement increment at the middle [1].
    real(wp) :: displacement_gradient(LANES, 3, 3) = 0.0_wp
    !> Axial vector of half of the spin, and half of the rotation.
    real(wp) :: axial(LANES, 3) = 0.0_wp
    real(wp) :: half_rotation(LANES, 3, 3) = 0.0_wp
    !> Strain increment turned by half of the rotation, without the bubble's mean, Mandel.
    real(wp) :: linear_strain(LANES, 6) = 0.0_wp
    !> Blocks of the bubble; see [[find_bubble_blocks]].
    real(wp) :: bubble_compliance(LANES, 3, 3) = 0.0_wp
    real(wp) :: bubble_pressure(LANES, 3, 4) = 0.0_wp
    real(wp) :: bubble_moment(LANES) = 0.0_wp
    !> Bubble displacement of the step [length].
    real(wp) :: bubble(LANES, 3) = 0.0_wp
    !> First cell of the batch that is inverted at the middle or the end of the step; 0 if none.
    !> Nothing else has been computed then.
    integer :: inverted = 0

    ! Computed by `finish`

    !> Internal forces, then the volume equation in row n_dim + 1, by cell, row and vertex.
    real(wp) :: residual(LANES, 4, 4) = 0.0_wp
    !> Derivative of the residual by the unknowns, in blocks of n_dim + 1 rows and columns: by row
    !> of the block, cell, column of the block, vertex of the row and vertex of the column.
    real(wp) :: tangent(4, LANES, 4, 4, 4) = 0.0_wp
    !> Mean Cauchy stress, negative of the cell's pressure [stress].
    real(wp) :: mean_stress(LANES) = 0.0_wp
  contains
    !> Fill the inputs of the law, the kinematics of the step.
    procedure :: start => mini_batch_start
    !> Residual, and tangent when asked for, after the law has answered.
    procedure :: finish => mini_batch_finish
  end type mini_batch_t

contains

  !> An empty batch.
  pure subroutine mini_batch_create(kind, fixed_geometry, batch)
    !> `PLANE_STRAIN`, `AXISYMMETRIC` or `THREE_DIMENSIONAL`.
    integer, intent(in) :: kind
    logical, intent(in) :: fixed_geometry
    type(mini_batch_t), intent(out) :: batch

    batch%kind = kind
    batch%n_dim = merge(3, 2, kind == THREE_DIMENSIONAL)
    batch%n_vertex = batch%n_dim + 1
    batch%fixed_geometry = fixed_geometry

  end subroutine mini_batch_create

  !> Gradients and volumes at the start, middle and end of the step, bubble, strain and rotation;
  !> the law's inputs in `points`, all but its state, time and temperature.
  pure subroutine mini_batch_start(self, points)
    class(mini_batch_t), intent(inout) :: self
    !> Made for `LANES` points.
    type(point_batch_t), intent(inout) :: points

    call repeat_last(self)
    call find_gradients(self%kind, self%coordinates, self%displacement, 0.0_wp, &
                        self%gradient_old, self%hoop_old, self%volume_old)
    if (self%fixed_geometry) then
      self%gradient_mid = self%gradient_old
      self%gradient_new = self%gradient_old
      self%hoop_mid = self%hoop_old
      self%hoop_new = self%hoop_old
      self%volume_mid = self%volume_old
      self%volume_new = self%volume_old
    else
      call find_gradients(self%kind, self%coordinates, self%displacement, 0.5_wp, &
                          self%gradient_mid, self%hoop_mid, self%volume_mid)
      call find_gradients(self%kind, self%coordinates, self%displacement, 1.0_wp, &
                          self%gradient_new, self%hoop_new, self%volume_new)
    end if
    self%inverted = find_inverted(self)
    if (self%inverted > 0) return

    call find_displacement_gradient(self%displacement, self%gradient_mid, self%hoop_mid, &
                                    self%displacement_gradient)
    if (self%fixed_geometry) then
      call find_symmetric_part(self%displacement_gradient, self%linear_strain)
      self%axial = 0.0_wp
      call set_identity(self%half_rotation)
      call set_identity(points%rotation_increment)
      self%log_volume_new = self%log_volume_old + self%linear_strain(:, 1) &
        + self%linear_strain(:, 2) + self%linear_strain(:, 3)
    else
      call find_rotation(self%displacement_gradient, self%axial, self%half_rotation, &
                         points%rotation_increment, self%linear_strain)
      self%log_volume_new = self%log_volume_old + log(self%volume_new / self%volume_old)
    end if

    call find_bubble_blocks(self%kind, self%gradient_old, self%hoop_old, self%volume_old, &
                            self%bubble_modulus, self%bubble_compliance, self%bubble_pressure, &
                            self%bubble_moment)
    call solve_bubble(self)
    call set_strain(self, points%strain_increment)
    call set_stress(self, points%rotation_increment, points%stress_old)

  end subroutine mini_batch_start

  pure subroutine set_identity(q)
    real(wp), intent(out) :: q(LANES, 3, 3)

    integer :: j

    q = 0.0_wp
    do j = 1, 3
      q(:, j, j) = 1.0_wp
    end do

  end subroutine set_identity

  !> Fill the room that has no cell with the last one.
  pure subroutine repeat_last(self)
    type(mini_batch_t), intent(inout) :: self

    integer :: i

    do i = self%n_cell + 1, LANES
      self%coordinates(i, :, :) = self%coordinates(self%n_cell, :, :)
      self%displacement(i, :, :) = self%displacement(self%n_cell, :, :)
      self%pressure_old(i, :) = self%pressure_old(self%n_cell, :)
      self%pressure_new(i, :) = self%pressure_new(self%n_cell, :)
      self%deviator_old(i, :) = self%deviator_old(self%n_cell, :)
      self%log_volume_old(i) = self%log_volume_old(self%n_cell)
      self%bubble_modulus(i) = self%bubble_modulus(self%n_cell)
      self%relaxation(i) = self%relaxation(self%n_cell)
      self%grad_div_modulus(i) = self%grad_div_modulus(self%n_cell)
    end do

  end subroutine repeat_last

  !> First cell that is inverted at the middle or the end of the step, or 0.
  pure function find_inverted(self) result(first)
    type(mini_batch_t), intent(in) :: self
    integer :: first

    integer :: i

    first = 0
    do i = 1, self%n_cell
      if (self%volume_mid(i) > 0.0_wp .and. self%volume_new(i) > 0.0_wp) cycle
      first = i
      return
    end do

  end function find_inverted

  !> Bubble displacement from the linear strain and the pressure, with the frozen modulus.
  pure subroutine solve_bubble(self)
    type(mini_batch_t), intent(inout) :: self

    real(wp) :: factor(LANES), force(LANES, 3)
    integer :: i, j

    do j = 1, 3
      do i = 1, LANES
        force(i, j) = self%bubble_pressure(i, j, 1) &
          * (self%pressure_new(i, 1) - self%relaxation(i) * self%pressure_old(i, 1)) &
          + self%bubble_pressure(i, j, 2) &
          * (self%pressure_new(i, 2) - self%relaxation(i) * self%pressure_old(i, 2)) &
          + self%bubble_pressure(i, j, 3) &
          * (self%pressure_new(i, 3) - self%relaxation(i) * self%pressure_old(i, 3)) &
          + self%bubble_pressure(i, j, 4) &
          * (self%pressure_new(i, 4) - self%relaxation(i) * self%pressure_old(i, 4))
      end do
    end do
    if (self%kind == AXISYMMETRIC) then
      call add_bubble_force(self%bubble_moment, self%bubble_modulus, self%linear_strain, force)
    end if
    factor = self%bubble_factor
    call move_bubble(factor, self%bubble_compliance, force, self%bubble)

  end subroutine solve_bubble

  !> The strain increment that the law sees.
  pure subroutine set_strain(self, strain_increment)
    type(mini_batch_t), intent(in) :: self
    real(wp), intent(out) :: strain_increment(LANES, 6)

    real(wp) :: weight(LANES)

    strain_increment = self%linear_strain
    if (self%kind == AXISYMMETRIC) then
      weight = 1.0_wp / self%volume_old
      call add_bubble_strain(self%bubble_moment, weight, self%bubble, strain_increment)
    end if

  end subroutine set_strain

  !> The old stress, turned, with its pressure.
  pure subroutine set_stress(self, rotation, stress_old)
    type(mini_batch_t), intent(in) :: self
    real(wp), intent(in) :: rotation(LANES, 3, 3)
    real(wp), intent(out) :: stress_old(LANES, 6)

    real(wp) :: mean_stress, pressure
    integer :: i

    stress_old = self%deviator_old
    if (.not. self%fixed_geometry) call rotate_tensors(LANES, rotation, stress_old)
    do i = 1, LANES
      pressure = (self%pressure_old(i, 1) + self%pressure_old(i, 2) + self%pressure_old(i, 3) &
                  + self%pressure_old(i, 4)) / self%n_vertex
      mean_stress = self%grad_div_modulus(i) &
        * (self%log_volume_old(i) + self%inverse_bulk_modulus * pressure) - pressure
      stress_old(i, 1) = stress_old(i, 1) + mean_stress
      stress_old(i, 2) = stress_old(i, 2) + mean_stress
      stress_old(i, 3) = stress_old(i, 3) + mean_stress
    end do

  end subroutine set_stress

  !> Equilibrium and volume equations of the cells, and their exact derivative.
  pure subroutine mini_batch_finish(self, points, with_tangent)
    class(mini_batch_t), intent(inout) :: self
    !> After the law's update.
    type(point_batch_t), intent(in) :: points
    logical, intent(in) :: with_tangent

    !> Forces without those of the hoop stress, and the hoop stress times the volume.
    real(wp) :: force(LANES, 3, 4), hoop_force(LANES)
    !> Mass matrix of the vertex functions by 1 + δ, and the relative volumes exp(-p/κ).
    real(wp) :: mass(LANES), relative_volume(LANES, 4)

    call set_forces(self, points%deviatoric_stress, force, hoop_force)
    call set_volume_equation(self, mass, relative_volume)
    if (with_tangent) call set_tangent(self, points, force, hoop_force, mass, relative_volume)

  end subroutine mini_batch_finish

  !> Mean stress and internal forces.
  pure subroutine set_forces(self, deviator, force, hoop_force)
    type(mini_batch_t), intent(inout) :: self
    real(wp), intent(in) :: deviator(LANES, 6)
    real(wp), intent(out) :: force(LANES, 3, 4)
    real(wp), intent(out) :: hoop_force(LANES)

    real(wp) :: s11, s12, s13, s22, s23, s33
    integer :: a, i

    do i = 1, LANES
      self%mean_stress(i) = self%grad_div_modulus(i) &
        * (self%log_volume_new(i) + self%inverse_bulk_modulus &
           * (self%pressure_old(i, 1) + self%pressure_old(i, 2) + self%pressure_old(i, 3) &
              + self%pressure_old(i, 4)) / self%n_vertex) &
        - (self%pressure_new(i, 1) + self%pressure_new(i, 2) + self%pressure_new(i, 3) &
           + self%pressure_new(i, 4)) / self%n_vertex
      hoop_force(i) = self%volume_new(i) * (deviator(i, 3) + self%mean_stress(i)) &
        * self%hoop_new(i)
    end do
    do a = 1, self%n_vertex
      do i = 1, LANES
        s11 = self%volume_new(i) * (deviator(i, 1) + self%mean_stress(i))
        s22 = self%volume_new(i) * (deviator(i, 2) + self%mean_stress(i))
        s33 = self%volume_new(i) * (deviator(i, 3) + self%mean_stress(i))
        s23 = self%volume_new(i) * ROOT * deviator(i, 4)
        s13 = self%volume_new(i) * ROOT * deviator(i, 5)
        s12 = self%volume_new(i) * ROOT * deviator(i, 6)
        force(i, 1, a) = s11 * self%gradient_new(i, 1, a) + s12 * self%gradient_new(i, 2, a) &
          + s13 * self%gradient_new(i, 3, a)
        force(i, 2, a) = s12 * self%gradient_new(i, 1, a) + s22 * self%gradient_new(i, 2, a) &
          + s23 * self%gradient_new(i, 3, a)
        force(i, 3, a) = s13 * self%gradient_new(i, 1, a) + s23 * self%gradient_new(i, 2, a) &
          + s33 * self%gradient_new(i, 3, a)
        self%residual(i, 1, a) = force(i, 1, a) + hoop_force(i)
        self%residual(i, 2, a) = force(i, 2, a)
        self%residual(i, 3, a) = force(i, 3, a)
      end do
    end do
    ! What the loops below run over without looking
    force(:, :, self%n_vertex + 1:) = 0.0_wp

  end subroutine set_forces

  !> Volume equation.
  !>
  !> Volume lost to the pressure is taken by the reference volume, of V0 exp(-p/κ) exactly: so the
  !> increments of all steps add up to a function of the pressure, and mass is kept.
  pure subroutine set_volume_equation(self, mass, relative_volume)
    type(mini_batch_t), intent(inout) :: self
    real(wp), intent(out) :: mass(LANES)
    real(wp), intent(out) :: relative_volume(LANES, 4)

    real(wp) :: change(LANES, 4), volume_change(LANES)
    integer :: a, i

    ! Mass matrix of the vertex functions: (1 + δ) measure / ((n + 1) (n + 2))
    if (self%fixed_geometry) then
      mass = self%volume_old / (self%n_vertex * (self%n_vertex + 1))
      volume_change = self%volume_old * (self%log_volume_new - self%log_volume_old)
      relative_volume = 1.0_wp
      change = self%inverse_bulk_modulus * (self%pressure_new - self%pressure_old)
    else
      mass = self%volume_old * exp(-self%log_volume_old) / (self%n_vertex * (self%n_vertex + 1))
      volume_change = self%volume_new - self%volume_old
      relative_volume = exp(-self%inverse_bulk_modulus * self%pressure_new)
      change = exp(-self%inverse_bulk_modulus * self%pressure_old) - relative_volume
    end if
    do a = 1, self%n_vertex
      do i = 1, LANES
        self%residual(i, self%n_dim + 1, a) = -volume_change(i) / self%n_vertex &
          - mass(i) * (change(i, 1) + change(i, 2) + change(i, 3) + change(i, 4) + change(i, a)) &
          + self%bubble_pressure(i, 1, a) * self%bubble(i, 1) &
          + self%bubble_pressure(i, 2, a) * self%bubble(i, 2) &
          + self%bubble_pressure(i, 3, a) * self%bubble(i, 3)
      end do
    end do

  end subroutine set_volume_equation

  !> Derivative of the residual.
  pure subroutine set_tangent(self, points, force, hoop_force, mass, relative_volume)
    type(mini_batch_t), intent(inout) :: self
    type(point_batch_t), intent(in) :: points
    real(wp), intent(in) :: force(LANES, 3, 4)
    real(wp), intent(in) :: hoop_force(LANES)
    real(wp), intent(in) :: mass(LANES)
    real(wp), intent(in) :: relative_volume(LANES, 4)

    !> Strain and stress by displacement j of vertex b, in column (j, b).
    real(wp) :: strain(LANES, 6, 3, 4), stress(LANES, 6, 3, 4)
    !> The same by the hoop strain of a radial displacement; force on the bubble by displacements.
    real(wp) :: hoop_stress(LANES, 6), push(LANES, 3, 3, 4)
    !> Volume equation of any vertex by the displacements.
    real(wp) :: divergence(LANES, 3, 4)
    real(wp) :: mean(LANES), none(LANES), still(LANES, 3, 4)
    integer :: b, j

    call differentiate_strain(self, points, strain, hoop_stress, push)
    do b = 2, self%n_vertex
      do j = 1, self%n_dim
        call apply_tangent(points%tangent_secant, points%tangent_factor, &
                           points%tangent_direction, strain(:, :, j, b), stress(:, :, j, b))
      end do
    end do
    if (points%has_back_stress .and. .not. self%fixed_geometry) then
      call add_turning_back_stress(self, points, stress)
    end if
    do b = 2, self%n_vertex
      do j = 1, self%n_dim
        mean = self%grad_div_modulus * self%gradient_new(:, j, b)
        call complete_stress(self%volume_new, mean, stress(:, :, j, b))
      end do
    end do
    mean = self%grad_div_modulus * self%hoop_new
    if (self%kind == AXISYMMETRIC) call complete_stress(self%volume_new, mean, hoop_stress)
    do b = 1, 4
      do j = 1, 3
        divergence(:, j, b) = -self%volume_new / self%n_vertex * self%gradient_new(:, j, b)
      end do
      divergence(:, 1, b) = divergence(:, 1, b) - self%volume_new / self%n_vertex * self%hoop_new
    end do

    if (self%fixed_geometry) then
      still = 0.0_wp
      none = 0.0_wp
      call set_stiffness(self%n_dim, self%gradient_new, stress, still, divergence, self%tangent)
      if (self%kind == AXISYMMETRIC) then
        call add_hoop_stiffness(self, hoop_stress, stress, still, none)
      end if
    else
      call set_stiffness(self%n_dim, self%gradient_new, stress, force, divergence, self%tangent)
      if (self%kind == AXISYMMETRIC) then
        call add_hoop_stiffness(self, hoop_stress, stress, force, hoop_force)
      end if
    end if
    call set_pressure_blocks(self, divergence, mass, relative_volume)
    if (self%kind == AXISYMMETRIC) call add_bubble_coupling(self, points, push)

  end subroutine set_tangent

  !> Add to the deviator by displacements what it gains as its back stress turns.
  pure subroutine add_turning_back_stress(self, points, stress)
    type(mini_batch_t), intent(in) :: self
    type(point_batch_t), intent(in) :: points
    !> Mandel, by displacement j of vertex b in column (j, b), b > 1.
    real(wp), intent(inout) :: stress(LANES, 6, 3, 4)

    real(wp) :: axes(LANES, 3, 3), half_rate(LANES, 3, 3), of_spin(LANES, 6, 3), rate(LANES, 3, 3)

    ! What add_spin runs over without looking
    stress(:, :, :, self%n_vertex + 1:) = 0.0_wp
    of_spin = 0.0_wp
    call find_axes(.true., self%displacement_gradient, axes)
    call find_spin_rates(self%axial, half_rate, rate)
    call add_turning(points%back_stress, rate, of_spin)
    call add_spin(self%n_dim, axes, self%gradient_mid, of_spin, stress)

  end subroutine add_turning_back_stress

  !> Strain by displacements, the memory of the old stress included as the strain of same effect.
  pure subroutine differentiate_strain(self, points, strain, hoop_stress, push)
    type(mini_batch_t), intent(in) :: self
    type(point_batch_t), intent(in) :: points
    !> By displacement j of vertex b in column (j, b), Mandel [1/length]; set for b > 1.
    real(wp), intent(out) :: strain(LANES, 6, 3, 4)
    !> Axial symmetry: deviator by the hoop strain of a unit radial displacement [stress/length].
    real(wp), intent(out) :: hoop_stress(LANES, 6)
    !> Axial symmetry: \(E^T\) times the strain of the linear part, for all vertices.
    real(wp), intent(out) :: push(LANES, 3, 3, 4)

    real(wp) :: axes(LANES, 3, 3), half_rate(LANES, 3, 3), memory(LANES, 6), of_spin(LANES, 6, 3), &
      of_spin_memory(LANES, 6, 3), rate(LANES, 3, 3), safe
    integer :: i, j

    call find_axes(.not. self%fixed_geometry, self%displacement_gradient, axes)
    of_spin = 0.0_wp
    of_spin_memory = 0.0_wp
    if (.not. self%fixed_geometry) then
      do j = 1, 6
        do i = 1, LANES
          safe = merge(points%memory_modulus(i), 1.0_wp, points%memory_modulus(i) > 0.0_wp)
          memory(i, j) = merge(points%stress_old(i, j), 0.0_wp, &
                               points%memory_modulus(i) > 0.0_wp) / safe
        end do
      end do
      if (points%has_back_stress) then
        do j = 1, 6
          memory(:, j) = memory(:, j) - points%back_stress(:, j) &
            / merge(points%memory_modulus, 1.0_wp, points%memory_modulus > 0.0_wp)
        end do
      end if
      call find_spin_rates(self%axial, half_rate, rate)
      call add_turning(self%linear_strain, half_rate, of_spin)
      if (self%kind == AXISYMMETRIC) then
        call add_turning(memory, rate, of_spin_memory)
      else
        call add_turning(memory, rate, of_spin)
      end if
    end if

    call find_strain_derivative(self%n_dim, axes, self%gradient_mid, self%half_rotation, of_spin, &
                                strain)
    if (self%kind == AXISYMMETRIC) then
      call add_mean_of_bubble(self, points, axes, strain, hoop_stress, push)
      call add_spin(self%n_dim, axes, self%gradient_mid, of_spin_memory, strain)
    end if

  end subroutine differentiate_strain

  !> The mean strain of the bubble, which the law sees in axial symmetry, answers to that of the
  !> linear part.
  pure subroutine add_mean_of_bubble(self, points, axes, strain, hoop_stress, push)
    type(mini_batch_t), intent(in) :: self
    type(point_batch_t), intent(in) :: points
    real(wp), intent(in) :: axes(LANES, 3, 3)
    !> Of the linear part on entry, then as the law sees it.
    real(wp), intent(inout) :: strain(LANES, 6, 3, 4)
    real(wp), intent(out) :: hoop_stress(LANES, 6)
    real(wp), intent(out) :: push(LANES, 3, 3, 4)

    real(wp) :: bubble(LANES, 3), factor(LANES), hoop_strain(LANES, 6), one(LANES)
    integer :: b, j

    one = 1.0_wp
    factor = self%bubble_factor * self%bubble_modulus / self%volume_old
    push = 0.0_wp
    do b = 2, 3
      do j = 1, 2
        call add_bubble_force(self%bubble_moment, one, strain(:, :, j, b), push(:, :, j, b))
        call move_bubble(factor, self%bubble_compliance, push(:, :, j, b), bubble)
        call add_bubble_strain(self%bubble_moment, one, bubble, strain(:, :, j, b))
      end do
    end do
    push(:, :, :, 1) = -push(:, :, :, 2) - push(:, :, :, 3)

    ! The hoop strain of a radial displacement is the same for all vertices
    hoop_strain = 0.0_wp
    hoop_strain(:, 3) = self%hoop_mid * axes(:, 3, 3)
    push(:, :, 3, 4) = 0.0_wp
    call add_bubble_force(self%bubble_moment, one, hoop_strain, push(:, :, 3, 4))
    call move_bubble(factor, self%bubble_compliance, push(:, :, 3, 4), bubble)
    call add_bubble_strain(self%bubble_moment, one, bubble, hoop_strain)
    do b = 1, 3
      push(:, :, 1, b) = push(:, :, 1, b) + push(:, :, 3, 4)
    end do
    call apply_tangent(points%tangent_secant, points%tangent_factor, points%tangent_direction, &
                       hoop_strain, hoop_stress)

  end subroutine add_mean_of_bubble

  !> Deviator that a strain makes: the derivative of the law.
  pure subroutine apply_tangent(secant, factor, direction, strain, stress)
    !> See [[point_batch_t]].
    real(wp), intent(in) :: secant(LANES)
    real(wp), intent(in) :: factor(LANES)
    real(wp), intent(in) :: direction(LANES, 6)
    !> Mandel.
    real(wp), intent(in) :: strain(LANES, 6)
    real(wp), intent(out) :: stress(LANES, 6)

    real(wp) :: along, mean
    integer :: i

    do i = 1, LANES
      mean = (strain(i, 1) + strain(i, 2) + strain(i, 3)) / 3.0_wp
      along = factor(i) &
        * (direction(i, 1) * strain(i, 1) + direction(i, 2) * strain(i, 2) &
           + direction(i, 3) * strain(i, 3) + direction(i, 4) * strain(i, 4) &
           + direction(i, 5) * strain(i, 5) + direction(i, 6) * strain(i, 6))
      stress(i, 1) = secant(i) * (strain(i, 1) - mean) + along * direction(i, 1)
      stress(i, 2) = secant(i) * (strain(i, 2) - mean) + along * direction(i, 2)
      stress(i, 3) = secant(i) * (strain(i, 3) - mean) + along * direction(i, 3)
      stress(i, 4) = secant(i) * strain(i, 4) + along * direction(i, 4)
      stress(i, 5) = secant(i) * strain(i, 5) + along * direction(i, 5)
      stress(i, 6) = secant(i) * strain(i, 6) + along * direction(i, 6)
    end do

  end subroutine apply_tangent

  !> From the derivative of the deviator to components of the stress times the volume.
  pure subroutine complete_stress(volume, mean, stress)
    real(wp), intent(in) :: volume(LANES)
    !> Derivative of the mean stress.
    real(wp), intent(in) :: mean(LANES)
    !> Mandel deviator on entry, then the components 11, 22, 33, 23, 13, 12.
    real(wp), intent(inout) :: stress(LANES, 6)

    integer :: i

    do i = 1, LANES
      stress(i, 1) = volume(i) * (stress(i, 1) + mean(i))
      stress(i, 2) = volume(i) * (stress(i, 2) + mean(i))
      stress(i, 3) = volume(i) * (stress(i, 3) + mean(i))
      stress(i, 4) = volume(i) * ROOT * stress(i, 4)
      stress(i, 5) = volume(i) * ROOT * stress(i, 5)
      stress(i, 6) = volume(i) * ROOT * stress(i, 6)
    end do

  end subroutine complete_stress

  !> Columns of the displacements, without hoop strain and hoop stress.
  pure subroutine set_stiffness(n_dim, g, stress, force, divergence, t)
    integer, intent(in) :: n_dim
    !> Gradients of the vertex functions at the end of the step.
    real(wp), intent(in) :: g(LANES, 3, 4)
    !> Components times volume, by displacement j of vertex b in column (j, b), b > 1.
    real(wp), intent(in) :: stress(LANES, 6, 3, 4)
    !> Internal forces, which follow the geometry; zero where that is fixed.
    real(wp), intent(in) :: force(LANES, 3, 4)
    !> Volume equation by displacement j of vertex b in column (j, b).
    real(wp), intent(in) :: divergence(LANES, 3, 4)
    !> See [[mini_batch_t]].
    real(wp), intent(inout) :: t(4, LANES, 4, 4, 4)

    real(wp) :: rows(LANES, 4)
    integer :: a, b, i, j, m

    m = n_dim + 1
    do b = 2, m
      do j = 1, n_dim
        do a = 1, m
          do i = 1, LANES
            rows(i, 1) = stress(i, 1, j, b) * g(i, 1, a) &
              + stress(i, 6, j, b) * g(i, 2, a) + stress(i, 5, j, b) * g(i, 3, a) &
              + g(i, j, b) * force(i, 1, a) - g(i, j, a) * force(i, 1, b)
            rows(i, 2) = stress(i, 6, j, b) * g(i, 1, a) &
              + stress(i, 2, j, b) * g(i, 2, a) + stress(i, 4, j, b) * g(i, 3, a) &
              + g(i, j, b) * force(i, 2, a) - g(i, j, a) * force(i, 2, b)
            rows(i, 3) = stress(i, 5, j, b) * g(i, 1, a) &
              + stress(i, 4, j, b) * g(i, 2, a) + stress(i, 3, j, b) * g(i, 3, a) &
              + g(i, j, b) * force(i, 3, a) - g(i, j, a) * force(i, 3, b)
            rows(i, 4) = divergence(i, j, b)
          end do
          ! In 2D the third row is that of the pressure, which is set later, and there is no fourth
          call set_column(rows, t(:, :, j, a, b))
        end do
      end do
    end do

    ! The first vertex: minus the sum of the others
    do a = 1, m
      do j = 1, n_dim
        if (n_dim == 3) then
          t(:, :, j, a, 1) = -t(:, :, j, a, 2) - t(:, :, j, a, 3) - t(:, :, j, a, 4)
        else
          t(:, :, j, a, 1) = -t(:, :, j, a, 2) - t(:, :, j, a, 3)
        end if
      end do
    end do

  end subroutine set_stiffness

  !> From the rows of a column, cell first, to the column of each cell in one piece.
  pure subroutine set_column(rows, column)
    real(wp), intent(in) :: rows(LANES, 4)
    real(wp), intent(out) :: column(4, LANES)

    integer :: i

    ! The directive keeps gfortran from unrolling the loop before it finds that it is a vector
    !GCC$ unroll 1
    do i = 1, LANES
      column(1, i) = rows(i, 1)
      column(2, i) = rows(i, 2)
      column(3, i) = rows(i, 3)
      column(4, i) = rows(i, 4)
    end do

  end subroutine set_column

  !> What hoop strain and hoop stress add to the stiffness in axial symmetry.
  pure subroutine add_hoop_stiffness(self, hoop_change, stress, force, hoop_force)
    type(mini_batch_t), intent(inout) :: self
    !> Components of the stress times volume, by the hoop strain of a radial displacement.
    real(wp), intent(in) :: hoop_change(LANES, 6)
    !> The same by displacement j of vertex b in column (j, b), b > 1.
    real(wp), intent(in) :: stress(LANES, 6, 3, 4)
    !> Forces without those of the hoop stress, and these, zero where the geometry is fixed.
    real(wp), intent(in) :: force(LANES, 3, 4)
    real(wp), intent(in) :: hoop_force(LANES)

    real(wp) :: by_radius(LANES, 2, 3), of_hoop(LANES, 2, 3)
    integer :: a, b, j, k

    associate (g => self%gradient_new, hoop => self%hoop_new, t => self%tangent)
      ! Forces by the hoop strain, radial force of the hoop stress by the gradient
      do a = 1, 3
        by_radius(:, 1, a) = hoop_change(:, 1) * g(:, 1, a) + hoop_change(:, 6) * g(:, 2, a) &
          + hoop * force(:, 1, a)
        by_radius(:, 2, a) = hoop_change(:, 6) * g(:, 1, a) + hoop_change(:, 2) * g(:, 2, a) &
          + hoop * force(:, 2, a)
      end do
      do j = 1, 2
        do b = 2, 3
          of_hoop(:, j, b) = hoop * stress(:, 3, j, b) + hoop_force * g(:, j, b)
        end do
        of_hoop(:, j, 1) = -of_hoop(:, j, 2) - of_hoop(:, j, 3)
      end do
      do b = 1, 3
        do a = 1, 3
          do k = 1, 2
            t(k, :, 1, a, b) = t(k, :, 1, a, b) + by_radius(:, k, a)
            t(1, :, k, a, b) = t(1, :, k, a, b) + of_hoop(:, k, b)
          end do
          t(1, :, 1, a, b) = t(1, :, 1, a, b) + hoop * hoop_change(:, 3)
        end do
      end do
    end associate

  end subroutine add_hoop_stiffness

  !> Forces and the volume equation by the pressure; in 2D, the volume equation by displacements.
  pure subroutine set_pressure_blocks(self, divergence, mass, relative_volume)
    type(mini_batch_t), intent(inout) :: self
    !> Volume equation by displacement j of vertex b in column (j, b), and mirrored.
    real(wp), intent(in) :: divergence(LANES, 3, 4)
    real(wp), intent(in) :: mass(LANES)
    real(wp), intent(in) :: relative_volume(LANES, 4)

    real(wp) :: diagonal, moved(LANES, 3, 4), rows(LANES, 4)
    integer :: a, b, j, m

    m = self%n_dim + 1
    ! There is no fourth in 2D
    rows = 0.0_wp
    associate (t => self%tangent, pressure => self%bubble_pressure, c => self%bubble_compliance)
      do b = 1, m
        do j = 1, 3
          moved(:, j, b) = self%bubble_factor * (c(:, j, 1) * pressure(:, 1, b) &
                                                 + c(:, j, 2) * pressure(:, 2, b) &
                                                 + c(:, j, 3) * pressure(:, 3, b))
        end do
      end do
      do b = 1, m
        do a = 1, m
          diagonal = merge(2.0_wp, 1.0_wp, a == b)
          rows(:, :3) = divergence(:, :, a)
          rows(:, m) = -diagonal * self%inverse_bulk_modulus * mass * relative_volume(:, b) &
            - pressure(:, 1, a) * moved(:, 1, b) - pressure(:, 2, a) * moved(:, 2, b) &
            - pressure(:, 3, a) * moved(:, 3, b)
          call set_column(rows, t(:, :, m, a, b))
          if (m == 4) cycle
          t(m, :, 1, a, b) = divergence(:, 1, b)
          t(m, :, 2, a, b) = divergence(:, 2, b)
        end do
      end do
    end associate

  end subroutine set_pressure_blocks

  !> Axial symmetry: the pressure moves the bubble, which strains the cell; the strain moves the
  !> bubble, which enters the volume equation.
  pure subroutine add_bubble_coupling(self, points, push)
    type(mini_batch_t), intent(inout) :: self
    type(point_batch_t), intent(in) :: points
    !> \(E^T\) times the strain by displacement j of vertex a in column (j, a).
    real(wp), intent(in) :: push(LANES, 3, 3, 4)

    real(wp) :: bubble(LANES, 3), change(LANES, 6), factor(LANES), none(LANES), strain(LANES, 6), &
      weight(LANES)
    integer :: a, b, j

    factor = self%bubble_factor
    none = 0.0_wp
    weight = 1.0_wp / self%volume_old
    associate (g => self%gradient_new, t => self%tangent)
      do b = 1, 3
        call move_bubble(factor, self%bubble_compliance, self%bubble_pressure(:, :, b), bubble)
        strain = 0.0_wp
        call add_bubble_strain(self%bubble_moment, weight, bubble, strain)
        call apply_tangent(points%tangent_secant, points%tangent_factor, &
                           points%tangent_direction, strain, change)
        call complete_stress(self%volume_new, none, change)
        do a = 1, 3
          do j = 1, 2
            t(3, :, j, b, a) = t(3, :, j, b, a) + self%bubble_modulus &
              * (bubble(:, 1) * push(:, 1, j, a) + bubble(:, 2) * push(:, 2, j, a))
          end do
          t(1, :, 3, a, b) = t(1, :, 3, a, b) + change(:, 1) * g(:, 1, a) &
            + change(:, 6) * g(:, 2, a) + change(:, 3) * self%hoop_new
          t(2, :, 3, a, b) = t(2, :, 3, a, b) + change(:, 6) * g(:, 1, a) &
            + change(:, 2) * g(:, 2, a)
        end do
      end do
    end associate

  end subroutine add_bubble_coupling

end module swage_mini_element
