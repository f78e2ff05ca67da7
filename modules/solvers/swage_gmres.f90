!> Solution of a linear system by GMRES, restarted, with a preconditioner on the right.
!>
!> The preconditioner may change from one iteration to the next by its own rounding, as that of a
!> factor in single precision does: the preconditioned directions are kept (flexible GMRES: Saad,
!> 1993). Orthogonalisation is classical Gram-Schmidt, repeated where digits cancel: one sum over
!> the ranks for all products of an iteration.
module swage_gmres
  use swage_kinds, only: wp
  use swage_status, only: status_t
  implicit none(type, external)
  private

  public :: gmres_t, gmres_system_t, gmres_report_t

  !> Directions after which the iterations start again from the present solution.
  integer, parameter :: RESTART = 50
  !> Orthogonalise again when a vector has lost this share of its length: digits then cancel.
  real(wp), parameter :: CANCELLED = 0.7_wp
  !> What is left of a vector below this share is rounding: the solution lies in the space at hand.
  real(wp), parameter :: NOTHING = 1.0e-13_wp
  !> A cycle that leaves more than this share of the residual has come to an end.
  real(wp), parameter :: NO_PROGRESS = 0.99_wp

  !> A system: its product, its preconditioner, and sums over all ranks. Vectors hold what this
  !> rank owns.
  type, abstract :: gmres_system_t
  contains
    !> Collective. y = A x
    procedure(multiply_vector), deferred :: multiply
    !> Collective. y about A^-1 x
    procedure(precondition_vector), deferred :: precondition
    !> Collective. Sum over the ranks, in place.
    procedure(sum_numbers), deferred :: sum
  end type gmres_system_t

  abstract interface
    subroutine multiply_vector(self, x, y)
      import :: gmres_system_t, wp
      implicit none(type, external)
      class(gmres_system_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:)
      real(wp), contiguous, intent(out) :: y(:)
    end subroutine multiply_vector

    subroutine precondition_vector(self, x, y, status)
      import :: gmres_system_t, status_t, wp
      implicit none(type, external)
      class(gmres_system_t), intent(inout) :: self
      real(wp), contiguous, intent(in) :: x(:)
      real(wp), contiguous, intent(out) :: y(:)
      !> The same on all ranks.
      type(status_t), intent(inout) :: status
    end subroutine precondition_vector

    subroutine sum_numbers(self, values)
      import :: gmres_system_t, wp
      implicit none(type, external)
      class(gmres_system_t), intent(in) :: self
      real(wp), contiguous, intent(inout) :: values(:)
    end subroutine sum_numbers
  end interface

  !> What happened.
  type :: gmres_report_t
    integer :: n_iteration = 0
    !> Norm of the residual by that of the right-hand side [1].
    real(wp) :: residual = 1.0_wp
    logical :: has_converged = .false.
  end type gmres_report_t

  !> The iterations, with their room, which is kept from one solution to the next.
  type :: gmres_t
    private
    !> Orthonormal basis, and directions that give it; shapes (n, RESTART + 1), (n, RESTART).
    real(wp), allocatable :: basis(:, :), direction(:, :)
  contains
    !> Collective. Improve a solution.
    procedure, public :: solve => gmres_solve
  end type gmres_t

