!> A small problem of one material on a mesh in memory: cells evaluated batch by batch, the matrix
!> dense or banded. Independent of the solver's own assembly, on purpose.
module swage_test_assembly
  use swage_kinds, only: wp
  use swage_mandel, only: SQRT2
  use swage_material_law, only: material_law_t
  use swage_mini_element, only: mini_batch_create, mini_batch_t
  use swage_point_batch, only: LANES, point_batch_create, point_batch_t
  use swage_state_table, only: rotate_state
  implicit none(type, external)
  private

  public :: assembly_t, assembly_create

  !> Unknown of a node's component: (n_dim + 1) (node - 1) + component, the pressure last.
  type :: assembly_t
    integer :: n_unknown = 0
    integer :: n_cell = 0
    integer :: n_dim = 3
    !> Shape (n_dim + 1, cell).
    integer, allocatable :: cells(:, :)
    !> [length]; shape (n_dim, node).
    real(wp), allocatable :: coordinates(:, :)
    !> Displacement increment and pressure at the end of the step, one after the other for each
    !> node.
    real(wp), allocatable :: unknowns(:)
    class(material_law_t), allocatable :: law

    ! State at the start of the step; see mini_batch_t

    real(wp) :: bubble_factor = 1.0_wp
    !> Shape (6, cell).
    real(wp), allocatable :: deviator_old(:, :)
    !> Shape (n_state, cell).
    real(wp), allocatable :: state_old(:, :)
    !> Shape (n_dim + 1, cell).
    real(wp), allocatable :: pressure_old(:, :)
    !> Shape (cell).
    real(wp), allocatable :: log_volume_old(:), grad_div_modulus(:), relaxation(:)
    real(wp), allocatable :: bubble_modulus(:)

    ! Results

    !> Points where the law failed at the last evaluation, and inverted cells.
    integer :: n_failed = 0
    integer :: n_inverted = 0
    !> Shape (cell).
    real(wp), allocatable :: volume_old(:), log_volume_new(:), hoop_old(:)
    !> Shape (6, cell).
    real(wp), allocatable :: deviatoric_stress(:, :)
    !> Shape (n_state, cell).
    real(wp), allocatable :: state_new(:, :)
    !> Shape (n_dim, n_dim + 1, cell).
    real(wp), allocatable :: gradient_old(:, :, :), bubble_pressure(:, :, :)
    !> Shapes (n_dim, n_dim, cell), (6, n_dim, cell).
    real(wp), allocatable :: bubble_compliance(:, :, :), bubble_strain(:, :, :)
    !> Shape (n_dim + 1, n_dim + 1, cell), the equation first.
    real(wp), allocatable :: residual(:, :, :)
    !> Shape (n, n, cell) with n unknowns, vertex by vertex.
    real(wp), allocatable :: tangent(:, :, :)
    type(mini_batch_t), allocatable, private :: batch
    type(point_batch_t), private :: points
  contains
    !> Kinematics, law, residual and tangent of every cell, from rest.
    procedure :: evaluate => assembly_evaluate
    !> Sum of the cells' residuals.
    procedure :: get_residual => assembly_get_residual
    !> Sum of the cells' tangents as a dense matrix.
    procedure :: get_dense => assembly_get_dense
    !> The same in LAPACK's banded form, with room for the factors.
    procedure :: get_banded => assembly_get_banded
    !> Unknowns of a cell.
    procedure :: get_place => assembly_get_place
  end type assembly_t

