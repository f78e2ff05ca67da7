!> CPU time of residual and tangent, per cell: of a whole evaluation, and of its phases.
!>
!> usage: bench_assembly CASE.nml [REPETITIONS]
!>
!> The bodies of the case, at rest, are given a homogeneous strain increment of 1 %, in which J2
!> metals flow, and the step is evaluated again and again. The phases of one batch are repeated by
!> themselves, so their data lie in the cache, but for the matrix; what the whole takes beyond their
!> sum is gathering and scattering in memory, contact and boundaries. Of a few runs on a loaded
!> machine the smallest counts. For comparison between machines the whole is also given in products
!> of two matrices of 16 rows, which lie in the cache, and the matrix beside a copy of itself.
program bench_assembly
  use swage, only: comm_t, environment_start, environment_stop, simulation_t, status_t, wp
  implicit none(type, external)

  real(wp), parameter :: NANOSECOND = 1.0e-9_wp
  !> Rows of the matrices that are multiplied, and products that are timed together.
  integer, parameter :: N_ROW = 16
  integer, parameter :: N_PRODUCT = 10000
  type(comm_t) :: comm
  type(simulation_t) :: simulation
  type(status_t) :: status
  character(len=32) :: word
  integer :: n_repeat

  n_repeat = 20
  if (command_argument_count() > 1) then
    word = argument(2)
    read (word, *) n_repeat
  end if
  call environment_start(comm)
  call simulation%start(argument(1), comm, status)
  if (.not. status%failed()) call measure(simulation, n_repeat, status)
  call simulation%finish(status)
  call environment_stop()
  if (status%failed()) error stop status%message

contains

  subroutine measure(simulation, n_repeat, status)
    type(simulation_t), intent(inout) :: simulation
    integer, intent(in) :: n_repeat
    type(status_t), intent(inout) :: status

    real(wp) :: finish, law, least, scatter, start, whole
    integer :: batch, n, n_batch, n_failed, repetition

    associate (problem => simulation%mechanics, time => simulation%get_time())
      call problem%begin_step(time, time + 0.02_wp * simulation%get_end(), .false., status)
      if (status%failed()) return
      n = problem%mesh%dimension
      problem%increment = 0.005_wp * problem%mesh%coordinates
      problem%increment(n, :) = -(n - 1) * problem%increment(n, :)
      least = huge(1.0_wp)
      do repetition = 1, n_repeat
        whole = seconds()
        call problem%evaluate(status)
        least = min(least, seconds() - whole)
        if (status%failed()) return
      end do
      n = problem%mesh%n_cell
      write (*, '(a,i0,a,i0,a)') 'cells ', n, ', nodes ', problem%mesh%n_node, ''
      write (*, '(a,f8.1)') 'whole evaluation  [ns/cell]', least / (n * NANOSECOND)
      write (*, '(a,f8.1)') 'cells that flow   [%]      ', &
        100.0_wp * count(problem%relaxation_new < 1.0_wp) / n

      ! As many batches as the mesh has, from the cache
      n_batch = (n + problem%element%n_cell - 1) / problem%element%n_cell
      start = huge(1.0_wp)
      law = huge(1.0_wp)
      finish = huge(1.0_wp)
      scatter = huge(1.0_wp)
      do repetition = 1, n_repeat
        whole = seconds()
        do batch = 1, n_batch
          call problem%element%start(problem%points)
        end do
        start = min(start, seconds() - whole)
        whole = seconds()
        do batch = 1, n_batch
          associate (range => problem%batches(size(problem%batches)))
            call problem%materials(range%material)%law%update(problem%points, n_failed)
          end associate
        end do
        law = min(law, seconds() - whole)
        whole = seconds()
        do batch = 1, n_batch
          call problem%element%finish(problem%points, .true.)
        end do
        finish = min(finish, seconds() - whole)
        whole = seconds()
        do batch = 1, size(problem%batches)
          associate (range => problem%batches(batch))
            call problem%matrix%add_cells(problem%cell_order(range%first:range%last), &
                                          problem%element%tangent)
          end associate
        end do
        scatter = min(scatter, seconds() - whole)
      end do
      n_batch = n_batch * problem%element%n_cell
      write (*, '(a,f8.1)') 'kinematics        [ns/cell]', start / (n_batch * NANOSECOND)
      write (*, '(a,f8.1)') 'law               [ns/cell]', law / (n_batch * NANOSECOND)
      write (*, '(a,f8.1)') 'residual, tangent [ns/cell]', finish / (n_batch * NANOSECOND)
      write (*, '(a,f8.1)') 'matrix            [ns/cell]', scatter / (n * NANOSECOND)
      call problem%reject_step()
      whole = product_time(n_repeat)
      write (*, '(a,f8.1)') 'copy of the matrix [ns/cell]', &
        copy_time(problem%matrix%values, n_repeat) / (n * NANOSECOND)
      write (*, '(a,f8.1)') 'product of 16 rows [ns]     ', whole / NANOSECOND
      write (*, '(a,f9.2)') 'whole, in products of 16 rows', least / (n * whole)
    end associate

  end subroutine measure

  !> Of one product of two small matrices [s].
  function product_time(n_repeat) result(least)
    integer, intent(in) :: n_repeat
    real(wp) :: least

    real(wp) :: a(N_ROW, N_ROW), b(N_ROW, N_ROW), c(N_ROW, N_ROW), start
    integer :: i, repetition

    call random_number(a)
    call random_number(b)
    c = 0.0_wp
    least = huge(1.0_wp)
    do repetition = 1, n_repeat
      start = seconds()
      do i = 1, N_PRODUCT
        call add_product(a, b, c)
      end do
      least = min(least, seconds() - start)
    end do
    if (.not. all(c > 0.0_wp)) error stop 'no product'
    least = least / N_PRODUCT

  end function product_time

  pure subroutine add_product(a, b, c)
    real(wp), intent(in) :: a(N_ROW, N_ROW), b(N_ROW, N_ROW)
    real(wp), intent(inout) :: c(N_ROW, N_ROW)

    integer :: i, j, k

    do j = 1, N_ROW
      do k = 1, N_ROW
        ! The directive keeps gfortran from unrolling the loop before it finds that it is a vector
        !GCC$ unroll 1
        do i = 1, N_ROW
          c(i, j) = c(i, j) + a(i, k) * b(k, j)
        end do
      end do
    end do

  end subroutine add_product

  !> Of a copy [s].
  function copy_time(values, n_repeat) result(least)
    real(wp), intent(in) :: values(:, :, :)
    integer, intent(in) :: n_repeat
    real(wp) :: least

    real(wp), allocatable :: copy(:, :, :)
    real(wp) :: start
    integer :: repetition

    allocate (copy, source=values)
    least = huge(1.0_wp)
    do repetition = 1, n_repeat
      start = seconds()
      copy = values
      least = min(least, seconds() - start)
      if (.not. copy(1, 1, 1) < huge(1.0_wp)) error stop 'no copy'
    end do

  end function copy_time

  !> CPU time [s].
  function seconds() result(time)
    real(wp) :: time

    call cpu_time(time)

  end function seconds

  !> Of the command line.
  function argument(i) result(word)
    integer, intent(in) :: i
    character(len=:), allocatable :: word

    integer :: length

    call get_command_argument(i, length=length)
    allocate (character(len=length) :: word)
    call get_command_argument(i, word)

  end function argument

end program bench_assembly
