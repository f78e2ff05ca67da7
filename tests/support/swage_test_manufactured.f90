!> Smooth incompressible flows with known forces on the unit square or cube, zero on its boundary
!> (free along the axis in axial symmetry), and the errors of the element on them.
module swage_test_manufactured
  use swage_kinds, only: wp
  use swage_mandel, only: mandel_from_matrix
  use swage_material_law, only: material_law_t
  use swage_cell_geometry, only: AXISYMMETRIC, PLANE_STRAIN, THREE_DIMENSIONAL
  use swage_test_assembly, only: assembly_create, assembly_t
  use swage_test_lapack, only: dgbsv
  use swage_test_meshes, only: box_mesh, on_boundary, rectangle_mesh
  use swage_test_quadrature, only: simplex_rule
  implicit none(type, external)
  private

  public :: flow_errors, free_component

  real(wp), parameter :: PI = acos(-1.0_wp)

  !> A flow at a point.
  type :: flow_t
    real(wp) :: displacement(3) = 0.0_wp
    !> Of component i by direction j.
    real(wp) :: gradient(3, 3) = 0.0_wp
    real(wp) :: pressure = 0.0_wp
    !> Body force for a shear modulus of 1.
    real(wp) :: force(3) = 0.0_wp
  end type flow_t

contains

  !> Whether a component of the displacement is not prescribed at a node.
  pure function free_component(kind, component, x) result(free)
    integer, intent(in) :: kind
    integer, intent(in) :: component
    real(wp), intent(in) :: x(:)
    logical :: free

    free = .not. on_boundary(x)
    if (kind == AXISYMMETRIC .and. component == 2) then
      free = .not. on_boundary(x(2:2)) .and. x(1) < 1.0_wp - 1.0e-9_wp
    end if

  end function free_component

  !> Solve one linear step on n divisions a side; errors of the linear part of the displacement and
  !> of the pressure less its mean.
  subroutine flow_errors(kind, n, law, displacement_error, gradient_error, pressure_error)
    integer, intent(in) :: kind
    integer, intent(in) :: n
    !> Elastic, incompressible, of shear modulus 1.
    class(material_law_t), intent(in) :: law
    !> In the norms L2, H1 (of the gradient alone) and L2.
    real(wp), intent(out) :: displacement_error
    real(wp), intent(out) :: gradient_error
    real(wp), intent(out) :: pressure_error

    type(assembly_t) :: assembly
    real(wp), allocatable :: matrix(:, :), right(:, :), x(:, :)
    integer, allocatable :: cells(:, :), pivots(:)
    logical, allocatable :: fixed(:)
    integer :: component, info, m, node, width

    if (kind == THREE_DIMENSIONAL) then
      call box_mesh(n, x, cells)
    else
      call rectangle_mesh(n, n, x, cells)
    end if
    m = size(x, 1) + 1
    call assembly_create(kind, .true., law, x, cells, assembly)
    allocate (fixed(assembly%n_unknown), source=.false.)
    do node = 1, size(x, 2)
      do component = 1, m - 1
        fixed(m * (node - 1) + component) = .not. free_component(kind, component, x(:, node))
      end do
    end do
    ! The pressure is known but for a constant
    fixed(m) = .true.

    call assembly%evaluate()
    call assembly%get_banded(fixed, width, matrix)
    allocate (right(assembly%n_unknown, 1), source=0.0_wp)
    call add_forces(kind, assembly, right(:, 1))
    where (fixed) right(:, 1) = 0.0_wp
    allocate (pivots(assembly%n_unknown))
    call dgbsv(assembly%n_unknown, width, width, 1, matrix, 3 * width + 1, pivots, right, &
               assembly%n_unknown, info)
    assembly%unknowns = right(:, 1)
    call measure(kind, assembly, displacement_error, gradient_error, pressure_error)

  end subroutine flow_errors

  !> Body forces on the linear functions, and on the bubble, which is then eliminated.
  subroutine add_forces(kind, assembly, right)
    integer, intent(in) :: kind
    type(assembly_t), intent(in) :: assembly
    real(wp), intent(inout) :: right(:)

    type(flow_t) :: flow
    real(wp), allocatable :: barycentric(:, :), weight(:)
    real(wp) :: bubble_force(3), l(3, 3), moved(3), scale
    integer, allocatable :: place(:)
    integer :: a, cell, j, m, n, point

    n = assembly%n_dim
    m = n + 1
    call simplex_rule(n, 6, barycentric, weight)
    allocate (place(m * m))
    associate (batch => assembly)
      do cell = 1, batch%n_cell
        place = assembly%get_place(cell)
        bubble_force = 0.0_wp
        do point = 1, size(weight)
          call cell_point(kind, assembly, cell, barycentric(:, point), flow, scale)
          do a = 1, m
            right(place(m * (a - 1) + 1:m * a - 1)) = right(place(m * (a - 1) + 1:m * a - 1)) &
              + weight(point) * scale * barycentric(a, point) * flow%force(:n)
          end do
          bubble_force = bubble_force + weight(point) * scale * real(m, wp)**m &
            * product(barycentric(:, point)) * flow%force
        end do

        moved(:n) = matmul(batch%bubble_compliance(:, :, cell), bubble_force(:n))
        do a = 1, m
          right(place(m * a)) = right(place(m * a)) &
            - dot_product(batch%bubble_pressure(:, a, cell), moved(:n))
          do j = 1, n
            l = 0.0_wp
            l(j, :n) = batch%gradient_old(:, a, cell)
            if (j == 1) l(3, 3) = l(3, 3) + batch%hoop_old(cell)
            right(place(m * (a - 1) + j)) = right(place(m * (a - 1) + j)) &
              - batch%bubble_modulus(cell) * dot_product(mandel_from_matrix(l), &
                                                         matmul(batch%bubble_strain(:, :, cell), &
                                                                moved(:n)))
          end do
        end do
      end do
    end associate

  end subroutine add_forces

  subroutine measure(kind, assembly, displacement_error, gradient_error, pressure_error)
    integer, intent(in) :: kind
    type(assembly_t), intent(in) :: assembly
    real(wp), intent(out) :: displacement_error
    real(wp), intent(out) :: gradient_error
    real(wp), intent(out) :: pressure_error

    type(flow_t) :: flow
    real(wp), allocatable :: barycentric(:, :), unknowns(:, :), weight(:)
    real(wp) :: mean, offset, scale, total
    integer, allocatable :: place(:)
    integer :: cell, m, n, point

    n = assembly%n_dim
    m = n + 1
    call simplex_rule(n, 6, barycentric, weight)
    allocate (place(m * m), unknowns(m, m))
    displacement_error = 0.0_wp
    gradient_error = 0.0_wp
    pressure_error = 0.0_wp
    mean = 0.0_wp
    total = 0.0_wp
    do cell = 1, assembly%n_cell
      place = assembly%get_place(cell)
      unknowns = reshape(assembly%unknowns(place), [m, m])
      associate (gradient => assembly%gradient_old(:, :, cell))
        do point = 1, size(weight)
          call cell_point(kind, assembly, cell, barycentric(:, point), flow, scale)
          scale = scale * weight(point)
          displacement_error = displacement_error + scale &
            * sum((matmul(unknowns(:n, :), barycentric(:, point)) - flow%displacement(:n))**2)
          gradient_error = gradient_error + scale &
            * sum((matmul(unknowns(:n, :), transpose(gradient)) - flow%gradient(:n, :n))**2)
          offset = dot_product(unknowns(m, :), barycentric(:, point)) - flow%pressure
          pressure_error = pressure_error + scale * offset**2
          mean = mean + scale * offset
          total = total + scale
        end do
      end associate
    end do
    displacement_error = sqrt(displacement_error)
    gradient_error = sqrt(gradient_error)
    pressure_error = sqrt(pressure_error - mean**2 / total)

  end subroutine measure

  !> The exact flow at a point of a cell, and the weight of the cell there.
  subroutine cell_point(kind, assembly, cell, barycentric, flow, scale)
    integer, intent(in) :: kind
    type(assembly_t), intent(in) :: assembly
    integer, intent(in) :: cell
    real(wp), intent(in) :: barycentric(:)
    type(flow_t), intent(out) :: flow
    real(wp), intent(out) :: scale

    real(wp) :: x(3)
    integer :: a, n

    n = assembly%n_dim
    x = 0.0_wp
    do a = 1, n + 1
      x(:n) = x(:n) + assembly%coordinates(:, assembly%cells(a, cell)) * barycentric(a)
    end do
    scale = assembly%volume_old(cell)
    select case (kind)
    case (PLANE_STRAIN)
      call plane_flow(x, flow)
    case (AXISYMMETRIC)
      scale = scale * x(1) * 3.0_wp * assembly%hoop_old(cell)
      call axial_flow(x, flow)
    case default
      call solid_flow(x, flow)
    end select

  end subroutine cell_point

  !> sin²(πx) and its first three derivatives.
  pure function bump(x) result(s)
    real(wp), intent(in) :: x
    real(wp) :: s(0:3)

    s = [sin(PI * x)**2, PI * sin(2.0_wp * PI * x), 2.0_wp * PI**2 * cos(2.0_wp * PI * x), &
         -4.0_wp * PI**3 * sin(2.0_wp * PI * x)]

  end function bump

  !> u = curl of sin²(πx) sin²(πy), p = cos(πx) sin(πy)
  pure subroutine plane_flow(x, flow)
    real(wp), intent(in) :: x(3)
    type(flow_t), intent(out) :: flow

    real(wp) :: a(0:3), b(0:3)

    a = bump(x(1))
    b = bump(x(2))
    flow%displacement(1:2) = [a(0) * b(1), -a(1) * b(0)]
    flow%gradient(1, 1:2) = [a(1) * b(1), a(0) * b(2)]
    flow%gradient(2, 1:2) = [-a(2) * b(0), -a(1) * b(1)]
    flow%pressure = cos(PI * x(1)) * sin(PI * x(2))
    flow%force(1) = -a(2) * b(1) - a(0) * b(3) - PI * sin(PI * x(1)) * sin(PI * x(2))
    flow%force(2) = a(3) * b(0) + a(1) * b(2) + PI * cos(PI * x(1)) * cos(PI * x(2))

  end subroutine plane_flow

  !> u = curl of (0, 0, sin²(πx) sin²(πy) sin²(πz)), p = cos(πx) sin(πy) cos(πz)
  pure subroutine solid_flow(x, flow)
    real(wp), intent(in) :: x(3)
    type(flow_t), intent(out) :: flow

    real(wp) :: a(0:3), b(0:3), c(0:3)

    a = bump(x(1))
    b = bump(x(2))
    c = bump(x(3))
    flow%displacement = [a(0) * b(1) * c(0), -a(1) * b(0) * c(0), 0.0_wp]
    flow%gradient(1, :) = [a(1) * b(1) * c(0), a(0) * b(2) * c(0), a(0) * b(1) * c(1)]
    flow%gradient(2, :) = [-a(2) * b(0) * c(0), -a(1) * b(1) * c(0), -a(1) * b(0) * c(1)]
    flow%pressure = cos(PI * x(1)) * sin(PI * x(2)) * cos(PI * x(3))
    flow%force(1) = -(a(2) * b(1) + a(0) * b(3)) * c(0) - a(0) * b(1) * c(2) &
      - PI * sin(PI * x(1)) * sin(PI * x(2)) * cos(PI * x(3))
    flow%force(2) = (a(3) * b(0) + a(1) * b(2)) * c(0) + a(1) * b(0) * c(2) &
      + PI * cos(PI * x(1)) * cos(PI * x(2)) * cos(PI * x(3))
    flow%force(3) = -PI * cos(PI * x(1)) * sin(PI * x(2)) * sin(PI * x(3))

  end subroutine solid_flow

  !> Stokes' stream function r² (1 - r²)² sin²(πz), p = (r² - ½) cos(πz)
  pure subroutine axial_flow(x, flow)
    real(wp), intent(in) :: x(3)
    type(flow_t), intent(out) :: flow

    real(wp) :: g(0:1), b(0:1), r, s(0:3)

    r = x(1)
    s = bump(x(2))
    ! u_r = -g s', u_z = b s, with b = (r g)' / r
    g = [r * (1.0_wp - r**2)**2, 1.0_wp - 6.0_wp * r**2 + 5.0_wp * r**4]
    b = [2.0_wp - 8.0_wp * r**2 + 6.0_wp * r**4, -16.0_wp * r + 24.0_wp * r**3]
    flow%displacement(1:2) = [-g(0) * s(1), b(0) * s(0)]
    flow%gradient(1, 1:2) = [-g(1) * s(1), -g(0) * s(2)]
    flow%gradient(2, 1:2) = [b(1) * s(0), b(0) * s(1)]
    flow%pressure = (r**2 - 0.5_wp) * cos(PI * x(2))
    flow%force(1) = (-16.0_wp * r + 24.0_wp * r**3) * s(1) + g(0) * s(3) &
      + 2.0_wp * r * cos(PI * x(2))
    flow%force(2) = -(-32.0_wp + 96.0_wp * r**2) * s(0) - b(0) * s(2) &
      - (r**2 - 0.5_wp) * PI * sin(PI * x(2))

  end subroutine axial_flow

end module swage_test_manufactured