contains

  subroutine assembly_create(kind, fixed_geometry, law, coordinates, cells, assembly)
    integer, intent(in) :: kind
    logical, intent(in) :: fixed_geometry
    class(material_law_t), intent(in) :: law
    real(wp), intent(in) :: coordinates(:, :)
    integer, intent(in) :: cells(:, :)
    type(assembly_t), intent(out) :: assembly

    integer :: m, n, n_cell

    n_cell = size(cells, 2)
    n = size(coordinates, 1)
    m = n + 1
    assembly%n_cell = n_cell
    assembly%n_dim = n
    assembly%cells = cells
    assembly%coordinates = coordinates
    assembly%n_unknown = m * size(coordinates, 2)
    allocate (assembly%unknowns(assembly%n_unknown), source=0.0_wp)
    allocate (assembly%law, source=law)
    allocate (assembly%batch)
    call mini_batch_create(kind, fixed_geometry, assembly%batch)
    call point_batch_create(LANES, law%n_state, assembly%points)
    assembly%batch%inverse_bulk_modulus = law%inverse_bulk_modulus

    allocate (assembly%bubble_modulus(n_cell), source=law%reference_modulus)
    allocate (assembly%relaxation(n_cell), source=law%initial_relaxation)
    allocate (assembly%log_volume_old(n_cell), assembly%log_volume_new(n_cell), &
              assembly%grad_div_modulus(n_cell), assembly%volume_old(n_cell), &
              assembly%hoop_old(n_cell), source=0.0_wp)
    allocate (assembly%deviator_old(6, n_cell), assembly%deviatoric_stress(6, n_cell), &
              assembly%state_old(law%n_state, n_cell), assembly%state_new(law%n_state, n_cell), &
              assembly%pressure_old(m, n_cell), source=0.0_wp)
    allocate (assembly%gradient_old(n, m, n_cell), assembly%bubble_pressure(n, m, n_cell), &
              assembly%bubble_compliance(n, n, n_cell), assembly%bubble_strain(6, n, n_cell), &
              assembly%residual(m, m, n_cell), assembly%tangent(m * m, m * m, n_cell), &
              source=0.0_wp)

  end subroutine assembly_create

  subroutine assembly_evaluate(self)
    class(assembly_t), intent(inout) :: self

    integer :: cell, i, n, n_failed, start

    self%n_failed = 0
    self%n_inverted = 0
    do start = 1, self%n_cell, LANES
      n = min(LANES, self%n_cell - start + 1)
      self%batch%n_cell = n
      self%batch%bubble_factor = self%bubble_factor
      call self%points%start(n)
      do i = 1, n
        cell = start + i - 1
        call gather(self, i, cell)
      end do
      call self%batch%start(self%points)
      if (self%batch%inverted > 0) then
        self%n_inverted = self%n_inverted + 1
        cycle
      end if
      if (.not. self%batch%fixed_geometry) then
        call rotate_state(self%law%state_table, self%points%rotation_increment, &
                          self%points%state_old)
      end if
      call self%law%update(self%points, n_failed)
      self%n_failed = self%n_failed + n_failed
      call self%batch%finish(self%points, .true.)
      do i = 1, n
        cell = start + i - 1
        call keep(self, i, cell)
      end do
    end do

  end subroutine assembly_evaluate

  !> Put a cell in place `i` of the batch.
  subroutine gather(self, i, cell)
    class(assembly_t), intent(inout) :: self
    integer, intent(in) :: i
    integer, intent(in) :: cell

    integer :: first, m, n, vertex

    n = self%n_dim
    m = n + 1
    associate (batch => self%batch)
      do vertex = 1, m
        first = m * (self%cells(vertex, cell) - 1)
        batch%coordinates(i, :n, vertex) = self%coordinates(:, self%cells(vertex, cell))
        batch%displacement(i, :n, vertex) = self%unknowns(first + 1:first + n)
        batch%pressure_new(i, vertex) = self%unknowns(first + m)
      end do
      batch%pressure_old(i, :m) = self%pressure_old(:, cell)
      batch%deviator_old(i, :) = self%deviator_old(:, cell)
      batch%log_volume_old(i) = self%log_volume_old(cell)
      batch%grad_div_modulus(i) = self%grad_div_modulus(cell)
      batch%relaxation(i) = self%relaxation(cell)
      batch%bubble_modulus(i) = self%bubble_modulus(cell)
      self%points%state_old(i, :) = self%state_old(:, cell)
    end associate

  end subroutine gather

  !> Take the results of a cell from place `i` of the batch.
  subroutine keep(self, i, cell)
    class(assembly_t), intent(inout) :: self
    integer, intent(in) :: i
    integer, intent(in) :: cell

    integer :: a, b, m, n

    n = self%n_dim
    m = n + 1
    associate (batch => self%batch)
      self%volume_old(cell) = batch%volume_old(i)
      self%log_volume_new(cell) = batch%log_volume_new(i)
      self%hoop_old(cell) = batch%hoop_old(i)
      self%deviatoric_stress(:, cell) = self%points%deviatoric_stress(i, :)
      self%state_new(:, cell) = self%points%state_new(i, :)
      self%gradient_old(:, :, cell) = batch%gradient_old(i, :n, :m)
      self%bubble_pressure(:, :, cell) = batch%bubble_pressure(i, :n, :m)
      self%bubble_compliance(:, :, cell) = batch%bubble_compliance(i, :n, :n)
      self%bubble_strain(:, :, cell) = 0.0_wp
      self%bubble_strain(1, 1, cell) = -batch%bubble_moment(i)
      self%bubble_strain(3, 1, cell) = batch%bubble_moment(i)
      self%bubble_strain(6, 2, cell) = -batch%bubble_moment(i) / SQRT2
      self%residual(:, :, cell) = batch%residual(i, :m, :m)
      do b = 1, m
        do a = 1, m
          self%tangent(m * (a - 1) + 1:m * a, m * (b - 1) + 1:m * b, cell) &
            = batch%tangent(:m, i, :m, a, b)
        end do
      end do
    end associate

  end subroutine keep

  pure function assembly_get_place(self, cell) result(place)
    class(assembly_t), intent(in) :: self
    integer, intent(in) :: cell
    integer :: place((self%n_dim + 1)**2)

    integer :: k, m, vertex

    m = self%n_dim + 1
    do vertex = 1, m
      do k = 1, m
        place(m * (vertex - 1) + k) = m * (self%cells(vertex, cell) - 1) + k
      end do
    end do

  end function assembly_get_place

  pure function assembly_get_residual(self) result(residual)
    class(assembly_t), intent(in) :: self
    real(wp) :: residual(self%n_unknown)

    integer :: cell, first, m, vertex

    m = self%n_dim + 1
    residual = 0.0_wp
    do cell = 1, self%n_cell
      do vertex = 1, m
        first = m * (self%cells(vertex, cell) - 1)
        residual(first + 1:first + m) = residual(first + 1:first + m) &
          + self%residual(:, vertex, cell)
      end do
    end do

  end function assembly_get_residual

  pure subroutine assembly_get_dense(self, matrix)
    class(assembly_t), intent(in) :: self
    !> Shape (n_unknown, n_unknown).
    real(wp), allocatable, intent(out) :: matrix(:, :)

    integer :: cell, i, j, place((self%n_dim + 1)**2)

    allocate (matrix(self%n_unknown, self%n_unknown), source=0.0_wp)
    do cell = 1, self%n_cell
      place = self%get_place(cell)
      do j = 1, size(place)
        do i = 1, size(place)
          matrix(place(i), place(j)) = matrix(place(i), place(j)) &
            + self%tangent(i, j, cell)
        end do
      end do
    end do

  end subroutine assembly_get_dense

  !> Fixed unknowns become identity rows and columns.
  pure subroutine assembly_get_banded(self, fixed, width, matrix)
    class(assembly_t), intent(in) :: self
    logical, intent(in) :: fixed(:)
    !> Diagonals on either side of the main one.
    integer, intent(out) :: width
    !> Shape (3 width + 1, n_unknown).
    real(wp), allocatable, intent(out) :: matrix(:, :)

    integer :: cell, i, j, place((self%n_dim + 1)**2), row

    width = 0
    do cell = 1, self%n_cell
      place = self%get_place(cell)
      width = max(width, maxval(place) - minval(place))
    end do
    allocate (matrix(3 * width + 1, self%n_unknown), source=0.0_wp)
    do cell = 1, self%n_cell
      place = self%get_place(cell)
      do j = 1, size(place)
        if (fixed(place(j))) cycle
        do i = 1, size(place)
          if (fixed(place(i))) cycle
          row = 2 * width + 1 + place(i) - place(j)
          matrix(row, place(j)) = matrix(row, place(j)) + self%tangent(i, j, cell)
        end do
      end do
    end do
    do i = 1, self%n_unknown
      if (fixed(i)) matrix(2 * width + 1, i) = 1.0_wp
    end do

  end subroutine assembly_get_banded

end module swage_test_assembly
