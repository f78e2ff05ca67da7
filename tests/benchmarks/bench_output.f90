!> Speed of writing results, and the memory that it takes of each rank.
!>
!> usage: bench_output FOLDER CELLS STEPS
!>
!> All ranks write steps of a grid of that many tetrahedra, with vectors at the points and scalars
!> and a tensor in the cells, as a run does. Prints megabytes in the file, elapsed seconds, peak
!> memory in megabytes before and after: of rank 0, of the largest other rank. The grid itself is
!> made before.
program bench_output
  use swage, only: comm_t, environment_start, environment_stop, status_t, wp
  use swage_memory, only: peak_memory
  use swage_units, only: units_create, units_t
  use swage_vtkhdf, only: vtkhdf_t, VTK_TETRAHEDRON
  implicit none(type, external)

  !> Cells for each point, as in a large mesh.
  integer, parameter :: CELLS_BY_POINT = 5
  !> Bytes of a point and of a cell in the file.
  real(wp), parameter :: BYTES(2) = [24.0_wp + 2 * 12.0_wp, 32.0_wp + 8.0_wp + 1.0_wp + 8 * 4.0_wp]
  type(comm_t) :: comm
  type(status_t) :: status

  call environment_start(comm)
  call measure(trim(argument(1)), number(2) / comm%size, number(3), status)
  call environment_stop()
  if (status%failed()) error stop status%message

contains

  subroutine measure(folder, n_cell, n_step, status)
    character(len=*), intent(in) :: folder
    !> Of this rank.
    integer, intent(in) :: n_cell
    integer, intent(in) :: n_step
    type(status_t), intent(inout) :: status

    integer, allocatable :: connectivity(:), offsets(:), types(:)
    integer :: clock(3), i, n_point, step
    real(wp), allocatable :: points(:, :), scalars(:), tensors(:, :)
    real(wp) :: after(2), before(2)
    type(units_t) :: units
    type(vtkhdf_t) :: results

    n_point = n_cell / CELLS_BY_POINT
    allocate (points(3, n_point), scalars(n_cell), tensors(6, n_cell))
    call random_number(points)
    call random_number(scalars)
    call random_number(tensors)
    allocate (connectivity, source=[(mod(i, n_point), i=1, 4 * n_cell)])
    allocate (offsets, source=[(4 * i, i=0, n_cell)])
    allocate (types(n_cell), source=VTK_TETRAHEDRON)
    call units_create('SI', units, status)
    before = memory()

    call system_clock(clock(1), clock(3))
    call results%open(folder//'/bench_output.vtkhdf', comm, units, status)
    do step = 1, n_step
      if (status%failed()) exit
      call results%begin_step(real(step, wp), points, connectivity, offsets, types, status)
      call results%point_field('displacement', points, 'length', 'benchmark', status)
      call results%point_field('velocity', points, 'length/time', 'benchmark', status)
      call results%cell_field('strain', scalars, '1', 'benchmark', status)
      call results%cell_field('volume_ratio', scalars, '1', 'benchmark', status)
      call results%cell_tensor_field('stress', tensors, 'stress', 'benchmark', status)
      call results%end_step(status)
    end do
    call results%close()
    call system_clock(clock(2))
    after = memory()
    if (comm%rank == 0) then
      write (*, '(6f12.3)') 1.0e-6_wp * n_step * comm%size * sum(BYTES * [n_point, n_cell]), &
        real(clock(2) - clock(1), wp) / clock(3), before, after
    end if

  end subroutine measure

  !> Collective. Peak memory of rank 0, and of the largest other rank.
  function memory() result(megabytes)
    real(wp) :: megabytes(2)

    megabytes = [merge(peak_memory(), 0.0_wp, comm%rank == 0), &
                 merge(peak_memory(), 0.0_wp, comm%rank > 0)]
    call comm%max(megabytes(1))
    call comm%max(megabytes(2))

  end function memory

  function number(place) result(value)
    integer, intent(in) :: place
    integer :: value

    character(len=256) :: word

    word = argument(place)
    read (word, *) value

  end function number

  function argument(place) result(word)
    integer, intent(in) :: place
    character(len=256) :: word

    call get_command_argument(place, word)

  end function argument

end program bench_output
