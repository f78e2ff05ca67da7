!> Checks of the P1+/P1 element, shared by its unit tests and by its verification: each returns
!> the relative error of one property.
module swage_test_element_checks
  use swage_kinds, only: wp
  use swage_mandel, only: deviator, mandel_from_matrix, rotated
  use swage_material_law, only: material_law_t
  use swage_cell_geometry, only: AXISYMMETRIC, cell_volume, PLANE_STRAIN, THREE_DIMENSIONAL
  use swage_state_table, only: STATE_TENSOR2
  use swage_test_assembly, only: assembly_create, assembly_t
  use swage_test_lapack, only: dgesv
  use swage_test_meshes, only: box_mesh, jiggle, on_boundary, rectangle_mesh
  use swage_test_quadrature, only: simplex_rule
  use swage_test_random, only: random_t
  implicit none(type, external)
  private

  public :: KINDS, KIND_NAMES
  public :: condensation_error, patch_errors, rotation_errors, tangent_error, volume_error

  integer, parameter :: KINDS(3) = [PLANE_STRAIN, AXISYMMETRIC, THREE_DIMENSIONAL]
  !> In the order of `KINDS`.
  character(len=12), parameter :: KIND_NAMES(3) = [character(len=12) :: 'plane strain', &
                                                   'axisymmetric', '3D']

