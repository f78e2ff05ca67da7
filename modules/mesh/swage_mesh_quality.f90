!> Shape of the cells of a mesh.
module swage_mesh_quality
  use swage_comm, only: comm_t
  use swage_kinds, only: gp, wp
  use swage_mesh, only: cell_measure, mesh_t
  use swage_status, only: status_t, EXIT_CONVERGENCE, STATUS_RETRY
  implicit none(type, external)
  private

  public :: mesh_quality_t, cell_quality, measure_quality, check_mesh

  !> Quality of all cells of all ranks; the same on all ranks.
  type :: mesh_quality_t
    !> Lowest quality of a cell [1].
    real(wp) :: minimum = 1.0_wp
    !> Mean quality of the cells [1].
    real(wp) :: mean = 1.0_wp
    !> Cells of negative or no volume.
    integer(gp) :: n_inverted = 0_gp
    !> Number in the mesh file of a cell with the lowest quality.
    integer(gp) :: worst_cell = 0_gp
  end type mesh_quality_t

contains

  !> Mean ratio of a cell [1]: 1 for the regular one, 0 for a flat one, negative when inverted.
  !>
  !> Triangle: 4 √3 A / Σ l²; tetrahedron: 12 (3 |V|)^(2/3) / Σ l² with the sign of V.
  !> Source: Liu and Joe (1994), BIT 34, 268-287.
  pure function cell_quality(corners) result(quality)
    !> Positions [length]; shape (dimension, dimension + 1).
    real(wp), intent(in) :: corners(:, :)
    real(wp) :: quality

    real(wp) :: measure, squares
    integer :: i, j

    squares = 0.0_wp
    do i = 2, size(corners, 2)
      do j = 1, i - 1
        squares = squares + sum((corners(:, i) - corners(:, j))**2)
      end do
    end do
    quality = 0.0_wp
    if (.not. squares > 0.0_wp) return
    measure = cell_measure(corners)
    if (size(corners, 1) == 2) then
      quality = 4.0_wp * sqrt(3.0_wp) * measure / squares
    else
      quality = sign(12.0_wp * (3.0_wp * abs(measure))**(2.0_wp / 3.0_wp) / squares, measure)
    end if

  end function cell_quality

  !> Collective. Quality of the whole mesh in its present shape.
  subroutine measure_quality(mesh, comm, quality)
    type(mesh_t), intent(in) :: mesh
    type(comm_t), intent(in) :: comm
    type(mesh_quality_t), intent(out) :: quality

    real(wp) :: lowest, value
    integer(gp) :: worst
    integer :: cell

    quality%mean = 0.0_wp
    lowest = huge(lowest)
    worst = huge(worst)
    do cell = 1, mesh%n_cell
      value = cell_quality(mesh%coordinates(:, mesh%cell_node(:, cell)))
      quality%mean = quality%mean + value
      if (.not. value > 0.0_wp) quality%n_inverted = quality%n_inverted + 1_gp
      if (value < lowest) then
        lowest = value
        worst = mesh%cell_tag(cell)
      end if
    end do
    quality%minimum = lowest
    call comm%min(quality%minimum)
    ! Of the ranks' worst cells, those that are worst of all take part.
    if (lowest > quality%minimum) worst = huge(worst)
    call comm%min(worst)
    quality%worst_cell = worst
    call comm%sum(quality%mean)
    quality%mean = quality%mean / real(mesh%n_cell_global, wp)
    call comm%sum(quality%n_inverted)

  end subroutine measure_quality

  !> Collective. Find out whether cells have inverted since the mesh was read.
  subroutine check_mesh(mesh, comm, quality, status)
    type(mesh_t), intent(in) :: mesh
    type(comm_t), intent(in) :: comm
    type(mesh_quality_t), intent(out) :: quality
    !> `STATUS_RETRY`, the same on all ranks, when a cell is inverted: a shorter step may avoid it.
    type(status_t), intent(inout) :: status

    character(len=256) :: message

    call measure_quality(mesh, comm, quality)
    if (quality%n_inverted == 0_gp) return
    write (message, '(i0,a,i0,a)') quality%n_inverted, &
      ' cells have no positive volume, the worst is cell ', quality%worst_cell, ' of the mesh file'
    call status%raise(STATUS_RETRY, 'check_mesh', trim(message), EXIT_CONVERGENCE)

  end subroutine check_mesh

end module swage_mesh_quality
