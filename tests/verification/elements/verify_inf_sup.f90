!> Benchmark A4: the numerical inf-sup test of Chapelle and Bathe (Comput. Struct. 47 (1993)
!> 537–545). The constant β is the root of the smallest positive eigenvalue of B K^-1 B^T against
!> the mass matrix of the pressure; it stays where it is as the mesh is refined when the element is
!> stable. Without the bubble it falls with the size of the cells.
program verify_inf_sup
  use swage_kinds, only: wp
  use swage_material_law, only: material_law_t
  use swage_cell_geometry, only: PLANE_STRAIN, THREE_DIMENSIONAL
  use swage_test_assembly, only: assembly_create, assembly_t
  use swage_test_element_checks, only: KIND_NAMES, KINDS
  use swage_test_lapack, only: dgemm, dpotrf, dpotrs, dsygv
  use swage_test_laws, only: make_elastic
  use swage_test_manufactured, only: free_component
  use swage_test_meshes, only: box_mesh, rectangle_mesh
  use swage_test_rows, only: print_row
  implicit none(type, external)

  integer, parameter :: SIZES_2D(5) = [2, 4, 8, 16, 32]
  integer, parameter :: SIZES_3D(4) = [2, 4, 6, 8]
  integer :: i

  do i = 1, size(KINDS)
    if (KINDS(i) == THREE_DIMENSIONAL) then
      call rows_of(i, SIZES_3D, '8/4')
    else
      call rows_of(i, SIZES_2D, '32/4')
    end if
  end do

contains

  subroutine rows_of(i, sizes, sizes_name)
    integer, intent(in) :: i
    integer, intent(in) :: sizes(:)
    character(len=*), intent(in) :: sizes_name

    real(wp), allocatable :: beta(:)
    real(wp) :: order, ratio
    integer :: j, n

    n = size(sizes)
    allocate (beta(n))
    do j = 1, n
      call inf_sup_constant(KINDS(i), sizes(j), 1.0_wp, beta(j))
    end do
    print '(a, *(es12.4))', 'P1+/P1, '//trim(KIND_NAMES(i))//', beta:', beta
    ratio = beta(n) / beta(2)
    call print_row('A4 inf-sup, '//trim(KIND_NAMES(i))//': beta(n = '//sizes_name//')', ratio, &
                   1.0_wp, max(0.0_wp, 1.0_wp - ratio), 0.2_wp)

    do j = 1, n
      call inf_sup_constant(KINDS(i), sizes(j), 0.0_wp, beta(j))
    end do
    print '(a, *(es12.4))', 'P1/P1, '//trim(KIND_NAMES(i))//', beta:', beta
    if (KINDS(i) == PLANE_STRAIN) then
      order = log(beta(n - 1) / beta(n)) / log(real(sizes(n), wp) / real(sizes(n - 1), wp))
      call print_row('A4 inf-sup, plane strain: order of beta without bubble', order, 1.0_wp, &
                     max(0.0_wp, 1.0_wp - order), 0.1_wp)
    end if

  end subroutine rows_of

  subroutine inf_sup_constant(kind, n, bubble_factor, beta)
    integer, intent(in) :: kind
    !> Divisions of a side.
    integer, intent(in) :: n
    !> 1 with the bubble, 0 without.
    real(wp), intent(in) :: bubble_factor
    real(wp), intent(out) :: beta

    !> Eigenvalues below this part of the largest one are zero.
    real(wp), parameter :: ZERO = 1.0e-10_wp
    class(material_law_t), allocatable :: law
    type(assembly_t) :: assembly
    real(wp), allocatable :: coupling(:, :), eigenvalues(:), mass(:, :), matrix(:, :), &
      schur(:, :), solved(:, :), stiffness(:, :), work(:), x(:, :)
    real(wp) :: shear_modulus
    integer, allocatable :: cells(:, :), pressures(:), moving(:)
    integer :: a, b, cell, component, info, m, n_moving, n_node, node

    if (kind == THREE_DIMENSIONAL) then
      call box_mesh(n, x, cells)
    else
      call rectangle_mesh(n, n, x, cells)
    end if
    n_node = size(x, 2)
    m = size(x, 1) + 1
    ! K is the integral of the product of the deviatoric strains
    call make_elastic(1.5_wp, 0.5_wp, law, shear_modulus)
    call assembly_create(kind, .true., law, x, cells, assembly)
    assembly%bubble_factor = bubble_factor
    call assembly%evaluate()
    call assembly%get_dense(matrix)

    allocate (pressures(n_node), moving(m * n_node))
    n_moving = 0
    do node = 1, n_node
      pressures(node) = m * node
      do component = 1, m - 1
        if (.not. free_component(kind, component, x(:, node))) cycle
        n_moving = n_moving + 1
        moving(n_moving) = m * (node - 1) + component
      end do
    end do
    allocate (stiffness(n_moving, n_moving), coupling(n_moving, n_node), &
              solved(n_moving, n_node), schur(n_node, n_node))
    stiffness = matrix(moving(:n_moving), moving(:n_moving))
    coupling = matrix(moving(:n_moving), pressures)
    schur = -matrix(pressures, pressures)
    deallocate (matrix)

    allocate (mass(n_node, n_node), source=0.0_wp)
    do cell = 1, size(cells, 2)
      do b = 1, m
        do a = 1, m
          mass(cells(a, cell), cells(b, cell)) = mass(cells(a, cell), cells(b, cell)) &
            + assembly%volume_old(cell) * merge(2.0_wp, 1.0_wp, a == b) &
            / (m * (m + 1))
        end do
      end do
    end do

    solved = coupling
    call dpotrf('U', n_moving, stiffness, n_moving, info)
    call dpotrs('U', n_moving, n_node, stiffness, n_moving, solved, n_moving, info)
    call dgemm('T', 'N', n_node, n_node, n_moving, 1.0_wp, coupling, n_moving, solved, n_moving, &
               1.0_wp, schur, n_node)
    allocate (eigenvalues(n_node), work(64 * n_node))
    call dsygv(1, 'N', 'U', n_node, schur, n_node, mass, n_node, eigenvalues, work, size(work), &
               info)
    beta = sqrt(minval(eigenvalues, mask=eigenvalues > ZERO * maxval(eigenvalues)))

  end subroutine inf_sup_constant

end program verify_inf_sup
