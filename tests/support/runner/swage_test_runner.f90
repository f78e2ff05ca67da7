!> Runs the tests of one executable, each on the number of ranks it asks for.
module swage_test_runner
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: int64, output_unit
  use mpi_f08, only: MPI_Allreduce, MPI_Comm, MPI_Comm_free, MPI_Comm_rank, MPI_Comm_size, &
                     MPI_Comm_split, MPI_COMM_NULL, MPI_COMM_WORLD, MPI_Finalize, MPI_Ibarrier, &
                     MPI_Init, MPI_INTEGER, MPI_LOGICAL, MPI_LOR, MPI_Request, &
                     MPI_STATUS_IGNORE, MPI_SUM, MPI_Test, MPI_UNDEFINED, operator(/=)
  use swage_test_failures, only: anyExceptions, clear_failures, label_failures
  implicit none(type, external)
  private

  public :: MpiTestMethod, test_runner_t

  !> What a test that runs on several ranks is given, under the names of pFUnit.
  type :: MpiTestMethod
    private
    type(MPI_Comm) :: comm = MPI_COMM_NULL
  contains
    !> Ranks that run the test.
    procedure, public :: getNumProcesses => method_size
    !> This rank, from 0.
    procedure, public :: getProcessRank => method_rank
    !> Their communicator as an integer handle; the runner frees it.
    procedure, public :: getMpiCommunicator => method_handle
    !> Collective. True when an assertion failed on any rank of the test.
    procedure, public :: any_failed => method_any_failed
  end type MpiTestMethod

  !> The run of one executable. Every binding is collective over all ranks.
  type :: test_runner_t
    private
    integer :: rank = 0
    integer :: size = 1
    integer :: n_passed = 0
    integer :: n_failed = 0
    integer :: n_skipped = 0
    character(len=128) :: title = ''
    integer(int64) :: started = 0_int64
  contains
    !> Start MPI.
    procedure, public :: start => runner_start
    !> True on the ranks that shall now run the test.
    procedure, public :: begins => runner_begins
    !> Wait for the other ranks, count and print the outcome.
    procedure, public :: ends => runner_ends
    !> Count a test that is switched off.
    procedure, public :: skips => runner_skips
    !> Print the sums and end the program, with exit code 1 after a failure.
    procedure, public :: finish => runner_finish
  end type test_runner_t

  interface
    !> Of POSIX: sleep that many microseconds.
    function usleep(microseconds) bind(C, name='usleep') result(outcome)
      import :: c_int
      implicit none(type, external)
      integer(c_int), value :: microseconds
      integer(c_int) :: outcome
    end function usleep
  end interface

