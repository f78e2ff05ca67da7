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
module swage_mini_element
  use swage_kinds, only: wp
  use swage_mandel, only: mandel_from_matrix, matrix_from_mandel, rotated, SQRT2
  use swage_point_batch, only: point_batch_t
  implicit none(type, external)
  private

  public :: mini_batch_t, mini_batch_create, cell_gradients, cell_volume, bubble_blocks
  public :: PLANE_STRAIN, AXISYMMETRIC, THREE_DIMENSIONAL

  !> Kinds of analysis.
  integer, parameter :: PLANE_STRAIN = 1
  integer, parameter :: AXISYMMETRIC = 2
  integer, parameter :: THREE_DIMENSIONAL = 3

  real(wp), parameter :: TWO_PI = 2.0_wp * acos(-1.0_wp)
  !> Integrals of the bubble b over the cell, by its measure: of b, of grad b ⊗ grad b by the sum
  !> of grad λ ⊗ grad λ, and of b².
  real(wp), parameter :: BUBBLE_MEAN(2:3) = [9.0_wp / 20.0_wp, 32.0_wp / 105.0_wp]
  real(wp), parameter :: BUBBLE_STIFFNESS(2:3) = [81.0_wp / 20.0_wp, 4096.0_wp / 945.0_wp]
  real(wp), parameter :: BUBBLE_SQUARE_2D = 81.0_wp / 280.0_wp
  real(wp), parameter :: IDENTITY(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, &
                                                   0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
  !> Mandel row of a component.
  integer, parameter :: ROW(3, 3) = reshape([1, 6, 5, 6, 2, 4, 5, 4, 3], [3, 3])

  !> A batch of cells of one material: what is gathered, what is computed. Made once for the
  !> largest batch and reused; loops run to `n_cell`.
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

    !> Coordinates at the start of the step [length]; shape (n_dim, n_vertex, n_cell).
    real(wp), allocatable :: coordinates(:, :, :)
    !> Displacement increment [length]; shape (n_dim, n_vertex, n_cell).
    real(wp), allocatable :: displacement(:, :, :)
    !> Pressure at both ends of the step [stress]; shape (n_vertex, n_cell).
    real(wp), allocatable :: pressure_old(:, :), pressure_new(:, :)
    !> Deviator at the start of the step, Mandel [stress]; shape (6, n_cell).
    real(wp), allocatable :: deviator_old(:, :)
    !> ln(V/V0) at the start of the step [1]; shape (n_cell).
    real(wp), allocatable :: log_volume_old(:)
    !> Secant 2µ and θ of the last step, and the grad-div modulus [stress, 1, stress];
    !> shape (n_cell).
    real(wp), allocatable :: bubble_modulus(:), relaxation(:), grad_div_modulus(:)

    ! Computed by `start`

    !> Volume at the start, the middle and the end of the step [length^3]: per unit thickness in
    !> plane strain, of the full turn in axial symmetry; shape (n_cell).
    real(wp), allocatable :: volume_old(:), volume_mid(:), volume_new(:)
    !> ln(V/V0) at the end of the step [1]; shape (n_cell).
    real(wp), allocatable :: log_volume_new(:)
    !> Gradients of the vertex functions [1/length]; shape (n_dim, n_vertex, n_cell).
    real(wp), allocatable :: gradient_old(:, :, :), gradient_mid(:, :, :), gradient_new(:, :, :)
    !> Hoop strain of a unit radial displacement of one vertex [1/length], 0 unless axisymmetric;
    !> shape (n_cell).
    real(wp), allocatable :: hoop_old(:), hoop_mid(:), hoop_new(:)
    !> Gradient of the displacement increment at the middle [1]; shape (3, 3, n_cell).
    real(wp), allocatable :: displacement_gradient(:, :, :)
    !> Strain increment turned by half of the rotation, without the bubble's mean; (6, n_cell).
    real(wp), allocatable :: linear_strain(:, :)
    !> Of the bubble, inverse of K_bb (n_dim, n_dim, n_cell), K_bp (n_dim, n_vertex, n_cell) and its
    !> integrated strain E (6, n_dim, n_cell).
    real(wp), allocatable :: bubble_compliance(:, :, :), bubble_pressure(:, :, :)
    real(wp), allocatable :: bubble_strain(:, :, :)
    !> Bubble displacement of the step [length]; shape (n_dim, n_cell).
    real(wp), allocatable :: bubble(:, :)
    !> First cell of the batch that is inverted at the middle or the end of the step; 0 if none.
    integer :: inverted = 0

    ! Computed by `finish`

    !> Internal forces, then the volume equation; shape (n_dim + 1, n_vertex, n_cell).
    real(wp), allocatable :: residual(:, :, :)
    !> Derivative of the residual, unknowns vertex by vertex; shape (n, n, n_cell).
    real(wp), allocatable :: tangent(:, :, :)
    !> Mean Cauchy stress, negative of the cell's pressure [stress]; shape (n_cell).
    real(wp), allocatable :: mean_stress(:)
  contains
    !> Kinematics: fill the inputs of the law.
    procedure :: start => mini_batch_start
    !> Residual, and tangent when asked for, after the law has answered.
    procedure :: finish => mini_batch_finish
  end type mini_batch_t

contains

  !> Room for batches of up to `capacity` cells.
  pure subroutine mini_batch_create(kind, fixed_geometry, capacity, batch)
    !> `PLANE_STRAIN`, `AXISYMMETRIC` or `THREE_DIMENSIONAL`.
    integer, intent(in) :: kind
    logical, intent(in) :: fixed_geometry
    integer, intent(in) :: capacity
    type(mini_batch_t), intent(out) :: batch

    integer :: m, n, v

    n = merge(3, 2, kind == THREE_DIMENSIONAL)
    v = n + 1
    m = v * (n + 1)
    batch%kind = kind
    batch%n_dim = n
    batch%n_vertex = v
    batch%fixed_geometry = fixed_geometry
    allocate (batch%coordinates(n, v, capacity), batch%displacement(n, v, capacity), &
              batch%gradient_old(n, v, capacity), batch%gradient_mid(n, v, capacity), &
              batch%gradient_new(n, v, capacity), batch%bubble_pressure(n, v, capacity), &
              source=0.0_wp)
    allocate (batch%pressure_old(v, capacity), batch%pressure_new(v, capacity), source=0.0_wp)
    allocate (batch%deviator_old(6, capacity), batch%linear_strain(6, capacity), source=0.0_wp)
    allocate (batch%log_volume_old(capacity), batch%log_volume_new(capacity), &
              batch%bubble_modulus(capacity), batch%relaxation(capacity), &
              batch%grad_div_modulus(capacity), batch%volume_old(capacity), &
              batch%volume_mid(capacity), batch%volume_new(capacity), batch%hoop_old(capacity), &
              batch%hoop_mid(capacity), batch%hoop_new(capacity), batch%mean_stress(capacity), &
              source=0.0_wp)
    allocate (batch%displacement_gradient(3, 3, capacity), source=0.0_wp)
    allocate (batch%bubble_compliance(n, n, capacity), source=0.0_wp)
    allocate (batch%bubble_strain(6, n, capacity), source=0.0_wp)
    allocate (batch%bubble(n, capacity), source=0.0_wp)
    allocate (batch%residual(n + 1, v, capacity), source=0.0_wp)
    allocate (batch%tangent(m, m, capacity), source=0.0_wp)

  end subroutine mini_batch_create

  !> Gradients and volumes at the start, middle and end of the step, bubble, strain and rotation;
  !> the law's inputs in `points`, all but its state, time and temperature.
  pure subroutine mini_batch_start(self, points)
    class(mini_batch_t), intent(inout) :: self
    type(point_batch_t), intent(inout) :: points

    real(wp) :: mean_stress, trace
    integer :: i

    self%inverted = 0
    do i = 1, self%n_cell
      associate (x => self%coordinates(:, :, i), u => self%displacement(:, :, i), &
                 l => self%displacement_gradient(:, :, i))

        call cell_gradients(self%kind, x, self%gradient_old(:, :, i), self%hoop_old(i), &
                            self%volume_old(i))
        if (self%fixed_geometry) then
          self%gradient_mid(:, :, i) = self%gradient_old(:, :, i)
          self%gradient_new(:, :, i) = self%gradient_old(:, :, i)
          self%hoop_mid(i) = self%hoop_old(i)
          self%hoop_new(i) = self%hoop_old(i)
          self%volume_mid(i) = self%volume_old(i)
          self%volume_new(i) = self%volume_old(i)
        else
          call cell_gradients(self%kind, x + 0.5_wp * u, self%gradient_mid(:, :, i), &
                              self%hoop_mid(i), self%volume_mid(i))
          call cell_gradients(self%kind, x + u, self%gradient_new(:, :, i), self%hoop_new(i), &
                              self%volume_new(i))
          if (.not. (self%volume_mid(i) > 0.0_wp .and. self%volume_new(i) > 0.0_wp)) then
            if (self%inverted == 0) self%inverted = i
            ! Any finite numbers do: the caller cuts the step
            self%gradient_mid(:, :, i) = self%gradient_old(:, :, i)
            self%gradient_new(:, :, i) = self%gradient_old(:, :, i)
            self%hoop_mid(i) = self%hoop_old(i)
            self%hoop_new(i) = self%hoop_old(i)
            self%volume_mid(i) = self%volume_old(i)
            self%volume_new(i) = self%volume_old(i)
          end if
        end if

        call displacement_gradient(u, self%gradient_mid(:, :, i), self%hoop_mid(i), l)
        trace = l(1, 1) + l(2, 2) + l(3, 3)
        if (self%fixed_geometry) then
          self%log_volume_new(i) = self%log_volume_old(i) + trace
          points%rotation_increment(:, :, i) = IDENTITY
          self%linear_strain(:, i) = mandel_from_matrix(l)
        else
          self%log_volume_new(i) = self%log_volume_old(i) &
            + log(self%volume_new(i) / self%volume_old(i))
          call turn(l, points%rotation_increment(:, :, i), self%linear_strain(:, i))
        end if

        call bubble_blocks(self%kind, self%gradient_old(:, :, i), self%hoop_old(i), &
                           self%volume_old(i), &
                           self%bubble_modulus(i), self%bubble_compliance(:, :, i), &
                           self%bubble_pressure(:, :, i), self%bubble_strain(:, :, i))
        call solve_bubble(self, i)
        points%strain_increment(:, i) = self%linear_strain(:, i)
        if (self%kind == AXISYMMETRIC) then
          points%strain_increment(:, i) = points%strain_increment(:, i) &
            + matmul(self%bubble_strain(:, :, i), self%bubble(:, i)) / self%volume_old(i)
        end if

        mean_stress = -sum(self%pressure_old(:, i)) / self%n_vertex
        mean_stress = mean_stress + self%grad_div_modulus(i) &
          * (self%log_volume_old(i) - self%inverse_bulk_modulus * mean_stress)
        points%stress_old(:, i) = self%deviator_old(:, i)
        if (.not. self%fixed_geometry) then
          points%stress_old(:, i) = rotated(points%stress_old(:, i), &
                                            points%rotation_increment(:, :, i))
        end if
        points%stress_old(1:3, i) = points%stress_old(1:3, i) + mean_stress

      end associate
    end do

  end subroutine mini_batch_start

  !> Bubble displacement from the linear strain and the pressure, with the frozen modulus.
  pure subroutine solve_bubble(self, i)
    class(mini_batch_t), intent(inout) :: self
    integer, intent(in) :: i

    real(wp) :: force(self%n_dim)
    integer :: v

    force = 0.0_wp
    do v = 1, self%n_vertex
      force = force + self%bubble_pressure(:, v, i) &
        * (self%pressure_new(v, i) - self%relaxation(i) * self%pressure_old(v, i))
    end do
    if (self%kind == AXISYMMETRIC) then
      force = force + self%bubble_modulus(i) &
        * matmul(self%linear_strain(:, i), self%bubble_strain(:, :, i))
    end if
    self%bubble(:, i) = -self%bubble_factor * matmul(self%bubble_compliance(:, :, i), force)

  end subroutine solve_bubble

  !> Equilibrium and volume equations of the cells, and their exact derivative.
  pure subroutine mini_batch_finish(self, points, with_tangent)
    class(mini_batch_t), intent(inout) :: self
    !> After the law's update.
    type(point_batch_t), intent(in) :: points
    logical, intent(in) :: with_tangent

    real(wp) :: elastic_change(self%n_vertex), mass, pressure, reference_volume, stress(3, 3), &
      volume_change
    integer :: i, v

    do i = 1, self%n_cell

      pressure = sum(self%pressure_new(:, i)) / self%n_vertex
      self%mean_stress(i) = self%grad_div_modulus(i) &
        * (self%log_volume_new(i) &
           + self%inverse_bulk_modulus * sum(self%pressure_old(:, i)) / self%n_vertex) - pressure
      stress = matrix_from_mandel(points%deviatoric_stress(:, i)) + self%mean_stress(i) * IDENTITY

      volume_change = self%volume_new(i) - self%volume_old(i)
      if (self%fixed_geometry) then
        volume_change = self%volume_old(i) &
          * (self%log_volume_new(i) - self%log_volume_old(i))
      end if
      ! Volume lost to the pressure, by the reference volume: of V0 exp(-p/kappa) exactly, so that
      ! the increments of all steps add up to a function of the pressure, and mass is kept
      reference_volume = self%volume_old(i)
      elastic_change = self%inverse_bulk_modulus &
        * (self%pressure_new(:, i) - self%pressure_old(:, i))
      if (.not. self%fixed_geometry) then
        reference_volume = reference_volume * exp(-self%log_volume_old(i))
        elastic_change = exp(-self%inverse_bulk_modulus * self%pressure_old(:, i)) &
          - exp(-self%inverse_bulk_modulus * self%pressure_new(:, i))
      end if
      ! Mass matrix of the vertex functions: (1 + δ) measure / ((n + 1) (n + 2))
      mass = reference_volume / ((self%n_dim + 1) * (self%n_dim + 2))

      do v = 1, self%n_vertex
        self%residual(:self%n_dim, v, i) = self%volume_new(i) &
          * matmul(stress(:self%n_dim, :self%n_dim), self%gradient_new(:, v, i))
        self%residual(1, v, i) = self%residual(1, v, i) &
          + self%volume_new(i) * stress(3, 3) * self%hoop_new(i)
        self%residual(self%n_dim + 1, v, i) = -volume_change / self%n_vertex &
          - mass * (sum(elastic_change) + elastic_change(v)) &
          + dot_product(self%bubble_pressure(:, v, i), self%bubble(:, i))
      end do

      if (with_tangent) call cell_tangent(self, points, i, stress, mass)

    end do

  end subroutine mini_batch_finish

  !> Derivative of the residual of cell `i` by its unknowns.
  pure subroutine cell_tangent(self, points, i, stress, mass)
    class(mini_batch_t), intent(inout) :: self
    type(point_batch_t), intent(in) :: points
    integer, intent(in) :: i
    !> Cauchy stress.
    real(wp), intent(in) :: stress(3, 3)
    !> Factor of the mass matrix of the vertex functions.
    real(wp), intent(in) :: mass

    real(wp) :: bubble_share(6, 6), by_gradient(6, 3, 3), change(6), change_matrix(3, 3), &
      compressibility, memory(6, 3, 3), strain_change(6, self%n_dim, self%n_vertex), &
      stress_change(6, 3, 3)
    integer :: a, b, j, k, m, n, r, v

    n = self%n_dim
    v = self%n_vertex
    m = n + 1
    associate (g => self%gradient_new(:, :, i), gm => self%gradient_mid(:, :, i), &
               volume => self%volume_new(i), hoop => self%hoop_new(i), &
               t => self%tangent(:, :, i), modulus => points%deviatoric_tangent(:, :, i))

      call strain_by_gradient(self%fixed_geometry, self%displacement_gradient(:, :, i), &
                              self%linear_strain(:, i), points%stress_old(:, i), &
                              points%memory_modulus(i), by_gradient, memory)
      if (self%kind == AXISYMMETRIC) then
        ! The mean strain of the bubble, which the law sees, answers to the linear strain
        bubble_share = -self%bubble_factor * self%bubble_modulus(i) / self%volume_old(i) &
          * matmul(matmul(self%bubble_strain(:, :, i), self%bubble_compliance(:, :, i)), &
                   transpose(self%bubble_strain(:, :, i)))
        do k = 1, 6
          bubble_share(k, k) = bubble_share(k, k) + 1.0_wp
        end do
        do b = 1, v
          do j = 1, n
            strain_change(:, j, b) = by_gradient(:, j, 1) * gm(1, b) &
              + by_gradient(:, j, 2) * gm(2, b)
            if (j == 1) strain_change(:, j, b) = strain_change(:, j, b) &
              + by_gradient(:, 3, 3) * self%hoop_mid(i)
          end do
        end do
        do k = 1, 3
          do j = 1, 3
            by_gradient(:, j, k) = matmul(bubble_share, by_gradient(:, j, k))
          end do
        end do
      end if
      do k = 1, 3
        do j = 1, 3
          if (n == 2 .and. (j == 3 .neqv. k == 3)) cycle
          stress_change(:, j, k) = matmul(modulus, by_gradient(:, j, k) + memory(:, j, k))
        end do
      end do

      ! Sizes as constants, which the compiler may unroll
      if (n == 3) then
        call add_stiffness(3, 4, .not. self%fixed_geometry, volume, hoop, self%hoop_mid(i), &
                           self%grad_div_modulus(i), stress, g, gm, stress_change, t)
      else
        call add_stiffness(2, 3, .not. self%fixed_geometry, volume, hoop, self%hoop_mid(i), &
                           self%grad_div_modulus(i), stress, g, gm, stress_change, t)
      end if

      do b = 1, v
        compressibility = self%inverse_bulk_modulus
        if (.not. self%fixed_geometry) then
          compressibility = compressibility &
            * exp(-self%inverse_bulk_modulus * self%pressure_new(b, i))
        end if
        do a = 1, v
          t(m * a, m * b) = -mass * compressibility * merge(2.0_wp, 1.0_wp, a == b) &
            - self%bubble_factor &
            * dot_product(self%bubble_pressure(:, a, i), &
                          matmul(self%bubble_compliance(:, :, i), self%bubble_pressure(:, b, i)))
        end do
      end do

      if (self%kind == AXISYMMETRIC) then
        do b = 1, v
          ! The pressure moves the bubble, which strains the cell; the strain moves the bubble
          change = -self%bubble_factor / self%volume_old(i) &
            * matmul(self%bubble_strain(:, :, i), &
                     matmul(self%bubble_compliance(:, :, i), self%bubble_pressure(:, b, i)))
          do a = 1, v
            do j = 1, n
              t(m * b, m * (a - 1) + j) = t(m * b, m * (a - 1) + j) + self%volume_old(i) &
                * self%bubble_modulus(i) * dot_product(change, strain_change(:, j, a))
            end do
          end do
          change_matrix = matrix_from_mandel(matmul(modulus, change))
          do a = 1, v
            r = m * (a - 1)
            t(r + 1:r + n, m * b) = t(r + 1:r + n, m * b) &
              + volume * matmul(change_matrix(:n, :n), g(:, a))
            t(r + 1, m * b) = t(r + 1, m * b) + volume * change_matrix(3, 3) * hoop
          end do
        end do
      end if

    end associate

  end subroutine cell_tangent

  !> Derivative of the internal forces by the displacements, and of both equations by the other
  !> unknown, without what the bubble adds.
  pure subroutine add_stiffness(n, v, moving, volume, hoop, hoop_mid, grad_div_modulus, stress, g, &
                                gm, stress_change, t)
    !> Space dimension and vertices.
    integer, intent(in) :: n, v
    !> True when the geometry follows the displacement.
    logical, intent(in) :: moving
    real(wp), intent(in) :: volume, hoop, hoop_mid, grad_div_modulus
    !> Cauchy stress.
    real(wp), intent(in) :: stress(3, 3)
    !> Gradients of the vertex functions at the end and the middle of the step.
    real(wp), intent(in) :: g(n, v), gm(n, v)
    !> Deviator by the displacement gradient; see `strain_by_gradient`.
    real(wp), intent(in) :: stress_change(6, 3, 3)
    real(wp), intent(inout) :: t((n + 1) * v, (n + 1) * v)

    real(wp) :: change(6), change_matrix(3, 3), divergence(n, v), force(n), stress_gradient(n, v)
    integer :: a, b, column, j, k, r

    divergence = g
    divergence(1, :) = divergence(1, :) + hoop
    do a = 1, v
      do k = 1, n
        stress_gradient(k, a) = dot_product(stress(:n, k), g(:, a))
      end do
      stress_gradient(1, a) = stress_gradient(1, a) + stress(3, 3) * hoop
    end do

    do b = 1, v
      do j = 1, n
        column = (n + 1) * (b - 1) + j
        change = stress_change(:, j, 1) * gm(1, b)
        do k = 2, n
          change = change + stress_change(:, j, k) * gm(k, b)
        end do
        if (j == 1 .and. n == 2) change = change + stress_change(:, 3, 3) * hoop_mid
        change(1:3) = change(1:3) + grad_div_modulus * divergence(j, b)
        change_matrix = matrix_from_mandel(change)
        do a = 1, v
          r = (n + 1) * (a - 1)
          do k = 1, n
            force(k) = dot_product(change_matrix(:n, k), g(:, a))
          end do
          if (n == 2) force(1) = force(1) + change_matrix(3, 3) * hoop
          if (moving) then
            force = force + divergence(j, b) * stress_gradient(:, a) &
              - g(j, a) * stress_gradient(:, b)
            ! The hoop term of the line above belongs to the radius, not to the gradient
            if (n == 2) force(1) = force(1) + stress(3, 3) * hoop &
              * (g(j, a) - merge(hoop, 0.0_wp, j == 1))
          end if
          t(r + 1:r + n, column) = volume * force
          t(r + n + 1, column) = -volume * divergence(j, b) / v
          t(column, r + n + 1) = -volume * divergence(j, b) / v
        end do
      end do
    end do

  end subroutine add_stiffness

  !> Gradients of the vertex functions, hoop strain of a unit radial displacement and measure.
  pure subroutine cell_gradients(kind, x, gradient, hoop, volume)
    !> `PLANE_STRAIN`, `AXISYMMETRIC` or `THREE_DIMENSIONAL`.
    integer, intent(in) :: kind
    !> Vertices [length]; shape (n_dim, n_dim + 1).
    real(wp), contiguous, intent(in) :: x(:, :)
    !> [1/length]; shape (n_dim, n_dim + 1). Infinite or undefined where the volume is 0.
    real(wp), contiguous, intent(out) :: gradient(:, :)
    !> [1/length]; 0 unless axisymmetric.
    real(wp), intent(out) :: hoop
    !> Positive for a cell that is not inverted [length^3].
    real(wp), intent(out) :: volume

    real(wp) :: a(3), b(3), c(3), determinant

    hoop = 0.0_wp
    if (kind == THREE_DIMENSIONAL) then
      a = x(:, 2) - x(:, 1)
      b = x(:, 3) - x(:, 1)
      c = x(:, 4) - x(:, 1)
      gradient(:, 2) = cross(b, c)
      gradient(:, 3) = cross(c, a)
      gradient(:, 4) = cross(a, b)
      determinant = a(1) * gradient(1, 2) + a(2) * gradient(2, 2) + a(3) * gradient(3, 2)
      volume = determinant / 6.0_wp
      if (.not. abs(determinant) > 0.0_wp) return
      gradient(:, 2:4) = gradient(:, 2:4) / determinant
      gradient(:, 1) = -gradient(:, 2) - gradient(:, 3) - gradient(:, 4)
    else
      gradient(:, 1) = [x(2, 2) - x(2, 3), x(1, 3) - x(1, 2)]
      gradient(:, 2) = [x(2, 3) - x(2, 1), x(1, 1) - x(1, 3)]
      gradient(:, 3) = [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1)]
      determinant = (x(1, 2) - x(1, 1)) * (x(2, 3) - x(2, 1)) &
        - (x(1, 3) - x(1, 1)) * (x(2, 2) - x(2, 1))
      volume = 0.5_wp * determinant
      if (.not. abs(determinant) > 0.0_wp) return
      gradient = gradient / determinant
      if (kind == AXISYMMETRIC) then
        volume = volume * TWO_PI * sum(x(1, :)) / 3.0_wp
        hoop = 1.0_wp / sum(x(1, :))
      end if
    end if

  end subroutine cell_gradients

  !> Signed measure of a cell [length^3]; see [[cell_gradients]].
  pure function cell_volume(kind, x) result(volume)
    integer, intent(in) :: kind
    real(wp), contiguous, intent(in) :: x(:, :)
    real(wp) :: volume

    real(wp) :: gradient(size(x, 1), size(x, 2)), hoop

    call cell_gradients(kind, x, gradient, hoop, volume)

  end function cell_volume

  !> Blocks of the bubble: inverse of K_bb for the secant modulus 2µ, K_bp and the integral of the
  !> bubble's strain (which only axial symmetry has).
  !>
  !> K_bb = µ ∫ (|grad b|² I + ⅓ grad b ⊗ grad b), from the deviator alone; K_bp = ∫ b grad λ.
  !> Axial symmetry weights with the radius of the centroid, and adds the hoop strain b/r.
  pure subroutine bubble_blocks(kind, gradient, hoop, volume, modulus, compliance, by_pressure, &
                                strain)
    integer, intent(in) :: kind
    !> Of the vertex functions [1/length]; shape (n_dim, n_dim + 1).
    real(wp), contiguous, intent(in) :: gradient(:, :)
    real(wp), intent(in) :: hoop
    real(wp), intent(in) :: volume
    !> Secant 2µ [stress], positive.
    real(wp), intent(in) :: modulus
    !> K_bb^-1 [length/force]; shape (n_dim, n_dim).
    real(wp), contiguous, intent(out) :: compliance(:, :)
    !> K_bp [length^2]; shape (n_dim, n_dim + 1).
    real(wp), contiguous, intent(out) :: by_pressure(:, :)
    !> E, Mandel [length^2]; shape (6, n_dim).
    real(wp), contiguous, intent(out) :: strain(:, :)

    real(wp) :: inverse(3, 3), moment, products(3, 3), radius_inverse, stiffness(3, 3)
    integer :: i, j, n

    n = size(gradient, 1)
    products = 0.0_wp
    do j = 1, n
      do i = 1, n
        products(i, j) = dot_product(gradient(i, :), gradient(j, :))
      end do
    end do
    stiffness = products / 3.0_wp &
      + (products(1, 1) + products(2, 2) + products(3, 3)) * IDENTITY
    stiffness = 0.5_wp * modulus * BUBBLE_STIFFNESS(n) * volume * stiffness
    by_pressure = BUBBLE_MEAN(n) * volume * gradient
    strain = 0.0_wp
    if (kind == AXISYMMETRIC) then
      radius_inverse = 3.0_wp * hoop
      stiffness(1, 1) = stiffness(1, 1) &
        + 2.0_wp / 3.0_wp * modulus * BUBBLE_SQUARE_2D * volume * radius_inverse**2
      moment = BUBBLE_MEAN(n) * volume * radius_inverse
      strain(1, 1) = -moment
      strain(3, 1) = moment
      strain(6, 2) = -moment / SQRT2
    end if
    if (n == 2) then
      inverse(1, :) = [stiffness(2, 2), -stiffness(1, 2), 0.0_wp]
      inverse(2, :) = [-stiffness(2, 1), stiffness(1, 1), 0.0_wp]
      compliance = inverse(:2, :2) &
        / (stiffness(1, 1) * stiffness(2, 2) - stiffness(1, 2) * stiffness(2, 1))
    else
      inverse(:, 1) = cross(stiffness(:, 2), stiffness(:, 3))
      inverse(:, 2) = cross(stiffness(:, 3), stiffness(:, 1))
      inverse(:, 3) = cross(stiffness(:, 1), stiffness(:, 2))
      compliance = transpose(inverse) / dot_product(stiffness(:, 1), inverse(:, 1))
    end if

  end subroutine bubble_blocks

  !> Σ u ⊗ gradient, with the hoop strain in its last component.
  pure subroutine displacement_gradient(u, gradient, hoop, l)
    real(wp), contiguous, intent(in) :: u(:, :)
    real(wp), contiguous, intent(in) :: gradient(:, :)
    real(wp), intent(in) :: hoop
    real(wp), intent(out) :: l(3, 3)

    integer :: j, k, n

    n = size(u, 1)
    l = 0.0_wp
    do k = 1, n
      do j = 1, n
        l(j, k) = dot_product(u(j, :), gradient(k, :))
      end do
    end do
    if (hoop > 0.0_wp) l(3, 3) = hoop * sum(u(1, :))

  end subroutine displacement_gradient

  !> Rotation Q of the step and strain increment turned by H = Q^(1/2), from the gradient at the
  !> middle of the step.
  !>
  !> With the axial vector a of half the spin, (I - W)^-1 = (I + W + a ⊗ a) / (1 + a²) and
  !> Q = 2 (I - W)^-1 - I (Cayley); H is the same of a / (1 + sqrt(1 + a²)).
  pure subroutine turn(l, rotation, strain)
    real(wp), intent(in) :: l(3, 3)
    real(wp), intent(out) :: rotation(3, 3)
    !> Mandel.
    real(wp), intent(out) :: strain(6)

    real(wp) :: a(3), half(3, 3)

    a = half_spin(l)
    rotation = cayley(a)
    strain = mandel_from_matrix(l)
    if (dot_product(a, a) > 0.0_wp) then
      half = cayley(a / (1.0_wp + sqrt(1.0_wp + dot_product(a, a))))
      strain = rotated(strain, half)
    end if

  end subroutine turn

  !> Derivative of the turned strain by the displacement gradient at the middle, and of the
  !> rotated old stress as the strain of same effect, both by the displacement increment's
  !> gradient on the middle configuration: the middle moves by half of the displacement, which
  !> multiplies the change by (I - L/2).
  pure subroutine strain_by_gradient(fixed_geometry, l, strain, stress_old, memory_modulus, &
                                     by_gradient, memory)
    logical, intent(in) :: fixed_geometry
    real(wp), intent(in) :: l(3, 3)
    !> Turned, Mandel.
    real(wp), intent(in) :: strain(6)
    !> Rotated, Mandel [stress].
    real(wp), intent(in) :: stress_old(6)
    !> 2G, or 0 for a law that forgets its stress.
    real(wp), intent(in) :: memory_modulus
    !> Column (j, k) belongs to a change e_j ⊗ e_k; shape (6, 3, 3).
    real(wp), intent(out) :: by_gradient(6, 3, 3), memory(6, 3, 3)

    real(wp) :: a(3), a2, axial(3), half(3), half_rate(3), moved(6, 3, 3), moved_memory(6, 3, 3), &
      of_spin(6, 3), of_spin_memory(6, 3), rate(3), root, shrink(3, 3), turning(6, 6)
    integer :: i, j, k

    if (fixed_geometry) then
      memory = 0.0_wp
      by_gradient = 0.0_wp
      do k = 1, 3
        do j = 1, 3
          by_gradient(ROW(j, k), j, k) = merge(1.0_wp, 1.0_wp / SQRT2, j == k)
        end do
      end do
      return
    end if

    a = half_spin(l)
    a2 = dot_product(a, a)
    root = sqrt(1.0_wp + a2)
    half = a / (1.0_wp + root)
    call mandel_rotation(cayley(half), turning)
    ! Unit changes of the axial vector of the spin
    do i = 1, 3
      axial = 0.0_wp
      axial(i) = 1.0_wp
      rate = (axial + cross(a, axial)) / (1.0_wp + a2)
      half_rate = axial / (1.0_wp + root) - a * (a(i) / root) / (1.0_wp + root)**2
      half_rate = (half_rate + cross(half, half_rate)) / (1.0_wp + dot_product(half, half))
      of_spin(:, i) = spun(strain, half_rate)
      of_spin_memory(:, i) = 0.0_wp
      if (memory_modulus > 0.0_wp) of_spin_memory(:, i) = spun(stress_old, rate) / memory_modulus
    end do
    do k = 1, 3
      moved(:, k, k) = turning(:, k)
      moved_memory(:, k, k) = 0.0_wp
      ! e_i ⊗ e_j with (i, j, k) cyclic has the axial vector -e_k / 2
      i = mod(k, 3) + 1
      j = mod(i, 3) + 1
      moved(:, i, j) = turning(:, ROW(i, j)) / SQRT2 - 0.5_wp * of_spin(:, k)
      moved(:, j, i) = turning(:, ROW(i, j)) / SQRT2 + 0.5_wp * of_spin(:, k)
      moved_memory(:, i, j) = -0.5_wp * of_spin_memory(:, k)
      moved_memory(:, j, i) = 0.5_wp * of_spin_memory(:, k)
    end do

    shrink = IDENTITY - 0.5_wp * l
    do k = 1, 3
      do j = 1, 3
        by_gradient(:, j, k) = shrink(1, j) * moved(:, 1, k) + shrink(2, j) * moved(:, 2, k) &
          + shrink(3, j) * moved(:, 3, k)
        memory(:, j, k) = shrink(1, j) * moved_memory(:, 1, k) &
          + shrink(2, j) * moved_memory(:, 2, k) + shrink(3, j) * moved_memory(:, 3, k)
      end do
    end do

  end subroutine strain_by_gradient

  !> Axial vector of half of the skew part of a gradient.
  pure function half_spin(l) result(a)
    real(wp), intent(in) :: l(3, 3)
    real(wp) :: a(3)

    a = 0.25_wp * [l(3, 2) - l(2, 3), l(1, 3) - l(3, 1), l(2, 1) - l(1, 2)]

  end function half_spin

  !> Rotation of twice the angle whose tangent is |a|, about a.
  pure function cayley(a) result(q)
    real(wp), intent(in) :: a(3)
    real(wp) :: q(3, 3)

    real(wp) :: scale
    integer :: j

    scale = 2.0_wp / (1.0_wp + dot_product(a, a))
    do j = 1, 3
      q(:, j) = scale * a * a(j)
      q(j, j) = q(j, j) + scale - 1.0_wp
    end do
    q(2, 1) = q(2, 1) + scale * a(3)
    q(1, 2) = q(1, 2) - scale * a(3)
    q(3, 2) = q(3, 2) + scale * a(1)
    q(2, 3) = q(2, 3) - scale * a(1)
    q(1, 3) = q(1, 3) + scale * a(2)
    q(3, 1) = q(3, 1) - scale * a(2)

  end function cayley

  !> Change of a tensor that turns at a rate: Ω s - s Ω with Ω x = axial × x. Mandel.
  pure function spun(s, axial) result(change)
    real(wp), intent(in) :: s(6)
    real(wp), intent(in) :: axial(3)
    real(wp) :: change(6)

    real(wp) :: m(3, 3), moved(3, 3)
    integer :: j

    m = matrix_from_mandel(s)
    do j = 1, 3
      moved(:, j) = cross(axial, m(:, j))
    end do
    change = 2.0_wp * mandel_from_matrix(moved)

  end function spun

  !> The 6×6 matrix of a ↦ Q a Q^T in Mandel notation.
  pure subroutine mandel_rotation(q, matrix)
    real(wp), intent(in) :: q(3, 3)
    real(wp), intent(out) :: matrix(6, 6)

    integer, parameter :: FIRST(6) = [1, 2, 3, 2, 1, 1]
    integer, parameter :: SECOND(6) = [1, 2, 3, 3, 3, 2]
    integer :: column, r

    do column = 1, 6
      do r = 1, 6
        matrix(r, column) = q(FIRST(r), FIRST(column)) * q(SECOND(r), SECOND(column))
        if (column > 3) then
          matrix(r, column) = (matrix(r, column) &
                               + q(FIRST(r), SECOND(column)) * q(SECOND(r), FIRST(column))) / SQRT2
        end if
        if (r > 3) matrix(r, column) = matrix(r, column) * SQRT2
      end do
    end do

  end subroutine mandel_rotation

  pure function cross(a, b) result(c)
    real(wp), intent(in) :: a(3)
    real(wp), intent(in) :: b(3)
    real(wp) :: c(3)

    c = [a(2) * b(3) - a(3) * b(2), a(3) * b(1) - a(1) * b(3), a(1) * b(2) - a(2) * b(1)]

  end function cross

end module swage_mini_element