contains

  subroutine gmres_solve(self, system, right_hand_side, tolerance, most_iterations, starts_from, &
                         solution, report, status)
    class(gmres_t), intent(inout) :: self
    class(gmres_system_t), intent(inout) :: system
    !> Shape (n).
    real(wp), contiguous, intent(in) :: right_hand_side(:)
    !> Norm of the residual by that of the right-hand side at which to stop [1].
    real(wp), intent(in) :: tolerance
    integer, intent(in) :: most_iterations
    !> Whether `solution` is something to start from; from zero otherwise.
    logical, intent(in) :: starts_from
    !> Shape (n).
    real(wp), contiguous, intent(inout) :: solution(:)
    type(gmres_report_t), intent(out) :: report
    !> Of the preconditioner; lack of convergence is told by `report` alone.
    type(status_t), intent(inout) :: status

    real(wp), allocatable :: residual(:)
    real(wp) :: before, norm, size_of_rhs
    logical :: is_complete

    allocate (residual, source=right_hand_side)
    size_of_rhs = norm_of(system, right_hand_side)
    if (.not. size_of_rhs > 0.0_wp) then
      solution = 0.0_wp
      report%residual = 0.0_wp
      report%has_converged = .true.
      return
    end if
    norm = size_of_rhs
    if (starts_from) then
      call find_residual(system, right_hand_side, solution, residual)
      norm = norm_of(system, residual)
    else
      solution = 0.0_wp
    end if
    call make_room(self, size(solution))

    is_complete = .false.
    do
      report%residual = norm / size_of_rhs
      report%has_converged = report%residual <= tolerance
      if (report%has_converged .or. is_complete .or. report%n_iteration >= most_iterations) return
      before = norm
      call run_cycle(self, system, residual, tolerance * size_of_rhs, &
                     min(RESTART, most_iterations - report%n_iteration), norm, is_complete, &
                     solution, report, status)
      if (status%failed()) return
      if (norm <= tolerance * size_of_rhs .and. .not. is_complete) cycle
      call find_residual(system, right_hand_side, solution, residual)
      norm = norm_of(system, residual)
      ! With something gained another cycle may gain more
      is_complete = is_complete .and. norm > NO_PROGRESS * before
    end do

  end subroutine gmres_solve

  !> Room for the vectors, once. Pages that are never written take no memory.
  subroutine make_room(self, n)
    type(gmres_t), intent(inout) :: self
    integer, intent(in) :: n

    if (allocated(self%basis)) then
      if (size(self%basis, 1) == n) return
      deallocate (self%basis, self%direction)
    end if
    allocate (self%basis(n, RESTART + 1), self%direction(n, RESTART))

  end subroutine make_room

  function norm_of(system, vector) result(norm)
    class(gmres_system_t), intent(in) :: system
    real(wp), intent(in) :: vector(:)
    real(wp) :: norm

    real(wp) :: square(1)

    square(1) = dot_product(vector, vector)
    call system%sum(square)
    norm = sqrt(square(1))

  end function norm_of

  !> b - A x
  subroutine find_residual(system, right_hand_side, solution, residual)
    class(gmres_system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: right_hand_side(:)
    real(wp), contiguous, intent(in) :: solution(:)
    real(wp), contiguous, intent(out) :: residual(:)

    call system%multiply(solution, residual)
    residual = right_hand_side - residual

  end subroutine find_residual

  !> Iterate without restart, and add the best combination of the directions to the solution.
  subroutine run_cycle(self, system, residual, wanted, most_iterations, norm, is_complete, &
                       solution, report, status)
    type(gmres_t), intent(inout) :: self
    class(gmres_system_t), intent(inout) :: system
    real(wp), contiguous, intent(in) :: residual(:)
    !> Norm of the residual at which to stop.
    real(wp), intent(in) :: wanted
    integer, intent(in) :: most_iterations
    !> In: norm of the residual, above 0; out: of what is left, as the recurrence has it.
    real(wp), intent(inout) :: norm
    !> True when no further direction was found; `norm` means nothing then.
    logical, intent(out) :: is_complete
    real(wp), contiguous, intent(inout) :: solution(:)
    !> Its iterations are counted here.
    type(gmres_report_t), intent(inout) :: report
    type(status_t), intent(inout) :: status

    ! Column j of the triangle, after the plane rotations (cosine, sine) that make it one
    real(wp) :: triangle(RESTART + 1, RESTART), cosine(RESTART), sine(RESTART), right(RESTART + 1)
    real(wp) :: length, rotated, whole
    integer :: i, j, n

    is_complete = .false.
    right = 0.0_wp
    right(1) = norm
    self%basis(:, 1) = residual / norm
    n = 0
    do j = 1, most_iterations
      call system%precondition(self%basis(:, j), self%direction(:, j), status)
      if (status%failed()) return
      call system%multiply(self%direction(:, j), self%basis(:, j + 1))
      call orthogonalise(self, system, j, triangle(:, j), is_complete)
      report%n_iteration = report%n_iteration + 1
      whole = norm2(triangle(:, j))
      do i = 1, j - 1
        rotated = cosine(i) * triangle(i, j) + sine(i) * triangle(i + 1, j)
        triangle(i + 1, j) = -sine(i) * triangle(i, j) + cosine(i) * triangle(i + 1, j)
        triangle(i, j) = rotated
      end do
      length = hypot(triangle(j, j), triangle(j + 1, j))
      if (.not. length > NOTHING * whole) then
        ! The direction adds nothing to those before it
        is_complete = .true.
        exit
      end if
      n = j
      cosine(j) = triangle(j, j) / length
      sine(j) = triangle(j + 1, j) / length
      triangle(j, j) = length
      right(j + 1) = -sine(j) * right(j)
      right(j) = cosine(j) * right(j)
      norm = abs(right(j + 1))
      if (norm <= wanted .or. is_complete) exit
    end do

    do i = n, 1, -1
      right(i) = (right(i) - dot_product(triangle(i, i + 1:n), right(i + 1:n))) / triangle(i, i)
      solution = solution + right(i) * self%direction(:, i)
    end do

  end subroutine run_cycle

  !> Make the newest vector of the basis orthogonal to those before it, and of length 1.
  subroutine orthogonalise(self, system, n, column, is_complete)
    type(gmres_t), intent(inout) :: self
    class(gmres_system_t), intent(inout) :: system
    !> Vectors before it.
    integer, intent(in) :: n
    !> Its components along them, and its length; shape (n + 1) or longer.
    real(wp), intent(out) :: column(:)
    !> True when nothing is left.
    logical, intent(out) :: is_complete

    real(wp) :: first, products(n + 1), square
    integer :: i, pass

    column = 0.0_wp
    first = 0.0_wp
    associate (new => self%basis(:, n + 1))
      do pass = 1, 3
        do i = 1, n + 1
          products(i) = dot_product(self%basis(:, i), new)
        end do
        call system%sum(products)
        if (pass == 1) first = products(n + 1)
        do i = 1, n
          new = new - products(i) * self%basis(:, i)
          column(i) = column(i) + products(i)
        end do
        ! By Pythagoras, which is accurate unless most of the vector is gone
        square = products(n + 1) - sum(products(:n)**2)
        if (square > CANCELLED**2 * products(n + 1)) exit
      end do
      is_complete = .not. square > NOTHING**2 * first
      if (is_complete) then
        new = 0.0_wp
      else
        column(n + 1) = sqrt(square)
        new = new / column(n + 1)
      end if
    end associate

  end subroutine orthogonalise

end module swage_gmres