contains

  function method_size(self) result(n_rank)
    class(MpiTestMethod), intent(in) :: self
    integer :: n_rank

    call MPI_Comm_size(self%comm, n_rank)

  end function method_size

  function method_rank(self) result(rank)
    class(MpiTestMethod), intent(in) :: self
    integer :: rank

    call MPI_Comm_rank(self%comm, rank)

  end function method_rank

  function method_handle(self) result(handle)
    class(MpiTestMethod), intent(in) :: self
    integer :: handle

    handle = self%comm%mpi_val

  end function method_handle

  function method_any_failed(self) result(any_failed)
    class(MpiTestMethod), intent(in) :: self
    logical :: any_failed

    logical :: mine

    mine = anyExceptions()
    call MPI_Allreduce(mine, any_failed, 1, MPI_LOGICAL, MPI_LOR, self%comm)

  end function method_any_failed

  subroutine runner_start(self)
    class(test_runner_t), intent(inout) :: self

    call MPI_Init()
    call MPI_Comm_rank(MPI_COMM_WORLD, self%rank)
    call MPI_Comm_size(MPI_COMM_WORLD, self%size)

  end subroutine runner_start

  function runner_begins(self, name, n_rank, method) result(takes_part)
    class(test_runner_t), intent(inout) :: self
    !> Module and procedure.
    character(len=*), intent(in) :: name
    !> Ranks that the test asks for; 0 when it asks for none and runs on rank 0 alone.
    integer, intent(in) :: n_rank
    !> Holds the communicator of the test, on the ranks that take part.
    type(MpiTestMethod), intent(inout) :: method
    logical :: takes_part

    character(len=16) :: label
    integer :: colour

    self%title = name
    label = ''
    if (n_rank > 0) then
      write (label, '(a, i0, a)') ' [', n_rank, ' ranks]'
      if (n_rank == 1) label = ' [1 rank]'
      self%title = name // trim(label)
      write (label, '(a, i0)') 'rank ', self%rank
      if (n_rank == 1) label = ''
    end if
    call clear_failures()
    call label_failures(label)
    call system_clock(self%started)

    takes_part = .false.
    if (n_rank > self%size) return
    takes_part = self%rank < max(n_rank, 1)
    colour = merge(0, MPI_UNDEFINED, takes_part)
    call MPI_Comm_split(MPI_COMM_WORLD, colour, self%rank, method%comm)

  end function runner_begins

  subroutine runner_ends(self, n_rank, method)
    class(test_runner_t), intent(inout) :: self
    integer, intent(in) :: n_rank
    type(MpiTestMethod), intent(inout) :: method

    integer :: mine, n_rank_failed
    integer(int64) :: now, ticks

    call wait_for_all()
    mine = merge(1, 0, anyExceptions())
    call MPI_Allreduce(mine, n_rank_failed, 1, MPI_INTEGER, MPI_SUM, MPI_COMM_WORLD)
    if (method%comm /= MPI_COMM_NULL) call MPI_Comm_free(method%comm)
    call system_clock(now, ticks)

    if (n_rank > self%size) then
      self%n_failed = self%n_failed + 1
      if (self%rank == 0) write (output_unit, '(a, i0, a)') 'FAIL ' // trim(self%title) &
        // ': started on ', self%size, ' ranks only (MAX_PES)'
    else if (n_rank_failed > 0) then
      self%n_failed = self%n_failed + 1
      if (self%rank == 0) write (output_unit, '(a)') 'FAIL ' // trim(self%title)
    else
      self%n_passed = self%n_passed + 1
      if (self%rank == 0) write (output_unit, '(a, f0.2, a)') 'ok   ' // trim(self%title) // ' (', &
        real(now - self%started) / real(ticks), ' s)'
    end if
    flush (output_unit)

  end subroutine runner_ends

  subroutine runner_skips(self, name)
    class(test_runner_t), intent(inout) :: self
    character(len=*), intent(in) :: name

    self%n_skipped = self%n_skipped + 1
    if (self%rank == 0) write (output_unit, '(a)') 'skip ' // name

  end subroutine runner_skips

  subroutine runner_finish(self)
    class(test_runner_t), intent(inout) :: self

    if (self%rank == 0) then
      if (self%n_skipped > 0) then
        write (output_unit, '(i0, a, i0, a, i0, a)') self%n_passed, ' passed, ', self%n_failed, &
          ' failed, ', self%n_skipped, ' skipped'
      else
        write (output_unit, '(i0, a, i0, a)') self%n_passed, ' passed, ', self%n_failed, ' failed'
      end if
      flush (output_unit)
    end if
    call MPI_Finalize()
    ! Rank 0 alone reports the failure: one rank's code is enough for mpirun.
    if (self%n_failed > 0 .and. self%rank == 0) stop 1, quiet=.true.

  end subroutine runner_finish

  !> Sleep until every rank is here. A plain barrier would keep a core busy on each rank that
  !> takes no part in the test.
  subroutine wait_for_all()
    type(MPI_Request) :: request
    logical :: complete
    integer(c_int) :: outcome

    call MPI_Ibarrier(MPI_COMM_WORLD, request)
    do
      call MPI_Test(request, complete, MPI_STATUS_IGNORE)
      if (complete) exit
      outcome = usleep(500_c_int)
      if (outcome /= 0_c_int) cycle
    end do

  end subroutine wait_for_all

end module swage_test_runner
