!> A small problem of one material on a mesh in memory: cells evaluated in one batch, the matrix
!> dense or banded. Independent of the solver's own assembly, on purpose.
module swage_test_assembly
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t
  use swage_mini_element, only: mini_batch_create, mini_batch_t
  use swage_point_batch, only: point_batch_create, point_batch_t
  implicit none(type, external)
  private

  public :: assembly_t, assembly_create

  !> Unknown of a node's component: (n_dim + 1) (node - 1) + component, the pressure last.
  type :: assembly_t
    integer :: n_unknown = 0
    !> Shape (n_dim + 1, cell).
    integer, allocatable :: cells(:, :)
    !> [length]; shape (n_dim, node).
    real(wp), allocatable :: coordinates(:, :)
    !> Displacement increment and pressure at the end of the step, one after the other for each
    !> node.
    real(wp), allocatable :: unknowns(:)
    class(material_law_t), allocatable :: law
    type(mini_batch_t) :: batch
    type(point_batch_t) :: points
    !> Points where the law failed at the last evaluation.
    integer :: n_failed = 0
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

    integer :: n_cell

    n_cell = size(cells, 2)
    assembly%cells = cells
    assembly%coordinates = coordinates
    assembly%n_unknown = (size(coordinates, 1) + 1) * size(coordinates, 2)
    allocate (assembly%unknowns(assembly%n_unknown), source=0.0_wp)
    allocate (assembly%law, source=law)
    call mini_batch_create(kind, fixed_geometry, n_cell, assembly%batch)
    call point_batch_create(n_cell, law%n_state, assembly%points)
    assembly%batch%n_cell = n_cell
    assembly%batch%inverse_bulk_modulus = law%inverse_bulk_modulus
    assembly%batch%bubble_modulus = law%reference_modulus
    assembly%batch%relaxation = law%initial_relaxation

  end subroutine assembly_create

  subroutine assembly_evaluate(self)
    class(assembly_t), intent(inout) :: self

    integer :: cell, first, m, n, vertex

    n = self%batch%n_dim
    m = n + 1
    do cell = 1, self%batch%n_cell
      do vertex = 1, m
        first = m * (self%cells(vertex, cell) - 1)
        self%batch%coordinates(:, vertex, cell) = self%coordinates(:, self%cells(vertex, cell))
        self%batch%displacement(:, vertex, cell) = self%unknowns(first + 1:first + n)
        self%batch%pressure_new(vertex, cell) = self%unknowns(first + m)
      end do
    end do
    call self%points%start(self%batch%n_cell)
    call self%batch%start(self%points)
    call self%law%update(self%points, self%n_failed)
    call self%batch%finish(self%points, .true.)

  end subroutine assembly_evaluate

  pure function assembly_get_place(self, cell) result(place)
    class(assembly_t), intent(in) :: self
    integer, intent(in) :: cell
    integer :: place((self%batch%n_dim + 1)**2)

    integer :: k, m, vertex

    m = self%batch%n_dim + 1
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

    m = self%batch%n_dim + 1
    residual = 0.0_wp
    do cell = 1, self%batch%n_cell
      do vertex = 1, m
        first = m * (self%cells(vertex, cell) - 1)
        residual(first + 1:first + m) = residual(first + 1:first + m) &
          + self%batch%residual(:, vertex, cell)
      end do
    end do

  end function assembly_get_residual

  pure subroutine assembly_get_dense(self, matrix)
    class(assembly_t), intent(in) :: self
    !> Shape (n_unknown, n_unknown).
    real(wp), allocatable, intent(out) :: matrix(:, :)

    integer :: cell, i, j, place((self%batch%n_dim + 1)**2)

    allocate (matrix(self%n_unknown, self%n_unknown), source=0.0_wp)
    do cell = 1, self%batch%n_cell
      place = self%get_place(cell)
      do j = 1, size(place)
        do i = 1, size(place)
          matrix(place(i), place(j)) = matrix(place(i), place(j)) &
            + self%batch%tangent(i, j, cell)
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

    integer :: cell, i, j, place((self%batch%n_dim + 1)**2), row

    width = 0
    do cell = 1, self%batch%n_cell
      place = self%get_place(cell)
      width = max(width, maxval(place) - minval(place))
    end do
    allocate (matrix(3 * width + 1, self%n_unknown), source=0.0_wp)
    do cell = 1, self%batch%n_cell
      place = self%get_place(cell)
      do j = 1, size(place)
        if (fixed(place(j))) cycle
        do i = 1, size(place)
          if (fixed(place(i))) cycle
          row = 2 * width + 1 + place(i) - place(j)
          matrix(row, place(j)) = matrix(row, place(j)) + self%batch%tangent(i, j, cell)
        end do
      end do
    end do
    do i = 1, self%n_unknown
      if (fixed(i)) matrix(2 * width + 1, i) = 1.0_wp
    end do

  end subroutine assembly_get_banded

end module swage_test_assembly