contains

  !> A cell of size about 1, far from flat; two radii from the axis in axial symmetry.
  subroutine random_cell(kind, random, x)
    integer, intent(in) :: kind
    type(random_t), intent(inout) :: random
    !> Shape (n_dim, n_dim + 1).
    real(wp), intent(out) :: x(:, :)

    integer :: i

    do i = 1, size(x, 2)
      call random%fill(-0.25_wp, 0.25_wp, x(:, i))
    end do
    do i = 1, size(x, 1)
      x(i, i + 1) = x(i, i + 1) + 1.0_wp
    end do
    if (kind == AXISYMMETRIC) x(1, :) = x(1, :) + 1.0_wp

  end subroutine random_cell

  !> Many separate cells, each with its own old state, and unknowns far from it: strains of a few
  !> percent and rotations of up to a radian.
  subroutine scatter_cells(kind, fixed_geometry, law, n_cell, stress, assembly)
    integer, intent(in) :: kind
    logical, intent(in) :: fixed_geometry
    class(material_law_t), intent(in) :: law
    integer, intent(in) :: n_cell
    !> Size of old stresses and pressures.
    real(wp), intent(in) :: stress
    type(assembly_t), intent(out) :: assembly

    type(random_t) :: random
    real(wp), allocatable :: x(:, :)
    real(wp) :: angle, centre(3), gradient(3, 3), motion(3, 3), s(6)
    integer, allocatable :: cells(:, :)
    integer :: cell, first, i, m, n, node, vertex

    n = merge(3, 2, kind == THREE_DIMENSIONAL)
    m = n + 1
    allocate (x(n, m * n_cell), cells(m, n_cell))
    do cell = 1, n_cell
      cells(:, cell) = [(m * (cell - 1) + vertex, vertex=1, m)]
      call random_cell(kind, random, x(:, cells(1, cell):cells(m, cell)))
    end do
    call assembly_create(kind, fixed_geometry, law, x, cells, assembly)

    associate (batch => assembly)
      batch%bubble_factor = 2.5_wp
      do cell = 1, n_cell
        call random%fill(-stress, stress, s)
        if (n == 2) s(4:5) = 0.0_wp
        batch%deviator_old(:, cell) = deviator(s)
        call scatter_tensors(law, n, stress, random, batch%state_old(:, cell))
        call random%fill(-stress, stress, batch%pressure_old(:, cell))
        call random%next(-0.05_wp, 0.05_wp, batch%log_volume_old(cell))
        call random%next(0.5_wp * stress, 2.0_wp * stress, batch%grad_div_modulus(cell))
        call random%next(0.0_wp, 1.0_wp, batch%relaxation(cell))
        call random%next(0.3_wp, 1.0_wp, batch%bubble_modulus(cell))
        batch%bubble_modulus(cell) = batch%bubble_modulus(cell) * law%reference_modulus

        ! A rotation about a random axis (the third in 2D), then a small gradient
        motion = 0.0_wp
        call random%fill(-1.0_wp, 1.0_wp, centre)
        if (n == 2) centre(1:2) = 0.0_wp
        call random%next(-1.0_wp, 1.0_wp, angle)
        motion = rotation_about(centre, angle)
        do i = 1, 3
          call random%fill(-0.05_wp, 0.05_wp, gradient(:, i))
        end do
        motion = matmul(motion, gradient) + motion
        do i = 1, 3
          motion(i, i) = motion(i, i) - 1.0_wp
        end do
        ! The small strain of a rotation is large: without spin, only the gradient
        if (fixed_geometry) motion = gradient
        centre(:n) = sum(x(:, cells(:, cell)), dim=2) / m
        do vertex = 1, m
          node = cells(vertex, cell)
          first = m * (node - 1)
          assembly%unknowns(first + 1:first + n) = &
            matmul(motion(:n, :n), x(:, node) - centre(:n))
          call random%next(-stress, stress, assembly%unknowns(first + m))
        end do
      end do
    end associate

  end subroutine scatter_cells

  !> Random deviators for the tensors of a history.
  subroutine scatter_tensors(law, n_dim, stress, random, state)
    class(material_law_t), intent(in) :: law
    integer, intent(in) :: n_dim
    !> Size of the tensors.
    real(wp), intent(in) :: stress
    type(random_t), intent(inout) :: random
    real(wp), intent(inout) :: state(:)

    real(wp) :: s(6)
    integer :: i, row

    row = 1
    do i = 1, size(law%state_table)
      if (law%state_table(i)%kind == STATE_TENSOR2) then
        call random%fill(-stress, stress, s)
        if (n_dim == 2) s(4:5) = 0.0_wp
        state(row:row + 5) = deviator(s)
      end if
      row = row + law%state_table(i)%width()
    end do

  end subroutine scatter_tensors

  !> Give all tensors of a history one value.
  pure subroutine set_tensors(law, tensor, state)
    class(material_law_t), intent(in) :: law
    real(wp), intent(in) :: tensor(6)
    real(wp), intent(inout) :: state(:)

    integer :: i, row

    row = 1
    do i = 1, size(law%state_table)
      if (law%state_table(i)%kind == STATE_TENSOR2) state(row:row + 5) = tensor
      row = row + law%state_table(i)%width()
    end do

  end subroutine set_tensors

  !> Rotation by an angle about an axis of any length.
  pure function rotation_about(axis, angle) result(q)
    real(wp), intent(in) :: axis(3)
    !> [rad]
    real(wp), intent(in) :: angle
    real(wp) :: q(3, 3)

    real(wp) :: a(3)
    integer :: j

    a = axis / norm2(axis)
    do j = 1, 3
      q(:, j) = (1.0_wp - cos(angle)) * a * a(j)
      q(j, j) = q(j, j) + cos(angle)
    end do
    q(2, 1) = q(2, 1) + sin(angle) * a(3)
    q(1, 2) = q(1, 2) - sin(angle) * a(3)
    q(3, 2) = q(3, 2) + sin(angle) * a(1)
    q(2, 3) = q(2, 3) - sin(angle) * a(1)
    q(1, 3) = q(1, 3) + sin(angle) * a(2)
    q(3, 1) = q(3, 1) - sin(angle) * a(2)

  end function rotation_about

  !> Tangent of the element against differences of fourth order of its residual, on 50 random
  !> cells: largest difference of each of the four blocks, by the largest entry of the block.
  subroutine tangent_error(kind, fixed_geometry, law, stress, error)
    integer, intent(in) :: kind
    logical, intent(in) :: fixed_geometry
    class(material_law_t), intent(in) :: law
    !> Size of old stresses and pressures: with plasticity, several times the yield stress makes
    !> nearly every cell flow.
    real(wp), intent(in) :: stress
    real(wp), intent(out) :: error

    integer, parameter :: N_CELL = 50
    real(wp), parameter :: STEP_SIZE = 3.0e-5_wp
    integer, parameter :: PLACES(4) = [-2, -1, 1, 2]
    real(wp), parameter :: WEIGHTS(4) = [1.0_wp, -8.0_wp, 8.0_wp, -1.0_wp] / 12.0_wp
    type(assembly_t) :: assembly
    real(wp), allocatable :: numeric(:, :, :), start(:), tangent(:, :, :)
    real(wp) :: step
    integer :: column, i, m, n_unknown, row

    call scatter_cells(kind, fixed_geometry, law, N_CELL, stress, assembly)
    call assembly%evaluate()
    allocate (tangent, source=assembly%tangent)
    allocate (start, source=assembly%unknowns)
    m = assembly%n_dim + 1
    n_unknown = m * m
    allocate (numeric(n_unknown, n_unknown, N_CELL))
    ! The same unknown of every cell at once: cells share no node
    do column = 1, n_unknown
      step = STEP_SIZE
      if (mod(column, m) == 0) step = STEP_SIZE * stress
      numeric(:, column, :) = 0.0_wp
      do i = 1, size(PLACES)
        assembly%unknowns = start
        assembly%unknowns(column::n_unknown) = start(column::n_unknown) + PLACES(i) * step
        call assembly%evaluate()
        numeric(:, column, :) = numeric(:, column, :) + WEIGHTS(i) / step &
          * reshape(assembly%residual, [n_unknown, N_CELL])
      end do
    end do
    if (assembly%n_failed > 0 .or. assembly%n_inverted > 0) then
      error = huge(1.0_wp)
      return
    end if

    error = 0.0_wp
    numeric = numeric - tangent
    do row = 0, 1
      do column = 0, 1
        associate (rows => block_of(row, m), columns => block_of(column, m))
          error = max(error, maxval(abs(numeric(rows, columns, :))) &
                      / maxval(abs(tangent(rows, columns, :))))
        end associate
      end do
    end do

  end subroutine tangent_error

  !> Displacements (0) or pressures (1) among the unknowns of a cell.
  pure function block_of(which, m) result(places)
    integer, intent(in) :: which
    !> Unknowns of a node.
    integer, intent(in) :: m
    integer, allocatable :: places(:)

    integer :: i

    if (which == 0) then
      places = pack([(i, i=1, m * m)], [(mod(i, m) /= 0, i=1, m * m)])
    else
      places = [(m * i, i=1, m)]
    end if

  end function block_of

  !> Full system of a cell with its bubble, integrated numerically from the functions themselves
  !> and condensed by elimination, against the element: tangent and residual.
  !>
  !> In axial symmetry, as the element states it: linear functions at the centroid, K_bb with the
  !> radius of the centroid, all else exactly.
  subroutine condensation_error(kind, law, shear_modulus, error)
    integer, intent(in) :: kind
    !> Elastic.
    class(material_law_t), intent(in) :: law
    real(wp), intent(in) :: shear_modulus
    real(wp), intent(out) :: error

    integer, parameter :: N_CELL = 20
    type(assembly_t) :: assembly
    real(wp), allocatable :: bubble(:, :), condensed(:, :), full(:, :), residual(:), &
      right(:, :), x(:, :)
    integer, allocatable :: pivots(:), place(:)
    integer :: cell, info, m, n

    call scatter_cells(kind, .true., law, N_CELL, 1.0_wp, assembly)
    assembly%bubble_factor = 1.0_wp
    assembly%bubble_modulus = 2.0_wp * shear_modulus
    assembly%relaxation = 1.0_wp
    assembly%deviator_old = 0.0_wp
    assembly%pressure_old = 0.0_wp
    assembly%log_volume_old = 0.0_wp
    call assembly%evaluate()

    n = assembly%n_dim
    m = (n + 1)**2
    error = 0.0_wp
    allocate (pivots(n), place(m), residual(m), bubble(n, n), right(n, m), condensed(m, m), &
              x(n, n + 1))
    do cell = 1, N_CELL
      x = assembly%coordinates(:, assembly%cells(:, cell))
      call full_system(kind, x, shear_modulus, &
                       law%inverse_bulk_modulus, &
                       assembly%grad_div_modulus(cell), full)
      right = full(m + 1:, :m)
      bubble = full(m + 1:, m + 1:)
      call dgesv(n, m, bubble, n, pivots, right, n, info)
      condensed = full(:m, :m) - matmul(full(:m, m + 1:), right)
      error = max(error, maxval(abs(condensed - assembly%tangent(:, :, cell))) &
                  / maxval(abs(condensed)))
      place = assembly%get_place(cell)
      residual = matmul(condensed, assembly%unknowns(place))
      error = max(error, maxval(abs(residual - reshape(assembly%residual(:, :, cell), [m]))) &
                  / maxval(abs(residual)))
    end do

  end subroutine condensation_error

  !> Matrix of a cell: displacement and pressure vertex by vertex, then the bubble.
  subroutine full_system(kind, x, shear_modulus, inverse_bulk_modulus, grad_div_modulus, matrix)
    integer, intent(in) :: kind
    real(wp), contiguous, intent(in) :: x(:, :)
    real(wp), intent(in) :: shear_modulus
    real(wp), intent(in) :: inverse_bulk_modulus
    real(wp), intent(in) :: grad_div_modulus
    real(wp), allocatable, intent(out) :: matrix(:, :)

    integer, parameter :: POINTS_EACH_WAY = 6
    real(wp), allocatable :: barycentric(:, :), gradient(:, :), linear(:, :), weight(:), &
      strain(:, :)
    real(wp) :: bubble, bubble_gradient(size(x, 1)), centre_radius, modulus(6, 6), radius, &
      scale, trace, volume
    integer :: a, b, i, j, m, n, point

    n = size(x, 1)
    m = (n + 1)**2
    allocate (matrix(m + n, m + n), source=0.0_wp)
    allocate (linear(6, m), source=0.0_wp)
    allocate (strain(6, n))
    allocate (gradient(n, n + 1))
    call vertex_gradients(x, gradient)
    volume = abs(cell_volume(merge(THREE_DIMENSIONAL, PLANE_STRAIN, n == 3), x))
    centre_radius = sum(x(1, :)) / (n + 1)
    scale = 1.0_wp
    if (kind == AXISYMMETRIC) scale = 2.0_wp * acos(-1.0_wp) * centre_radius

    modulus = 0.0_wp
    modulus(1:3, 1:3) = -2.0_wp * shear_modulus / 3.0_wp
    do i = 1, 6
      modulus(i, i) = modulus(i, i) + 2.0_wp * shear_modulus
    end do

    do a = 1, n + 1
      do j = 1, n
        linear(:, (n + 1) * (a - 1) + j) = strain_of(kind, j, gradient(:, a), &
                                                     1.0_wp / (n + 1), centre_radius)
      end do
    end do
    matrix(:m, :m) = scale * volume * matmul(transpose(linear), matmul(modulus, linear))
    do j = 1, m
      do i = 1, m
        matrix(i, j) = matrix(i, j) + scale * volume * grad_div_modulus &
          * sum(linear(1:3, i)) * sum(linear(1:3, j))
      end do
      do b = 1, n + 1
        trace = -scale * volume / (n + 1) * sum(linear(1:3, j))
        matrix(j, (n + 1) * b) = matrix(j, (n + 1) * b) + trace
        matrix((n + 1) * b, j) = matrix((n + 1) * b, j) + trace
      end do
    end do

    call simplex_rule(n, POINTS_EACH_WAY, barycentric, weight)
    do point = 1, size(weight)
      associate (l => barycentric(:, point))
        radius = dot_product(x(1, :), l)
        if (kind == AXISYMMETRIC) scale = 2.0_wp * acos(-1.0_wp) * radius
        call bubble_function(l, gradient, bubble, bubble_gradient)

        do j = 1, n
          strain(:, j) = strain_of(kind, j, bubble_gradient, bubble, radius)
        end do
        matrix(:m, m + 1:) = matrix(:m, m + 1:) &
          + weight(point) * scale * volume * matmul(transpose(linear), matmul(modulus, strain))
        do j = 1, n
          do a = 1, n + 1
            matrix((n + 1) * a, m + j) = matrix((n + 1) * a, m + j) &
              - weight(point) * scale * volume * l(a) * sum(strain(1:3, j))
          end do
        end do

        if (kind == AXISYMMETRIC) scale = 2.0_wp * acos(-1.0_wp) * centre_radius
        do j = 1, n
          strain(:, j) = strain_of(kind, j, bubble_gradient, bubble, centre_radius)
        end do
        matrix(m + 1:, m + 1:) = matrix(m + 1:, m + 1:) &
          + weight(point) * scale * volume * matmul(transpose(strain), matmul(modulus, strain))

        ! The mass of the pressure takes the radius of the centroid as well
        do b = 1, n + 1
          do a = 1, n + 1
            matrix((n + 1) * a, (n + 1) * b) = matrix((n + 1) * a, (n + 1) * b) &
              - weight(point) * scale * volume * inverse_bulk_modulus * l(a) * l(b)
          end do
        end do
      end associate
    end do
    matrix(m + 1:, :m) = transpose(matrix(:m, m + 1:))

  end subroutine full_system

  !> Gradients of the barycentric coordinates, by inversion.
  subroutine vertex_gradients(x, gradient)
    real(wp), intent(in) :: x(:, :)
    real(wp), intent(out) :: gradient(:, :)

    real(wp) :: inverse(size(x, 2), size(x, 2)), matrix(size(x, 2), size(x, 2))
    integer :: i, info, n, pivots(size(x, 2))

    n = size(x, 1)
    matrix(1, :) = 1.0_wp
    matrix(2:, :) = x
    inverse = 0.0_wp
    do i = 1, n + 1
      inverse(i, i) = 1.0_wp
    end do
    call dgesv(n + 1, n + 1, matrix, n + 1, pivots, inverse, n + 1, info)
    gradient = transpose(inverse(:, 2:))

  end subroutine vertex_gradients

  !> The bubble, 1 at the centroid, and its gradient.
  pure subroutine bubble_function(barycentric, gradient, bubble, bubble_gradient)
    real(wp), intent(in) :: barycentric(:)
    real(wp), intent(in) :: gradient(:, :)
    real(wp), intent(out) :: bubble
    real(wp), intent(out) :: bubble_gradient(:)

    real(wp) :: others(size(barycentric)), scale
    integer :: a, m

    m = size(barycentric)
    scale = real(m, wp)**m
    bubble = scale * product(barycentric)
    bubble_gradient = 0.0_wp
    do a = 1, m
      others = barycentric
      others(a) = 1.0_wp
      bubble_gradient = bubble_gradient + scale * product(others) * gradient(:, a)
    end do

  end subroutine bubble_function

  !> Strain of a function times the unit vector of a direction, Mandel.
  pure function strain_of(kind, direction, gradient, value, radius) result(strain)
    integer, intent(in) :: kind
    integer, intent(in) :: direction
    real(wp), intent(in) :: gradient(:)
    real(wp), intent(in) :: value
    real(wp), intent(in) :: radius
    real(wp) :: strain(6)

    real(wp) :: l(3, 3)

    l = 0.0_wp
    l(direction, :size(gradient)) = gradient
    if (kind == AXISYMMETRIC .and. direction == 1) l(3, 3) = value / radius
    strain = mandel_from_matrix(l)

  end function strain_of

  !> A stressed elastic cell turned by a quarter in equal steps (moved along the axis in axial
  !> symmetry): the stress turns with it, and nothing else happens.
  subroutine rotation_errors(kind, law, n_step, stress_error, equation_error)
    integer, intent(in) :: kind
    !> Elastic at an equivalent stress of 100, or 50 beside the tensors of its history.
    class(material_law_t), intent(in) :: law
    integer, intent(in) :: n_step
    !> Of the deviator and of the tensors of the history at the end, relative.
    real(wp), intent(out) :: stress_error
    !> Largest of the relative errors of forces, which turn too, of the volume equation and of
    !> the deviator at the end of any step.
    real(wp), intent(out) :: equation_error

    real(wp), parameter :: STRESS = 100.0_wp
    real(wp), parameter :: PRESSURE = -40.0_wp
    type(random_t) :: random
    type(assembly_t) :: assembly
    real(wp), allocatable :: forces(:, :), moved(:, :), start(:, :), turned(:), x(:, :)
    real(wp) :: angle, axis(3), expected(6), initial(6), turn(3, 3)
    integer :: i, m, n, step

    n = merge(3, 2, kind == THREE_DIMENSIONAL)
    m = n + 1
    allocate (start(n, m), moved(n, m), x(n, m), forces(n, m), turned(law%n_state))
    call random_cell(kind, random, start)
    axis = [0.0_wp, 0.0_wp, 1.0_wp]
    if (n == 3) axis = [1.0_wp, 2.0_wp, -0.5_wp]
    initial = deviator([STRESS, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
    x = start
    stress_error = 0.0_wp
    equation_error = 0.0_wp
    call assembly_create(kind, .false., law, x, reshape([(i, i=1, m)], [m, 1]), assembly)
    assembly%deviator_old(:, 1) = initial
    assembly%pressure_old = PRESSURE
    call set_tensors(law, 0.5_wp * initial, assembly%state_old(:, 1))
    forces = 0.0_wp

    ! Step 0 does not move: forces at the start
    do step = 0, n_step
      angle = 0.5_wp * acos(-1.0_wp) * step / n_step
      turn = rotation_about(axis, angle)
      if (kind == AXISYMMETRIC) then
        turn = rotation_about(axis, 0.0_wp)
        moved = start
        moved(2, :) = moved(2, :) + angle
      else
        moved = matmul(turn(:n, :n), start)
      end if
      assembly%coordinates = x
      assembly%unknowns = PRESSURE
      do i = 1, m
        assembly%unknowns(m * (i - 1) + 1:m * (i - 1) + n) = moved(:, i) - x(:, i)
      end do
      call assembly%evaluate()
      associate (batch => assembly)
        if (step == 0) forces = batch%residual(:n, :, 1)
        expected = rotated(initial, turn)
        turned = 0.0_wp
        call set_tensors(law, 0.5_wp * expected, turned)
        stress_error = max(maxval(abs(batch%deviatoric_stress(:, 1) - expected)), &
                           maxval(abs(batch%state_new(:, 1) - turned))) / STRESS
        equation_error = max(equation_error, stress_error, &
                             maxval(abs(batch%residual(:n, :, 1) - matmul(turn(:n, :n), forces))) &
                             / maxval(abs(forces)), &
                             maxval(abs(batch%residual(m, :, 1))) / batch%volume_old(1))
        batch%deviator_old(:, 1) = batch%deviatoric_stress(:, 1)
        batch%state_old = batch%state_new
        batch%log_volume_old = batch%log_volume_new
      end associate
      x = moved
    end do

  end subroutine rotation_errors

  !> An elastic cell blown up by a tenth in equal steps: the pressure is p = κ (1 - V/V0) at the end
  !> of every step, however many there are. Largest residual of the volume equation, by the volume.
  subroutine volume_error(kind, law, n_step, error)
    integer, intent(in) :: kind
    !> Elastic.
    class(material_law_t), intent(in) :: law
    integer, intent(in) :: n_step
    real(wp), intent(out) :: error

    type(random_t) :: random
    type(assembly_t) :: assembly
    real(wp), allocatable :: start(:, :)
    real(wp) :: pressure, ratio, volume
    integer :: i, m, n, step

    n = merge(3, 2, kind == THREE_DIMENSIONAL)
    m = n + 1
    allocate (start(n, m))
    call random_cell(kind, random, start)
    volume = cell_volume(kind, start)
    call assembly_create(kind, .false., law, start, reshape([(i, i=1, m)], [m, 1]), assembly)
    error = 0.0_wp
    do step = 1, n_step
      ratio = 1.0_wp + 0.1_wp * step / n_step
      pressure = -log(cell_volume(kind, ratio * start) / volume) / law%inverse_bulk_modulus
      assembly%unknowns = pressure
      do i = 1, m
        assembly%unknowns(m * (i - 1) + 1:m * (i - 1) + n) = ratio * start(:, i) &
          - assembly%coordinates(:, i)
      end do
      call assembly%evaluate()
      error = max(error, maxval(abs(assembly%residual(m, :, 1))) / volume)
      assembly%coordinates = ratio * start
      assembly%pressure_old = pressure
      assembly%deviator_old(:, 1) = assembly%deviatoric_stress(:, 1)
      assembly%log_volume_old = assembly%log_volume_new
    end do

  end subroutine volume_error

  !> Constant strain in a distorted patch: inner nodes and pressures solved for, by Newton.
  !> Relative errors of the displacement (by its largest derivative), the pressure and the
  !> deviator.
  subroutine patch_errors(kind, fixed_geometry, law, shear_modulus, displacement_error, &
                          pressure_error, stress_error)
    integer, intent(in) :: kind
    !> False: displacements of a tenth of the patch, on its own final configuration.
    logical, intent(in) :: fixed_geometry
    !> Elastic.
    class(material_law_t), intent(in) :: law
    real(wp), intent(in) :: shear_modulus
    real(wp), intent(out) :: displacement_error
    real(wp), intent(out) :: pressure_error
    real(wp), intent(out) :: stress_error

    type(random_t) :: random
    type(assembly_t) :: assembly
    real(wp), allocatable :: exact(:), matrix(:, :), right(:, :), x(:, :)
    real(wp) :: gradient(3, 3), pressure, stress(6)
    integer, allocatable :: cells(:, :), pivots(:)
    logical, allocatable :: fixed(:)
    integer :: cell, first, i, info, iteration, m, n, node, spare

    if (kind == THREE_DIMENSIONAL) then
      call box_mesh(3, x, cells)
      call jiggle(0.08_wp, random, x)
    else
      call rectangle_mesh(4, 4, x, cells)
      call jiggle(0.06_wp, random, x)
    end if
    n = size(x, 1)
    m = n + 1

    ! Columns: derivatives by x, y, z
    gradient = reshape([0.03_wp, 0.06_wp, -0.05_wp, -0.02_wp, -0.05_wp, 0.04_wp, 0.07_wp, &
                        -0.01_wp, 0.018_wp], [3, 3])
    if (kind == PLANE_STRAIN) then
      gradient(2, 2) = -0.032_wp
      gradient(3, :) = 0.0_wp
      gradient(:, 3) = 0.0_wp
    else if (kind == AXISYMMETRIC) then
      gradient = 0.0_wp
      gradient(1, 1) = 0.03_wp
      gradient(2, 2) = -0.058_wp
      gradient(3, 3) = 0.03_wp
    end if
    call homogeneous(fixed_geometry, gradient, shear_modulus, law%inverse_bulk_modulus, &
                     pressure, stress)

    call assembly_create(kind, fixed_geometry, law, x, cells, assembly)
    allocate (exact(assembly%n_unknown), right(assembly%n_unknown, 1))
    allocate (fixed(assembly%n_unknown), source=.false.)
    allocate (pivots(assembly%n_unknown))
    do node = 1, size(x, 2)
      first = m * (node - 1)
      exact(first + 1:first + n) = matmul(gradient(:n, :n), x(:, node))
      exact(first + m) = pressure
      fixed(first + 1:first + n) = on_boundary(x(:, node))
    end do

    where (fixed) assembly%unknowns = exact
    spare = 0
    do iteration = 1, 20
      call assembly%evaluate()
      call assembly%get_dense(matrix)
      right(:, 1) = -assembly%get_residual()
      do i = 1, assembly%n_unknown
        if (.not. fixed(i)) cycle
        matrix(i, :) = 0.0_wp
        ! The column too: a pivot in it would let round-off move the boundary
        matrix(:, i) = 0.0_wp
        matrix(i, i) = 1.0_wp
        right(i, 1) = 0.0_wp
      end do
      call dgesv(assembly%n_unknown, 1, matrix, assembly%n_unknown, pivots, right, &
                 assembly%n_unknown, info)
      assembly%unknowns = assembly%unknowns + right(:, 1)
      ! Two more iterations once the change is small reach round-off
      if (maxval(abs(right(:, 1)) / max(1.0_wp, abs(pressure))) < 1.0e-8_wp) spare = spare + 1
      if (spare > 2) exit
    end do
    call assembly%evaluate()

    displacement_error = 0.0_wp
    pressure_error = 0.0_wp
    do i = 1, assembly%n_unknown
      if (mod(i, m) == 0) then
        pressure_error = max(pressure_error, &
                             abs(assembly%unknowns(i) - exact(i)) / abs(pressure))
      else
        displacement_error = max(displacement_error, abs(assembly%unknowns(i) - exact(i)))
      end if
    end do
    displacement_error = displacement_error / maxval(abs(gradient))
    stress_error = 0.0_wp
    do cell = 1, assembly%n_cell
      stress_error = max(stress_error, maxval(abs(assembly%deviatoric_stress(:, cell) &
                                                  - stress)) / maxval(abs(stress)))
    end do

  end subroutine patch_errors

  !> Pressure and deviator of one elastic step of constant displacement gradient, as the
  !> incremental law defines it: strain and spin of the middle, the strain turned by the square
  !> root of the Cayley rotation.
  subroutine homogeneous(fixed_geometry, gradient, shear_modulus, inverse_bulk_modulus, &
                         pressure, stress)
    logical, intent(in) :: fixed_geometry
    real(wp), intent(in) :: gradient(3, 3)
    real(wp), intent(in) :: shear_modulus
    real(wp), intent(in) :: inverse_bulk_modulus
    real(wp), intent(out) :: pressure
    real(wp), intent(out) :: stress(6)

    real(wp) :: axis(3), jacobian, left(3, 3), middle(3, 3), spin(3, 3), strain(3, 3), &
      transposed(3, 3), turned(6)
    integer :: i, info, pivots(3)

    if (fixed_geometry) then
      stress = 2.0_wp * shear_modulus * deviator(mandel_from_matrix(gradient))
      pressure = -(gradient(1, 1) + gradient(2, 2) + gradient(3, 3)) / inverse_bulk_modulus
      return
    end if

    ! L (I + A/2) = A, solved transposed
    left = 0.5_wp * transpose(gradient)
    do i = 1, 3
      left(i, i) = left(i, i) + 1.0_wp
    end do
    transposed = transpose(gradient)
    call dgesv(3, 3, left, 3, pivots, transposed, 3, info)
    middle = transpose(transposed)
    strain = 0.5_wp * (middle + transpose(middle))
    spin = 0.5_wp * (middle - transpose(middle))
    turned = mandel_from_matrix(strain)
    axis = [spin(3, 2), spin(1, 3), spin(2, 1)]
    ! Cayley: the spin vector w turns by 2 atan(|w|/2); its root by half of that
    if (norm2(axis) > 0.0_wp) then
      turned = rotated(turned, rotation_about(axis, atan(0.5_wp * norm2(axis))))
    end if
    stress = 2.0_wp * shear_modulus * deviator(turned)

    left = gradient
    do i = 1, 3
      left(i, i) = left(i, i) + 1.0_wp
    end do
    jacobian = left(1, 1) * (left(2, 2) * left(3, 3) - left(2, 3) * left(3, 2)) &
      - left(1, 2) * (left(2, 1) * left(3, 3) - left(2, 3) * left(3, 1)) &
      + left(1, 3) * (left(2, 1) * left(3, 2) - left(2, 2) * left(3, 1))
    pressure = -log(jacobian) / inverse_bulk_modulus

  end subroutine homogeneous

end module swage_test_element_checks
